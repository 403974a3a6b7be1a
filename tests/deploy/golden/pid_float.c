/* Controller of 'one-link arm with a DC motor'. Written by ulna; do not edit. Design 0000000000000000.
 * Compile with -std=c99 -ffp-contract=off.
 */
#include "control.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef FLT_EVAL_METHOD
#if FLT_EVAL_METHOD != 0
#error "Intermediate results would carry more digits than their type; on x86 compile with -msse2 -mfpmath=sse."
#endif
#endif
#ifdef __FAST_MATH__
#error "Compile without -ffast-math: every operation must round as it is written."
#endif
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF /* gcc does not know it and wants -ffp-contract=off */
#endif

const char control_design[17] = "0000000000000000";
const float control_period = 0.001f;

/* Call it once before the first sample. */
void control_init(control_memory *memory)
{
    memory->measured_theta = 0.0f;
    memory->state_total = 0.0f;
    memory->state_slow = 0.0f;
    memory->reference_theta_ref = 0.0f;
    memory->begun = 0.0f;
    memory->command_u_0 = 0.0f;
}

/* Call it once a period, after the sensors were read. */
void control_step(control_memory *memory, const control_input *input, control_output *output)
{
    const float input_theta = input->theta;
    const float memory_measured_theta = memory->measured_theta;
    const float input_theta_ref = input->theta_ref;
    const float memory_state_total = memory->state_total;
    const float memory_state_slow = memory->state_slow;
    const float memory_reference_theta_ref = memory->reference_theta_ref;
    const float memory_begun = memory->begun;
    const float memory_command_u_0 = memory->command_u_0;
    const float v7 = fabsf(input_theta);
    const float v9 = ((v7 < ((float)INFINITY)) ? 1.0f : 0.0f);
    const float v10 = ((v7 < ((float)INFINITY)) ? input_theta : memory_measured_theta);
    const float v15 = input_theta_ref - memory_reference_theta_ref;
    const float v16 = 0.5f * v15;
    const float v17 = memory_reference_theta_ref + v16;
    const float v18 = memory_reference_theta_ref - memory_measured_theta;
    const float v19 = 20.0f * v18;
    const float v20 = memory_measured_theta - memory_state_slow;
    const float v21 = 50.0f * v20;
    const float v22 = 0.0005f * v21;
    const float v23 = v22 + memory_state_slow;
    const float v24 = v10 - memory_measured_theta;
    const float v25 = 0.5f * v24;
    const float v26 = memory_measured_theta + v25;
    const float v27 = v17 - v26;
    const float v28 = 20.0f * v27;
    const float v29 = v26 - v23;
    const float v30 = 50.0f * v29;
    const float v31 = 0.0005f * v30;
    const float v32 = v31 + memory_state_slow;
    const float v33 = v26 - v32;
    const float v34 = 50.0f * v33;
    const float v35 = 0.001f * v34;
    const float v36 = v35 + memory_state_slow;
    const float v37 = input_theta_ref - v10;
    const float v38 = 20.0f * v37;
    const float v39 = v10 - v36;
    const float v40 = 50.0f * v39;
    const float v42 = v28 + v28;
    const float v43 = v19 + v38;
    const float v44 = 2.0f * v42;
    const float v45 = v44 + v43;
    const float v46 = 0.00016666668f * v45;
    const float v47 = v46 + memory_state_total;
    const float v48 = v30 + v34;
    const float v49 = v21 + v40;
    const float v50 = 2.0f * v48;
    const float v51 = v50 + v49;
    const float v52 = 0.00016666668f * v51;
    const float v53 = v52 + memory_state_slow;
    const float v54 = v47 + v53;
    const float v55 = fabsf(v54);
    const float v56 = ((v55 < ((float)INFINITY)) ? 1.0f : 0.0f);
    const float v57 = (((v9 != 0.0f) && (v56 != 0.0f)) ? 1.0f : 0.0f);
    const float v58 = (((memory_begun != 0.0f) && (v57 != 0.0f)) ? 1.0f : 0.0f);
    const float v59 = ((v58 != 0.0f) ? v47 : memory_state_total);
    const float v60 = ((v58 != 0.0f) ? v53 : memory_state_slow);
    const float v61 = v10 - v60;
    const float v62 = 40.0f * v37;
    const float v63 = v59 + v62;
    const float v64 = 250.0f * v61;
    const float v65 = v63 - v64;
    const float v66 = ((memory_begun != 0.0f) ? v57 : v9);
    const float v67 = fabsf(v65);
    const float v68 = ((v67 < ((float)INFINITY)) ? 1.0f : 0.0f);
    const float v69 = (((v66 != 0.0f) && (v68 != 0.0f)) ? 1.0f : 0.0f);
    const float v70 = ((v69 == 0.0f) ? 1.0f : 0.0f);
    const float v71 = ((v69 != 0.0f) ? v65 : memory_command_u_0);
    const float v73 = ((v71 <= 24.0f) ? v71 : 24.0f);
    const float v75 = (((-24.0f) <= v73) ? v73 : (-24.0f));

    memory->measured_theta = v10;
    memory->state_total = v59;
    memory->state_slow = v60;
    memory->reference_theta_ref = input_theta_ref;
    memory->begun = 1.0f;
    memory->command_u_0 = v75;
    output->u = v75;
    output->fault = (int32_t)v70;
}
