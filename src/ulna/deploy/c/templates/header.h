/* Controller of '{{ plant|comment }}', one call a period. Written by ulna {{ version }}; do not edit.
 * Design {{ fingerprint }}: hash of plant, design and hardware.
 */
#ifndef {{ guard_name }}_H
#define {{ guard_name }}_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Hash of plant, design and hardware. */
extern const char {{ name }}_design[{{ fingerprint|length + 1 }}];
{% if fixed %}
/* Microseconds from one call of {{ name }}_step to the next. */
extern const uint32_t {{ name }}_period_us;
/* Binary points: an integer n stands for n / 2^point SI units. */
{% for port in points %}
extern const int32_t {{ name }}_{{ port }}_point;
{% endfor %}
{% else %}
/* Seconds from one call of {{ name }}_step to the next. */
extern const {{ real }} {{ name }}_period;
{% endif %}
{% for port in per_count %}
/* SI units of {{ port }} for each count of its sensor. */
extern const {{ real }} {{ name }}_{{ port }}_per_count;
{% endfor %}
{% for port in supply if not fixed %}
/* V of the bridge of {{ port }} at full duty. */
extern const {{ real }} {{ name }}_{{ port }}_supply;
{% endfor %}

/* What one sample hands to the next. Fill it with {{ name }}_init. */
typedef struct
{
{% for slot in made.memory.values() %}
    {{ real }} {{ slot }};
{% endfor %}
{% if not made.memory %}
    {{ real }} nothing;
{% endif %}
} {{ name }}_memory;

/* Measured values and references, {{ "as integers: see README.md" if fixed else "in SI units" }}. */
typedef struct
{
{% for port, limits in inputs %}
    {{ real }} {{ port.name }}; /* {{ port.signal.name|comment }} [{{ unit("input." ~ port.name, port.signal.unit)|comment }}]{{ " " ~ port.signal.text|comment if port.signal.text else "" }} */
{% endfor %}
{% if made.missed %}
    int32_t missed; /* 1: there is no new sample; the memory stays and the command is held */
{% endif %}
{% if not inputs and not made.missed %}
    {{ real }} nothing;
{% endif %}
} {{ name }}_input;

/* Commands, estimates and fault. */
typedef struct
{
{% for port, limits in commands %}
    {{ real }} {{ port.name }}; /* {{ port.signal.name|comment }} [{{ unit("output." ~ port.name, port.signal.unit)|comment }}]{{ " within " ~ limits if limits else "" }} */
{% endfor %}
{% for port in made.estimates %}
    {{ real }} {{ port.name }}; /* {{ port.signal.name|comment }} [{{ unit("output." ~ port.name, port.signal.unit)|comment }}] */
{% endfor %}
    int32_t fault; /* 0, or the sum of the bits of what is wrong at this sample, see README.md */
} {{ name }}_output;

void {{ name }}_init({{ name }}_memory *memory);
void {{ name }}_step({{ name }}_memory *memory, const {{ name }}_input *input, {{ name }}_output *output);

#ifdef __cplusplus
}
#endif

#endif
