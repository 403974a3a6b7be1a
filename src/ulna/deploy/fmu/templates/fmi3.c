/* FMI 3.0 for co-simulation. The types are those of the standard (fmi3PlatformTypes.h). Importers look for every function. */
#include "model.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

typedef void *instance;
typedef uint32_t reference;
typedef const char *text;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } status;

API text fmi3GetVersion(void) { return "3.0"; }
API status fmi3SetDebugLogging(instance c, bool on, size_t n, const text names[])
{
    (void)c; (void)on; (void)n; (void)names;
    return OK;
}
API instance fmi3InstantiateCoSimulation(text name, text token, text resources, bool visible, bool logging, bool events,
    bool early, const reference needed[], size_t n, void *environment, void *log, void *update)
{
    (void)name; (void)resources; (void)visible; (void)logging; (void)events; (void)early; (void)needed; (void)n;
    (void)environment; (void)log; (void)update;
    if (token == NULL || strcmp(token, model_token) != 0) { return NULL; }
    return model_new();
}
API instance fmi3InstantiateModelExchange(text name, text token, text resources, bool visible, bool logging, void *environment, void *log)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)environment; (void)log;
    return NULL;
}
API instance fmi3InstantiateScheduledExecution(text name, text token, text resources, bool visible, bool logging, void *environment,
    void *log, void *clock, void *lock, void *unlock)
{
    (void)name; (void)token; (void)resources; (void)visible; (void)logging; (void)environment; (void)log;
    (void)clock; (void)lock; (void)unlock;
    return NULL;
}
API void fmi3FreeInstance(instance c) { free(c); }
API status fmi3EnterInitializationMode(instance c, bool bounded, double tolerance, double start, bool ends, double stop)
{
    (void)bounded; (void)tolerance; (void)ends; (void)stop;
    model_start(c, start);
    return OK;
}
API status fmi3ExitInitializationMode(instance c) { model_begin(c, model_time(c)); return OK; }
API status fmi3EnterEventMode(instance c) { (void)c; return ERROR; }
API status fmi3Terminate(instance c) { (void)c; return OK; }
API status fmi3Reset(instance c) { model_reset(c); return OK; }

API status fmi3GetFloat64(instance c, const reference r[], size_t n, double value[], size_t m)
{
    if (m < n) { return ERROR; }
    for (size_t k = 0; k < n; k++) { if (!model_get(c, r[k], &value[k])) { return ERROR; } }
    return OK;
}
API status fmi3SetFloat64(instance c, const reference r[], size_t n, const double value[], size_t m)
{
    if (m < n) { return ERROR; }
    for (size_t k = 0; k < n; k++) { if (!model_set(c, r[k], value[k])) { return ERROR; } }
    return OK;
}
/* There are variables of 64-bit floating point only. */
#define NONE(kind, type) \
    API status fmi3Get##kind(instance c, const reference r[], size_t n, type value[], size_t m) \
    { (void)c; (void)r; (void)value; (void)m; return n == 0 ? OK : ERROR; } \
    API status fmi3Set##kind(instance c, const reference r[], size_t n, const type value[], size_t m) \
    { (void)c; (void)r; (void)value; (void)m; return n == 0 ? OK : ERROR; }
NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(Boolean, bool)
NONE(String, text)
API status fmi3GetBinary(instance c, const reference r[], size_t n, size_t sizes[], const uint8_t *value[], size_t m)
{
    (void)c; (void)r; (void)sizes; (void)value; (void)m;
    return n == 0 ? OK : ERROR;
}
API status fmi3SetBinary(instance c, const reference r[], size_t n, const size_t sizes[], const uint8_t *const value[], size_t m)
{
    (void)c; (void)r; (void)sizes; (void)value; (void)m;
    return n == 0 ? OK : ERROR;
}
API status fmi3GetClock(instance c, const reference r[], size_t n, bool value[])
{
    (void)c; (void)r; (void)value;
    return n == 0 ? OK : ERROR;
}
API status fmi3SetClock(instance c, const reference r[], size_t n, const bool value[])
{
    (void)c; (void)r; (void)value;
    return n == 0 ? OK : ERROR;
}

API status fmi3GetFMUState(instance c, void **kept)
{
    if (*kept != NULL) { model_assign(*kept, c); } else { *kept = model_copy(c); }
    return *kept == NULL ? ERROR : OK;
}
API status fmi3SetFMUState(instance c, void *kept) { model_assign(c, kept); return OK; }
API status fmi3FreeFMUState(instance c, void **kept) { (void)c; free(*kept); *kept = NULL; return OK; }
API status fmi3SerializedFMUStateSize(instance c, void *kept, size_t *n)
{
    (void)c; (void)kept; *n = model_size();
    return OK;
}
API status fmi3SerializeFMUState(instance c, void *kept, uint8_t bytes[], size_t n)
{
    (void)c;
    if (n < model_size()) { return ERROR; }
    memcpy(bytes, kept, model_size());
    return OK;
}
API status fmi3DeserializeFMUState(instance c, const uint8_t bytes[], size_t n, void **kept)
{
    if (n < model_size()) { return ERROR; }
    if (*kept == NULL) { *kept = model_copy(c); }
    if (*kept == NULL) { return ERROR; }
    memcpy(*kept, bytes, model_size());
    return OK;
}

