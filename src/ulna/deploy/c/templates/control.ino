/* The controller of '{{ plant|comment }}' every {{ hardware.period }} s. Written by ulna {{ version }} as a start: fill in how this
 * board reads its sensors and drives its bridge. What is read and written is in SI units, see README.md.
 */
#include <{{ name }}.h>

static {{ name }}_memory memory;
static {{ name }}_input input;
static {{ name }}_output output;
static const uint32_t period_us = {{ (hardware.period * 1e6)|round|int }};
{% for port in per_count %}

/* Counts of the sensor of {{ port }}. */
static int32_t counts_of_{{ port }}()
{
    return 0; /* read the counter of the encoder or the converter here */
}
{% endfor %}
{% for port, limits in commands %}

/* {{ port.signal.name|comment }} in {{ port.signal.unit|comment or "SI units" }}. */
static void drive_{{ port.name }}({{ real }} value)
{
{% if port.name in supply %}
{% if fixed %}
    (void)value; /* an integer, V / 2^{{ points[port.name] }}: write its sign to the direction pin, and to the compare register
                  * (int64_t)|value| * top / ((int64_t){{ "%g"|format(supply[port.name]) }} << {{ points[port.name] }}) */
{% else %}
    {{ real }} duty = value / {{ name }}_{{ port.name }}_supply;
    duty = (duty > 1) ? 1 : ((duty < -1) ? -1 : duty);
    (void)duty; /* write the sign to the direction pin and |duty| to the compare register here */
{% endif %}
{% else %}
    (void)value; /* write it to the converter or the bridge here */
{% endif %}
}
{% endfor %}

static void sample()
{
{% if delay_periods >= 1 %}
    /* The loop was designed for a delay of {{ hardware.delay }} s: the command of the sample before takes effect now. */
{% for port, limits in commands %}
    drive_{{ port.name }}(output.{{ port.name }});
{% endfor %}
{% endif %}
{% for port, limits in inputs %}
{% if port.name in per_count %}
    input.{{ port.name }} = ({{ real }})counts_of_{{ port.name }}() * {{ name }}_{{ port.name }}_per_count;
{% else %}
    input.{{ port.name }} = 0; /* {{ port.signal.name|comment }} in {{ unit("input." ~ port.name, port.signal.unit)|comment }} */
{% endif %}
{% endfor %}
{% if made.missed %}
    input.missed = 0;
{% endif %}
    {{ name }}_step(&memory, &input, &output);
{% if delay_periods < 1 %}
{% for port, limits in commands %}
    drive_{{ port.name }}(output.{{ port.name }});
{% endfor %}
{% endif %}
}

#if defined(TEENSYDUINO)
static IntervalTimer timer;
#else
static uint32_t next_us;
#endif

void setup()
{
    {{ name }}_init(&memory);
#if defined(TEENSYDUINO)
    timer.begin(sample, period_us); /* an interrupt of its own */
#else
    next_us = micros(); /* the clock of any board; use a timer interrupt of yours where other work takes long */
#endif
}

void loop()
{
#if !defined(TEENSYDUINO)
    if ((int32_t)(micros() - next_us) >= 0)
    {
        next_us += period_us;
        sample();
    }
#endif
}
