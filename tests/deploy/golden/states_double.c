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
const double control_period = 0.001;
const double control_theta_per_count = 0.0015339807878856412;

/* Call it once before the first sample. */
void control_init(control_memory *memory)
{
    memory->measured_theta = 0.0;
    memory->measured_omega = 0.0;
    memory->measured_i = 0.0;
    memory->command_u_0 = 0.0;
}

/* Call it once a period, after the sensors were read. */
void control_step(control_memory *memory, const control_input *input, control_output *output)
{
    const double input_theta = input->theta;
    const double input_omega = input->omega;
    const double input_i = input->i;
    const double memory_measured_theta = memory->measured_theta;
    const double memory_measured_omega = memory->measured_omega;
    const double memory_measured_i = memory->measured_i;
    const double memory_command_u_0 = memory->command_u_0;
    const double v3 = input_theta + input_omega;
    const double v4 = v3 + input_i;
    const double v5 = fabs(v4);
    const double v6 = ((v5 < ((double)INFINITY)) ? 1.0 : 0.0);
    const double v7 = input_theta * 651.8986469044033;
    const double v9 = v7 + 0.5;
    const double v11 = v9 + 6755399441055744.0;
    const double v12 = v11 - 6755399441055744.0;
    const double v15 = v12 - 1.0;
    const double v16 = ((v9 < v12) ? v15 : v12);
    const double v17 = fabs(v9);
    const double v20 = ((v17 < 2251799813685248.0) ? v16 : v9);
    const double v21 = 0.0015339807878856412 * v20;
    const double v22 = ((v5 < ((double)INFINITY)) ? v21 : memory_measured_theta);
    const double v23 = ((v5 < ((double)INFINITY)) ? input_omega : memory_measured_omega);
    const double v24 = ((v5 < ((double)INFINITY)) ? input_i : memory_measured_i);
    const double v28 = v22 * 0.3183098861837907;
    const double v29 = v28 + 6755399441055744.0;
    const double v30 = v29 - 6755399441055744.0;
    const double v32 = v30 * (-3.1415926534682512);
    const double v33 = v32 + v22;
    const double v35 = v30 * (-1.2154201012607932e-10);
    const double v36 = v35 + v33;
    const double v38 = v30 * (-4.044532497591901e-21);
    const double v39 = v38 + v36;
    const double v40 = v39 * v39;
    const double v41 = v40 * v40;
    const double v43 = v41 * 2.7216780035058983e-15;
    const double v45 = v43 + 1.605894190347732e-10;
    const double v46 = v41 * v45;
    const double v48 = v46 + 2.7557319211744394e-06;
    const double v49 = v41 * v48;
    const double v51 = v49 + 0.008333333333333208;
    const double v53 = v41 * (-7.64304346538988e-13);
    const double v55 = v53 + (-2.5052106921615934e-08);
    const double v56 = v41 * v55;
    const double v58 = v56 + (-0.00019841269841213368);
    const double v59 = v40 * v58;
    const double v60 = v59 + v51;
    const double v61 = v40 * v60;
    const double v63 = v61 + (-0.16666666666666666);
    const double v64 = v39 * v40;
    const double v65 = v64 * v63;
    const double v66 = v65 + v39;
    const double v67 = 0.5 * v30;
    const double v68 = v67 + 6755399441055744.0;
    const double v69 = v68 - 6755399441055744.0;
    const double v71 = -v66;
    const double v72 = ((v67 == v69) ? v66 : v71);
    const double v73 = fabs(v22);
    const double v75 = ((v73 < 2251799813685248.0) ? v72 : ((double)NAN));
    const double v76 = v23 * v75;
    const double v77 = 1.764 * v76;
    const double v79 = 1.4465516 * v23;
    const double v80 = v77 - v79;
    const double v82 = 6.5164128 * v22;
    const double v83 = v80 - v82;
    const double v86 = v28 + (-0.5);
    const double v87 = v86 + 6755399441055744.0;
    const double v88 = v87 - 6755399441055744.0;
    const double v89 = v88 + 0.5;
    const double v90 = -v22;
    const double v92 = v89 * 3.1415926534682512;
    const double v93 = v92 + v90;
    const double v95 = v89 * 1.2154201012607932e-10;
    const double v96 = v95 + v93;
    const double v98 = v89 * 4.044532497591901e-21;
    const double v99 = v98 + v96;
    const double v100 = v99 * v99;
    const double v101 = v100 * v100;
    const double v102 = v101 * 2.7216780035058983e-15;
    const double v103 = v102 + 1.605894190347732e-10;
    const double v104 = v101 * v103;
    const double v105 = v104 + 2.7557319211744394e-06;
    const double v106 = v101 * v105;
    const double v107 = v106 + 0.008333333333333208;
    const double v108 = v101 * (-7.64304346538988e-13);
    const double v109 = v108 + (-2.5052106921615934e-08);
    const double v110 = v101 * v109;
    const double v111 = v110 + (-0.00019841269841213368);
    const double v112 = v100 * v111;
    const double v113 = v112 + v107;
    const double v114 = v100 * v113;
    const double v115 = v114 + (-0.16666666666666666);
    const double v116 = v99 * v100;
    const double v117 = v116 * v115;
    const double v118 = v117 + v99;
    const double v119 = 0.5 * v88;
    const double v120 = v119 + 6755399441055744.0;
    const double v121 = v120 - 6755399441055744.0;
    const double v123 = -v118;
    const double v124 = ((v119 == v121) ? v118 : v123);
    const double v125 = ((v73 < 2251799813685248.0) ? v124 : ((double)NAN));
    const double v126 = 21.168 * v125;
    const double v127 = v83 - v126;
    const double v129 = 0.2 * v24;
    const double v130 = v127 - v129;
    const double v131 = fabs(v130);
    const double v132 = ((v131 < ((double)INFINITY)) ? 1.0 : 0.0);
    const double v133 = (((v6 != 0.0) && (v132 != 0.0)) ? 1.0 : 0.0);
    const double v134 = ((v133 == 0.0) ? 1.0 : 0.0);
    const double v135 = ((v133 != 0.0) ? v130 : memory_command_u_0);

    memory->measured_theta = v22;
    memory->measured_omega = v23;
    memory->measured_i = v24;
    memory->command_u_0 = v135;
    output->u = v135;
    output->fault = (int32_t)v134;
}
