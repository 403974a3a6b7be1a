"""The head of a generated module: arithmetic that has to be the same to the last bit wherever the text runs."""

from __future__ import annotations

from ulna.program.lowering.intrinsic import INTRINSIC_HEADER

_IMPORTS = '''"""Written by ulna; safe to delete."""

import math

import numba
import numpy as np
from llvmlite import ir
from numba.extending import intrinsic


@intrinsic
def fused(typing, a, b, c):
    """a·b + c rounded once, written where it is meant, so that one run and many are rounded alike."""

    def code(context, builder, signature, arguments):
        return builder.fma(*arguments)

    return numba.float64(numba.float64, numba.float64, numba.float64), code


@intrinsic
def flipped(typing, value, turns):
    """The value with its sign changed where the last bit of the other number is set."""

    def code(context, builder, signature, arguments):
        whole = context.get_value_type(numba.int64)
        value, turns = (builder.bitcast(argument, whole) for argument in arguments)
        sign = builder.shl(turns, whole(63))
        return builder.bitcast(builder.xor(value, sign), arguments[0].type)

    return numba.float64(numba.float64, numba.float64), code


'''

_FUNCTIONS = '''@DECORATOR
def uniform(seed, counter):
    """Counter-based: splitmix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014), 53 bits in [0, 1)."""
    z = seed + np.uint64(0x9E3779B97F4A7C15) * (counter + np.uint64(1))
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * 1.1102230246251565e-16


@DECORATOR
def normal(seed, counter):
    """Box and Muller's transform of two neighbouring uniform numbers."""
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(seed, counter)))
    return radius * math.cos(6.283185307179586 * uniform(seed, counter + np.uint64(1)))


@DECORATOR
def scrambled(seed):
    """Neighbouring seeds to distant streams."""
    z = (seed ^ (seed >> np.uint64(33))) * np.uint64(0xFF51AFD7ED558CCD)
    z = (z ^ (z >> np.uint64(33))) * np.uint64(0xC4CEB9FE1A85EC53)
    return z ^ (z >> np.uint64(33))


'''

_GPU_IMPORTS = '''"""Written by ulna; safe to delete."""

import math

import numpy as np
from numba import cuda


@cuda.jit(device=True)
def fused(a, b, c):
    """a·b + c rounded once."""
    return cuda.fma(a, b, c)


@cuda.jit(device=True)
def flipped(value, turns):
    """The value with its sign changed where the other number, a whole one, is odd."""
    return -value if turns - 2.0 * math.floor(0.5 * turns) == 1.0 else value


'''

HEADER = _IMPORTS + INTRINSIC_HEADER + _FUNCTIONS.replace("DECORATOR", 'numba.njit(error_model="numpy", cache=CACHE)')
"""For processors."""

GPU_HEADER = _GPU_IMPORTS + _FUNCTIONS.replace("DECORATOR", "cuda.jit(device=True)")
"""For GPUs."""
