/* Recorded samples through {{ name }}_step: every bit must come out. Written by ulna {{ version }}; do not edit.
 * Exit status 0 where it does. On a processor without printf compile with -DULNA_QUIET and read the value of main.
 */
#include "{{ name }}.h"

{% if not fixed %}
#include <math.h>
#include <string.h>
{% endif %}
#ifndef ULNA_QUIET
#include <stdio.h>
#endif

#define SAMPLES {{ rows|length }}
#define GIVEN {{ [rows[0].given|length, 1]|max }}
#define EXPECTED {{ rows[0].expected|length }}

{% if not fixed %}
/* The bits of a number; those of any NaN are the same. */
static {{ whole }} bits({{ real }} value)
{
    {{ whole }} found;
    (void)memcpy((void *)&found, (const void *)&value, sizeof found);
    if (isnan(value) != 0)
    {
        found = ({{ whole }})-1;
    }
    return found;
}

{% endif %}
int main(void)
{
    static const {{ real }} given[SAMPLES][GIVEN] = {
{% for row in rows %}
        { {{ row.given|join(", ") or literal(0) }} }{{ "," if not loop.last }}
{% endfor %}
    };

    static const {{ real }} expected[SAMPLES][EXPECTED] = {
{% for row in rows %}
        { {{ row.expected|join(", ") }} }{{ "," if not loop.last }}
{% endfor %}
    };

    static const int32_t faults[SAMPLES] = { {{ rows|map(attribute="fault")|map("first")|join(", ") }} };

    {{ name }}_memory memory;
    {{ name }}_input input;
    {{ name }}_output output;
    int wrong = 0;

    {{ name }}_init(&memory);
    for (int k = 0; k < SAMPLES; k++)
    {
        int32_t differs = 0;
{% for port, limits in inputs %}
        input.{{ port.name }} = given[k][{{ loop.index0 }}];
{% endfor %}
{% if made.missed %}
        input.missed = (int32_t)given[k][{{ inputs|length }}];
{% endif %}
{% if not inputs and not made.missed %}
        input.nothing = given[k][0];
{% endif %}
        {{ name }}_step(&memory, &input, &output);
{% for port, value in outputs %}
{% if fixed %}
        if (output.{{ port }} != expected[k][{{ loop.index0 }}])
{% else %}
        if (bits(output.{{ port }}) != bits(expected[k][{{ loop.index0 }}]))
{% endif %}
        {
            differs = 1;
        }
{% endfor %}
        if (output.fault != faults[k])
        {
            differs = 1;
        }
        if (differs != 0)
        {
            wrong++;
#ifndef ULNA_QUIET
            (void)printf("sample %d differs\n", k);
#endif
        }
    }
#ifndef ULNA_QUIET
    (void)printf("%d of %d samples are bit-equal\n", SAMPLES - wrong, SAMPLES);
#endif
    return (wrong == 0) ? 0 : 1;
}
