/* Controller of 'one-link arm with a DC motor'. Written by ulna; do not edit. Design 0000000000000000.
 * Compile with -std=c99 -ffp-contract=off.
 */
#include "control.h"

#include <stdint.h>

/* Divided by 2^by, rounded down; no sign bit is shifted. */
static inline int64_t whole(int64_t value, uint32_t by)
{
    const uint64_t flip = (value < 0) ? UINT64_MAX : UINT64_C(0);
    const uint64_t shifted = ((uint64_t)value ^ flip) >> by;
    int64_t part = (int64_t)shifted;
    if (value < 0)
    {
        part = -1 - part;
    }
    return part;
}

/* Divided by 2^by, half a unit rounded up. */
static inline int64_t down(int64_t value, uint32_t by)
{
    return whole(value + (INT64_C(1) << (by - 1U)), by);
}

/* The value within two ends. */
static inline int32_t limited(int32_t value, int32_t low, int32_t high)
{
    return (value < low) ? low : ((value > high) ? high : value);
}

const char control_design[17] = "0000000000000000";
const uint32_t control_period_us = 1000U;
const int32_t control_u_point = 26;
const int32_t control_theta_point = 29;
const int32_t control_theta_ref_point = 30;

/* Call it once before the first sample. */
void control_init(control_memory *memory)
{
    memory->measured_theta = INT32_C(0);
    memory->state_total = INT32_C(0);
    memory->state_slow = INT32_C(0);
    memory->reference_theta_ref = INT32_C(0);
    memory->begun = INT32_C(0);
}

