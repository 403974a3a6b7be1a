#ifndef ULNA_MODEL_H
#define ULNA_MODEL_H

#include <stddef.h>

/* A model in time. Value references are 0 for the time, then the places in the table of variables from 1 on. */
typedef struct model model;

extern const char *const model_token;

model *model_new(void);
model *model_copy(const model *from);
void model_assign(model *to, const model *from);
void model_reset(model *m);
size_t model_size(void);
/* The time of the start. */
void model_start(model *m, double time);
/* Inputs and starts are set; parameters count from here on. */
void model_begin(model *m, double time);
/* 0 where numbers stopped being finite. */
int model_advance(model *m, double length);
/* 0 for a reference that is none, or a variable that cannot be set now. */
int model_get(const model *m, unsigned reference, double *value);
int model_set(model *m, unsigned reference, double value);
double model_time(const model *m);

#endif
