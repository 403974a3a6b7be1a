"""What stands above the functions of a C file: no excess precision, no contraction, the operation C lacks."""

from __future__ import annotations

from ulna.program.precision import Precision

C_FLAGS = ("-std=c99", "-ffp-contract=off")
"""For gcc and clang. Without the second gcc fuses products with sums where the processor can, and rounds otherwise."""

_HEADER = """\
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#if FLT_EVAL_METHOD != 0
#error "Intermediate results would carry more digits than their type; on x86 compile with -msse2 -mfpmath=sse."
#endif
#ifdef __FAST_MATH__
#error "Compile without -ffast-math: every operation must round as it is written."
#endif
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF /* gcc does not know it and wants -ffp-contract=off */
#endif

/* The value, its sign changed where the last bit of the other number is set. */
static inline REAL flipped(REAL value, REAL turns)
{
    WHOLE bits;
    memcpy(&bits, &turns, sizeof bits);
    return (bits & 1u) ? -value : value;
}
"""


def c_header(precision: Precision = Precision.DOUBLE) -> str:
    """The lines that functions of `to_c` need above them, once a file."""
    whole = "uint32_t" if precision is Precision.SINGLE else "uint64_t"
    return _HEADER.replace("REAL", precision.value).replace("WHOLE", whole)
