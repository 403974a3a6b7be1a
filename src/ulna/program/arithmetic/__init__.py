"""Arithmetic by name: kernels rewritten so that they round alike in every language.

Functions are written out in the steps of the arithmetic. Their largest errors, in units in the last place of the exact
result, in double and in single precision:

| function | error | where |
|---|---|---|
| floor | 0 | everywhere; from 2^51 (single: 2^22) on numbers are whole for this purpose |
| sin, cos | 2.5 | angles up to 3e6 rad (single: 6e3); results below 1e-13 (1e-5) are off by as much as there |
| tan | 4 | as sin and cos; near the poles as its cosine |
| exp | 1 | everywhere |
| log | 1 | everywhere |
| pow | 1 | everywhere |
| sinh | 2 | everywhere |
| cosh | 2 | everywhere |
| tanh | 8 | everywhere |
| asin, acos | 4 | everywhere |
| atan | 2.5 | everywhere |
| atan2 | 3 | everywhere, results below the smallest normal number left out |
| asinh | 3 | everywhere |
| acosh | 3 | everywhere |
| atanh | 3 | everywhere |

Beyond the domain of sine the answer is that of an angle off by a unit in its last place; from 2^51 rad (single: 2^22)
on it is NaN in plain arithmetic and means nothing in fused. Sine and tanh never leave [-1, 1] in plain arithmetic, in
fused by a unit at most. At the edges answers are those of IEEE 754 and C99: e^−∞ = 0, log 0 = −∞, log −1 = NaN,
0^0 = 1; only the sign of sin −0 and its like may be lost.
"""

from ulna.program.arithmetic.arithmetic import AbstractArithmetic, Fused, Plain, Unwritten
from ulna.program.arithmetic.rewriting import in_arithmetic

__all__ = ["AbstractArithmetic", "Fused", "Plain", "Unwritten", "in_arithmetic"]
