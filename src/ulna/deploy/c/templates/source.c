/* Controller of '{{ plant|comment }}'. Written by ulna {{ version }}; do not edit. Design {{ fingerprint }}.
 * Compile with {{ flags }}.
 */
#include "{{ name }}.h"

{{ c_head }}
const char {{ name }}_design[{{ fingerprint|length + 1 }}] = "{{ fingerprint }}";
{% if fixed %}
const uint32_t {{ name }}_period_us = {{ (hardware.period * 1e6)|round|int }}U;
{% for port, point in points.items() %}
const int32_t {{ name }}_{{ port }}_point = {{ point }};
{% endfor %}
{% else %}
const {{ real }} {{ name }}_period = {{ literal(hardware.period) }};
{% endif %}
{% for port, step in per_count.items() %}
const {{ real }} {{ name }}_{{ port }}_per_count = {{ literal(step) }};
{% endfor %}
{% for port, volts in supply.items() if not fixed %}
const {{ real }} {{ name }}_{{ port }}_supply = {{ literal(volts) }};
{% endfor %}

/* Call it once before the first sample. */
void {{ name }}_init({{ name }}_memory *memory)
{
{% for slot, value in initial %}
    memory->{{ slot }} = {{ value }};
{% endfor %}
{% if not initial %}
    memory->nothing = {{ literal(0) }};
{% endif %}
}

/* Call it once a period, after the sensors were read. */
void {{ name }}_step({{ name }}_memory *memory, const {{ name }}_input *input, {{ name }}_output *output)
{
{% for local, place in locals %}
    const {{ real }} {{ local }} = {{ place }};
{% endfor %}
{% for line in lines %}
    const {{ real }} {{ line }};
{% endfor %}

{% for slot, value in new_memory %}
    memory->{{ slot }} = {{ value }};
{% endfor %}
{% for port, value in outputs %}
    output->{{ port }} = {{ value }};
{% endfor %}
    output->fault = (int32_t){{ fault }};
{% if not inputs %}
    (void)input;
{% endif %}
}