/* Call it once a period, after the sensors were read. */
void control_step(control_memory *memory, const control_input *input, control_output *output)
{
    const int32_t input_theta = limited(input->theta, (-INT32_C(1073741824)), INT32_C(1073741824));
    const int32_t memory_measured_theta = memory->measured_theta;
    const int32_t input_theta_ref = limited(input->theta_ref, (-INT32_C(1073741824)), INT32_C(1073741824));
    const int32_t memory_state_total = memory->state_total;
    const int32_t memory_state_slow = memory->state_slow;
    const int32_t memory_reference_theta_ref = memory->reference_theta_ref;
    const int32_t memory_begun = memory->begun;
    const int32_t v0 = (int32_t)(down((int64_t)input_theta_ref - (int64_t)memory_reference_theta_ref, 1U));
    const int32_t v2 = (int32_t)(down((int64_t)INT32_C(1073741824) * (int64_t)v0, 30U));
    const int32_t v3 = (int32_t)(down((int64_t)memory_reference_theta_ref + (int64_t)v2, 1U));
    const int32_t v4 = (int32_t)(down((int64_t)memory_reference_theta_ref - ((int64_t)memory_measured_theta * INT64_C(2)), 1U));
    const int32_t v6 = (int32_t)(down((int64_t)INT32_C(1342177280) * (int64_t)v4, 30U));
    const int32_t v7 = (int32_t)(down((int64_t)memory_measured_theta - (int64_t)memory_state_slow, 1U));
    const int32_t v9 = (int32_t)(down((int64_t)INT32_C(1677721600) * (int64_t)v7, 30U));
    const int32_t v11 = (int32_t)(down((int64_t)INT32_C(1099511628) * (int64_t)v9, 30U));
    const int32_t v12 = (int32_t)(down((int64_t)v11 + ((int64_t)memory_state_slow * INT64_C(32)), 5U));
    const int32_t v13 = (int32_t)(down((int64_t)input_theta - (int64_t)memory_measured_theta, 1U));
    const int32_t v14 = (int32_t)(down((int64_t)INT32_C(1073741824) * (int64_t)v13, 30U));
    const int32_t v15 = (int32_t)(down((int64_t)memory_measured_theta + (int64_t)v14, 1U));
    const int32_t v16 = (int32_t)(down((int64_t)v3 - ((int64_t)v15 * INT64_C(2)), 1U));
    const int32_t v17 = (int32_t)(down((int64_t)INT32_C(1342177280) * (int64_t)v16, 30U));
    const int32_t v18 = (int32_t)(down(((int64_t)v15 * INT64_C(2)) - (int64_t)v12, 1U));
    const int32_t v19 = (int32_t)(down((int64_t)INT32_C(1677721600) * (int64_t)v18, 31U));
    const int32_t v20 = (int32_t)(down((int64_t)INT32_C(1099511628) * (int64_t)v19, 30U));
    const int32_t v21 = (int32_t)(down((int64_t)v20 + ((int64_t)memory_state_slow * INT64_C(16)), 4U));
    const int32_t v22 = (int32_t)(down(((int64_t)v15 * INT64_C(2)) - (int64_t)v21, 1U));
    const int32_t v23 = (int32_t)(down((int64_t)INT32_C(1677721600) * (int64_t)v22, 31U));
    const int32_t v24 = (int32_t)(down((int64_t)INT32_C(1099511628) * (int64_t)v23, 30U));
    const int32_t v25 = (int32_t)(down((int64_t)v24 + ((int64_t)memory_state_slow * INT64_C(8)), 3U));
    const int32_t v26 = (int32_t)(down((int64_t)input_theta_ref - ((int64_t)input_theta * INT64_C(2)), 1U));
    const int32_t v27 = (int32_t)(down((int64_t)INT32_C(1342177280) * (int64_t)v26, 30U));
    const int32_t v28 = (int32_t)(down((int64_t)input_theta - (int64_t)v25, 1U));
    const int32_t v29 = (int32_t)(down((int64_t)INT32_C(1677721600) * (int64_t)v28, 30U));
    const int32_t v30 = (int32_t)(down((int64_t)v17 + (int64_t)v17, 1U));
    const int32_t v31 = (int32_t)(down((int64_t)v6 + (int64_t)v27, 1U));
    const int32_t v32 = (int32_t)(down((int64_t)INT32_C(1073741824) * (int64_t)v30, 30U));
    const int32_t v33 = (int32_t)(down(((int64_t)v32 * INT64_C(4)) + (int64_t)v31, 3U));
    const int32_t v35 = (int32_t)(down((int64_t)INT32_C(1466015504) * (int64_t)v33, 30U));
    const int32_t v36 = (int32_t)(down((int64_t)v35 + ((int64_t)memory_state_total * INT64_C(256)), 8U));
    const int32_t v37 = (int32_t)(down((int64_t)v19 + (int64_t)v23, 1U));
    const int32_t v38 = (int32_t)(down((int64_t)v9 + (int64_t)v29, 1U));
    const int32_t v39 = (int32_t)(down((int64_t)INT32_C(1073741824) * (int64_t)v37, 30U));
    const int32_t v40 = (int32_t)(down(((int64_t)v39 * INT64_C(4)) + (int64_t)v38, 2U));
    const int32_t v41 = (int32_t)(down((int64_t)INT32_C(1466015504) * (int64_t)v40, 31U));
    const int32_t v42 = (int32_t)(down((int64_t)v41 + ((int64_t)memory_state_slow * INT64_C(8)), 3U));
    const int32_t v43 = (memory_begun != 0) ? v36 : memory_state_total;
    const int32_t v44 = (memory_begun != 0) ? v42 : memory_state_slow;
    const int32_t v45 = (int32_t)(down((int64_t)input_theta - (int64_t)v44, 1U));
    const int32_t v46 = (int32_t)(down((int64_t)v43 + ((int64_t)v27 * INT64_C(4)), 3U));
    const int32_t v48 = (int32_t)(down((int64_t)INT32_C(2097152000) * (int64_t)v45, 31U));
    const int32_t v49 = (int32_t)(down((int64_t)v46 - ((int64_t)v48 * INT64_C(8)), 3U));
    const int32_t v51 = (((int64_t)v49 * INT64_C(64)) <= (int64_t)INT32_C(1610612736)) ? (int32_t)1 : (int32_t)0;
    const int32_t v52 = (v51 != 0) ? v49 : (int32_t)(down((int64_t)INT32_C(1610612736), 6U));
    const int32_t v54 = ((int64_t)(-INT32_C(1610612736)) <= ((int64_t)v52 * INT64_C(64))) ? (int32_t)1 : (int32_t)0;
    const int32_t v55 = (v54 != 0) ? (int32_t)(((int64_t)v52) * INT64_C(64)) : (-INT32_C(1610612736));
    const int32_t v57 = ((v43 < INT32_C(2013265920)) ? v43 : INT32_C(2013265920));
    const int32_t v59 = ((v57 > (-INT32_C(2013265920))) ? v57 : (-INT32_C(2013265920)));
    const int32_t v60 = ((v44 < INT32_C(1073741824)) ? v44 : INT32_C(1073741824));
    const int32_t v62 = ((v60 > (-INT32_C(1073741824))) ? v60 : (-INT32_C(1073741824)));
    const int32_t v63 = (int32_t)(down((int64_t)INT32_C(1073741824), 30U));
    const int32_t v65 = (int32_t)(down((int64_t)INT32_C(0), 30U));

    memory->measured_theta = input_theta;
    memory->state_total = v59;
    memory->state_slow = v62;
    memory->reference_theta_ref = input_theta_ref;
    memory->begun = v63;
    output->u = v55;
    output->fault = (int32_t)v65;
}