API status fmi3EnterStepMode(instance c) { (void)c; return ERROR; }
API status fmi3DoStep(instance c, double now, double length, bool kept, bool *event, bool *terminate, bool *early, double *last)
{
    (void)now; (void)kept;
    *event = false;
    *terminate = false;
    *early = false;
    if (!(length >= 0.0)) { return ERROR; }
    const int good = model_advance(c, length);
    *last = model_time(c);
    return good ? OK : ERROR;
}
/* What only other kinds of FMU have. */
API status fmi3EnterConfigurationMode(instance c) { (void)c; return ERROR; }
API status fmi3ExitConfigurationMode(instance c) { (void)c; return ERROR; }
API status fmi3EnterContinuousTimeMode(instance c) { (void)c; return ERROR; }
API status fmi3EvaluateDiscreteStates(instance c) { (void)c; return ERROR; }
API status fmi3ActivateModelPartition(instance c, reference r, double t) { (void)c; (void)r; (void)t; return ERROR; }
API status fmi3CompletedIntegratorStep(instance c, bool a, bool *b, bool *d) { (void)c; (void)a; (void)b; (void)d; return ERROR; }
API status fmi3SetTime(instance c, double t) { (void)c; (void)t; return ERROR; }
API status fmi3UpdateDiscreteStates(instance c, bool *a, bool *b, bool *d, bool *e, bool *f, double *t)
{
    (void)c; (void)a; (void)b; (void)d; (void)e; (void)f; (void)t;
    return ERROR;
}
#define ROW(name, type) \
    API status name(instance c, type x[], size_t n) { (void)c; (void)x; (void)n; return ERROR; }
ROW(fmi3SetContinuousStates, const double)
ROW(fmi3GetContinuousStates, double)
ROW(fmi3GetContinuousStateDerivatives, double)
ROW(fmi3GetEventIndicators, double)
ROW(fmi3GetNominalsOfContinuousStates, double)
#define COUNT(name) API status name(instance c, size_t *n) { (void)c; *n = 0; return OK; }
COUNT(fmi3GetNumberOfContinuousStates)
COUNT(fmi3GetNumberOfEventIndicators)
API status fmi3GetNumberOfVariableDependencies(instance c, reference r, size_t *n) { (void)c; (void)r; (void)n; return ERROR; }
API status fmi3GetVariableDependencies(instance c, reference r, size_t a[], reference b[], size_t d[], int e[], size_t n)
{
    (void)c; (void)r; (void)a; (void)b; (void)d; (void)e; (void)n;
    return ERROR;
}
#define SLOPES(name) \
    API status name(instance c, const reference a[], size_t n, const reference b[], size_t m, const double d[], size_t e, double f[], size_t g) \
    { (void)c; (void)a; (void)n; (void)b; (void)m; (void)d; (void)e; (void)f; (void)g; return ERROR; }
SLOPES(fmi3GetDirectionalDerivative)
SLOPES(fmi3GetAdjointDerivative)
API status fmi3GetOutputDerivatives(instance c, const reference r[], size_t n, const int32_t order[], double value[], size_t m)
{
    (void)c; (void)r; (void)n; (void)order; (void)value; (void)m;
    return ERROR;
}
#define INTERVAL(name, type) \
    API status name(instance c, const reference r[], size_t n, type a[], type b[]) { (void)c; (void)r; (void)n; (void)a; (void)b; return ERROR; }
API status fmi3GetIntervalDecimal(instance c, const reference r[], size_t n, double a[], int b[])
{ (void)c; (void)r; (void)n; (void)a; (void)b; return ERROR; }
API status fmi3GetIntervalFraction(instance c, const reference r[], size_t n, uint64_t a[], uint64_t b[], int d[])
{ (void)c; (void)r; (void)n; (void)a; (void)b; (void)d; return ERROR; }
API status fmi3GetShiftDecimal(instance c, const reference r[], size_t n, double a[])
{ (void)c; (void)r; (void)n; (void)a; return ERROR; }
API status fmi3SetIntervalDecimal(instance c, const reference r[], size_t n, const double a[])
{ (void)c; (void)r; (void)n; (void)a; return ERROR; }
API status fmi3SetShiftDecimal(instance c, const reference r[], size_t n, const double a[])
{ (void)c; (void)r; (void)n; (void)a; return ERROR; }
INTERVAL(fmi3GetShiftFraction, uint64_t)
INTERVAL(fmi3SetIntervalFraction, const uint64_t)
INTERVAL(fmi3SetShiftFraction, const uint64_t)
