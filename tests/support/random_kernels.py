"""Random kernels over all operations, and points with everything that IEEE arithmetic knows among them."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from ulna.program import InstructionList, Kernel, Operation, pruned

UNARY = (
    *(Operation.NEG, Operation.SQRT, Operation.ABS, Operation.SIGN, Operation.FLOOR, Operation.NOT),
    *(Operation.SIN, Operation.COS, Operation.TANH, Operation.EXP, Operation.LOG, Operation.TAN, Operation.ASIN),
    *(
        Operation.ACOS,
        Operation.ATAN,
        Operation.SINH,
        Operation.COSH,
        Operation.ASINH,
        Operation.ACOSH,
        Operation.ATANH,
    ),
)
BINARY = (
    *(Operation.ADD, Operation.SUB, Operation.MUL, Operation.DIV) * 3,
    *(Operation.MIN, Operation.MAX, Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL),
    *(Operation.AND, Operation.OR, Operation.POW, Operation.ATAN2),
)
CONSTANTS = (0.0, -0.0, 1.0, -1.0, 2.0, 0.5, -3.25, 1.0 / 3.0, 1e300, 5e-324, math.inf, -math.inf, math.nan, 0.1)
SPECIAL = np.array([*CONSTANTS, -1e-310, 2.0**52, 2.0**51 + 0.5, 1.5, -2.5, 1e22, -1.7e308, math.pi, -math.pi / 2])


def random_kernel(seed: int, *, exclude: Collection[Operation] = ()) -> Kernel:
    """A kernel of one to three inputs in which products have several users often.

    The seed stands for hypothesis' choices: a hundred kernels are compiled at once, which one example a call is not.
    """
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 4))
    out = InstructionList(count)
    values = list(range(count))
    unary, binary = ([o for o in pool if o not in exclude] for pool in (UNARY, BINARY))
    for _ in range(int(random.integers(1, 25))):
        # The newest values are taken most often, so that chains grow deep.
        operands = [values[-1 - int(min(random.integers(0, 7), len(values) - 1))] for _ in range(3)]
        kind = random.integers(0, 10)
        if kind == 0:
            constant = CONSTANTS[random.integers(len(CONSTANTS))] if random.random() < 0.5 else random.uniform(-10, 10)
            index = out.constant(float(constant))
        elif kind <= 2:
            index = out.emit(unary[random.integers(len(unary))], operands[0])
        elif kind == 3:
            index = out.emit(Operation.SELECT, *operands)
        else:
            index = out.emit(binary[random.integers(len(binary))], *operands[:2])
        values.append(index)
    wanted = [values[-1], *(values[k] for k in random.integers(0, len(values), 3))]
    instructions, results = pruned(count, out.instructions, wanted)
    return Kernel(
        name="random",
        inputs=tuple(f"x{k}" for k in range(count)),
        outputs=tuple(f"y{k}" for k in range(len(wanted))),
        instructions=instructions,
        results=results,
    )


def points(inputs: int, count: int, seed: int) -> np.ndarray:
    """(inputs, count): ordinary numbers, numbers of every magnitude, and special ones."""
    random = np.random.default_rng(seed)
    shape = (inputs, count)
    signs = random.choice([-1.0, 1.0], shape)
    wide = signs * 10.0 ** random.uniform(-320, 308, shape)
    x = np.where(random.random(shape) < 0.7, random.uniform(-8, 8, shape), wide)
    return np.ascontiguousarray(np.where(random.random(shape) < 0.15, random.choice(SPECIAL, shape), x))
