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
"""

_ODD = """
/* 1 where the last bit of the number is set, else 0. */
static inline int32_t odd(REAL turns)
{
    WHOLE bits;
    (void)memcpy((void *)&bits, (const void *)&turns, sizeof bits);
    return ((bits & ONE) != ZERO) ? 1 : 0;
}
"""


def c_header(precision: Precision = Precision.DOUBLE, *, flips: bool = True) -> str:
    """The lines that functions of `to_c` need above them, once a file.

    Args:
        precision: of the numbers. flips: whether the operation FLIP occurs.
    """
    single = precision is Precision.SINGLE
    words = {"REAL": precision.value, "WHOLE": "uint32_t" if single else "uint64_t"}
    words |= {"ONE": "UINT32_C(1)", "ZERO": "UINT32_C(0)"} if single else {"ONE": "UINT64_C(1)", "ZERO": "UINT64_C(0)"}
    text = _HEADER + (_ODD if flips else "")
    for word, meaning in words.items():
        text = text.replace(word, meaning)
    return text
