/* FMI 2.0 for co-simulation. The types are those of the standard (fmi2TypesPlatform.h, "default"). */
#include "model.h"
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

typedef void *component;
typedef unsigned int reference;
typedef int boolean;
typedef int integer;
typedef const char *text;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } status;

API text fmi2GetTypesPlatform(void) { return "default"; }
API text fmi2GetVersion(void) { return "2.0"; }
API status fmi2SetDebugLogging(component c, boolean on, size_t n, const text names[])
{
    (void)c; (void)on; (void)n; (void)names;
    return OK;
}

API component fmi2Instantiate(text name, int kind, text token, text resources, const void *functions, boolean visible, boolean logging)
{
    (void)name; (void)resources; (void)functions; (void)visible; (void)logging;
    if (kind != 1 || token == NULL || strcmp(token, model_token) != 0) { return NULL; }
    return model_new();
}
API void fmi2FreeInstance(component c) { free(c); }

API status fmi2SetupExperiment(component c, boolean bounded, double tolerance, double start, boolean ends, double stop)
{
    (void)bounded; (void)tolerance; (void)ends; (void)stop;
    model_start(c, start);
    return OK;
}
API status fmi2EnterInitializationMode(component c) { (void)c; return OK; }
API status fmi2ExitInitializationMode(component c) { model_begin(c, model_time(c)); return OK; }
API status fmi2Terminate(component c) { (void)c; return OK; }
API status fmi2Reset(component c) { model_reset(c); return OK; }

API status fmi2GetReal(component c, const reference r[], size_t n, double value[])
{
    for (size_t k = 0; k < n; k++) { if (!model_get(c, r[k], &value[k])) { return ERROR; } }
    return OK;
}
API status fmi2SetReal(component c, const reference r[], size_t n, const double value[])
{
    for (size_t k = 0; k < n; k++) { if (!model_set(c, r[k], value[k])) { return ERROR; } }
    return OK;
}
/* There are real variables only. */
#define NONE(name, type) \
    API status name(component c, const reference r[], size_t n, type value[]) \
    { (void)c; (void)r; (void)value; return n == 0 ? OK : ERROR; }
NONE(fmi2GetInteger, integer)
NONE(fmi2GetBoolean, boolean)
NONE(fmi2GetString, text)
NONE(fmi2SetInteger, const integer)
NONE(fmi2SetBoolean, const boolean)
NONE(fmi2SetString, const text)

API status fmi2GetFMUstate(component c, void **kept)
{
    if (*kept != NULL) { model_assign(*kept, c); } else { *kept = model_copy(c); }
    return *kept == NULL ? ERROR : OK;
}
API status fmi2SetFMUstate(component c, void *kept) { model_assign(c, kept); return OK; }
API status fmi2FreeFMUstate(component c, void **kept) { (void)c; free(*kept); *kept = NULL; return OK; }
API status fmi2SerializedFMUstateSize(component c, void *kept, size_t *n)
{
    (void)c; (void)kept; *n = model_size();
    return OK;
}
API status fmi2SerializeFMUstate(component c, void *kept, char bytes[], size_t n)
{
    (void)c;
    if (n < model_size()) { return ERROR; }
    memcpy(bytes, kept, model_size());
    return OK;
}
API status fmi2DeSerializeFMUstate(component c, const char bytes[], size_t n, void **kept)
{
    if (n < model_size()) { return ERROR; }
    if (*kept == NULL) { *kept = model_copy(c); }
    if (*kept == NULL) { return ERROR; }
    memcpy(*kept, bytes, model_size());
    return OK;
}
API status fmi2GetDirectionalDerivative(component c, const reference u[], size_t n, const reference k[], size_t m, const double d[], double s[])
{
    (void)c; (void)u; (void)n; (void)k; (void)m; (void)d; (void)s;
    return ERROR;
}
API status fmi2SetRealInputDerivatives(component c, const reference r[], size_t n, const integer order[], const double value[])
{
    (void)c; (void)r; (void)n; (void)order; (void)value;
    return ERROR;
}
API status fmi2GetRealOutputDerivatives(component c, const reference r[], size_t n, const integer order[], double value[])
{
    (void)c; (void)r; (void)n; (void)order; (void)value;
    return ERROR;
}
API status fmi2DoStep(component c, double now, double length, boolean kept)
{
    (void)now; (void)kept;
    if (!(length >= 0.0)) { return ERROR; }
    return model_advance(c, length) ? OK : ERROR;
}
API status fmi2CancelStep(component c) { (void)c; return ERROR; }
API status fmi2GetStatus(component c, int kind, status *value) { (void)c; (void)kind; (void)value; return DISCARD; }
API status fmi2GetRealStatus(component c, int kind, double *value)
{
    if (kind != 2) { return DISCARD; }
    *value = model_time(c);
    return OK;
}
API status fmi2GetIntegerStatus(component c, int kind, integer *value) { (void)c; (void)kind; (void)value; return DISCARD; }
API status fmi2GetBooleanStatus(component c, int kind, boolean *value) { (void)c; (void)kind; (void)value; return DISCARD; }
API status fmi2GetStringStatus(component c, int kind, text *value) { (void)c; (void)kind; (void)value; return DISCARD; }
