/* How time passes: a processor's sample at the beginning of each period with the inputs of that moment, then the motion
 * to the next one. What is shown between samples is computed on a copy, so that communication steps change no bit. */
struct model
{
    double s[SLOTS];
    double start;   /* of the whole run */
    double time;    /* now */
    double at;      /* of the last sample */
    double k;       /* periods since the start */
    int sampled;    /* whether the sample at `at` has been */
    int begun;
    double given[VARIABLES + 1]; /* what was set last, by place in the table */
};

static const double tiny = 1e-9; /* of a period */

static void latch(model *m)
{
    for (int k = 0; k < VARIABLES; k++)
    {
        if (variables[k].kind == INPUT) { m->s[variables[k].slot] = m->given[k]; }
    }
}

static void take_sample(model *m)
{
    latch(m);
    m->s[TIME] = m->at - m->start;
    sample(m->s);
    m->sampled = 1;
}

static void move(model *m, double length)
{
    m->s[TIME] = m->at - m->start;
    m->s[SPAN] = length;
    motion(m->s);
}

void model_reset(model *m)
{
    model fresh = {0};
    *m = fresh;
    for (int k = 0; k < VARIABLES; k++) { m->given[k] = variables[k].start; }
}

void model_begin(model *m, double time)
{
    m->start = time;
    m->time = time;
    m->at = time;
    for (int k = 0; k < VARIABLES; k++) { m->s[variables[k].slot] = m->given[k]; }
    for (int k = 0; k < ALIKE; k++) { m->s[alike[k][1]] = m->s[alike[k][0]]; }
    begin(m->s);
    m->begun = 1;
}

static int finite_slots(const model *m)
{
    for (int k = 0; k < VARIABLES; k++)
    {
        const double value = m->s[variables[k].slot];
        if (variables[k].flag == 0 && variables[k].kind != INPUT && !(value - value == 0.0)) { return 0; }
    }
    return 1;
}

int model_advance(model *m, double length)
{
    const double target = m->time + length;
    if (!SAMPLED)
    {
        const double wanted = ceil(length / PERIOD - tiny);
        const long count = wanted > 1.0 ? (long)wanted : 1;
        latch(m);
        for (long k = 0; k < count; k++) { move(m, length / (double)count); }
        m->at = target;
        m->time = target;
        return finite_slots(m);
    }
    while (target > m->at + tiny * PERIOD)
    {
        const double next = m->start + (m->k + 1.0) * PERIOD;
        if (!m->sampled) { take_sample(m); }
        if (target < next - tiny * PERIOD) { break; }
        move(m, PERIOD);
        m->k += 1.0;
        m->at = next;
        m->sampled = 0;
    }
    m->time = target;
    return finite_slots(m);
}

static double read_slot(const model *m, int k)
{
    const double value = m->s[variables[k].slot];
    return variables[k].flag != 0 ? (value == 0.0 ? 0.0 : 1.0) : value;
}

int model_get(const model *m, unsigned reference, double *value)
{
    if (reference == 0) { *value = m->time; return 1; }
    if (reference > VARIABLES) { return 0; }
    const int k = (int)reference - 1;
    if (variables[k].kind == INPUT || variables[k].kind == PARAMETER || !m->begun)
    {
        *value = m->given[k];
        if (m->begun || variables[k].kind != OUTPUT) { return 1; }
    }
    model now = *m;
    if (!now.begun) { model_begin(&now, 0.0); }
    if (SAMPLED && !now.sampled) { take_sample(&now); }
    if (!SAMPLED) { latch(&now); }
    if (SAMPLED && DENSE && now.time > now.at + tiny * PERIOD) { move(&now, now.time - now.at); }
    now.s[TIME] = now.time - now.start;
    if (DENSE) { shown(now.s); }
    *value = read_slot(&now, k);
    return 1;
}

int model_set(model *m, unsigned reference, double value)
{
    if (reference == 0 || reference > VARIABLES) { return 0; }
    const int k = (int)reference - 1;
    if (variables[k].kind == OUTPUT || (m->begun && variables[k].kind != INPUT)) { return 0; }
    m->given[k] = value;
    return 1;
}

size_t model_size(void) { return sizeof(model); }

void model_start(model *m, double time) { m->time = time; }

double model_time(const model *m) { return m->time; }

model *model_new(void)
{
    model *m = (model *)malloc(sizeof(model));
    if (m != NULL) { model_reset(m); }
    return m;
}

model *model_copy(const model *from)
{
    model *m = (model *)malloc(sizeof(model));
    if (m != NULL) { *m = *from; }
    return m;
}

void model_assign(model *to, const model *from) { *to = *from; }
