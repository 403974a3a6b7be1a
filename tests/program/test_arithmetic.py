"""A kernel in a named arithmetic: the steps it consists of, and that they round as the loops of the simulator do."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from compilers import by_intrinsics, by_numba, same_bits
from random_kernels import SPECIAL, points, random_kernel

from ulna.base import UlnaError
from ulna.program import (
    Fused,
    InstructionList,
    Kernel,
    Operation,
    Plain,
    Scalar,
    in_arithmetic,
    lie_derivatives,
    tangents,
    to_numpy,
    to_python,
)
from ulna.program.lowering.fused import flipped, flipped_scalar, fused, fused_scalar
from ulna.program.lowering.intrinsic import has_intrinsic

LONG = (
    *(Operation.EXP, Operation.LOG, Operation.POW, Operation.TAN, Operation.ASIN, Operation.ACOS, Operation.ATAN),
    *(Operation.ATAN2, Operation.SINH, Operation.COSH, Operation.ASINH, Operation.ACOSH, Operation.ATANH),
)
STEPS = {
    *(Operation.CONSTANT, Operation.ADD, Operation.SUB, Operation.MUL, Operation.DIV, Operation.SQRT, Operation.NEG),
    *(Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL, Operation.AND, Operation.OR, Operation.NOT),
    *(Operation.SELECT, Operation.MIN, Operation.MAX, Operation.ABS, Operation.SIGN),
}


@pytest.mark.parametrize("arithmetic", [Fused(), Plain()])
def test_an_intrinsic_has_the_bits_of_the_text(arithmetic: Fused | Plain) -> None:
    kernels = [in_arithmetic(random_kernel(k, exclude=LONG), arithmetic) for k in range(8)]
    assert {i.operation for k in kernels for i in k.instructions} >= STEPS
    x = points(3, 5000, 0)
    assert same_bits(by_intrinsics(kernels, x), by_numba(kernels, x))


def test_a_function_of_the_library_is_no_intrinsic() -> None:
    assert has_intrinsic(_kernel(1, lambda x: x[0].apply(Operation.ABS)))
    assert not has_intrinsic(_kernel(1, lambda x: x[0].apply(Operation.EXP)))


def test_python_numpy_and_numba_agree_on_fused_kernels() -> None:
    kernels = [in_arithmetic(random_kernel(1000 + k, exclude=LONG[2:]), Fused()) for k in range(6)]
    x = points(3, 60, 0)
    arrays = np.concatenate([to_numpy(k)(*x[: len(k.inputs)]) for k in kernels])
    scalars = [np.array([to_python(k)(*map(float, c[: len(k.inputs)])) for c in x.T]).T for k in kernels]
    assert same_bits(arrays, np.concatenate(scalars))
    assert same_bits(arrays, by_numba(kernels, x))


@pytest.mark.parametrize("arithmetic", [Fused(), Plain()])
def test_only_elementary_steps_are_left(arithmetic: Fused | Plain) -> None:
    allowed = STEPS | ({Operation.FMA, Operation.FLIP} if arithmetic == Fused() else set())
    for seed in range(50):
        written = in_arithmetic(random_kernel(seed), arithmetic)
        assert {i.operation for i in written.instructions} <= allowed


def _numbers(count: int, seed: int) -> np.ndarray:
    """(3, count) with products that nearly cancel the sum, half-way cases and numbers of all sizes."""
    a, b, c = points(3, count, seed)
    with np.errstate(all="ignore"):
        near = -a * b
        c = np.where(np.arange(count) % 3 == 0, near, c)
        c = np.where(np.arange(count) % 3 == 1, near * (1 + 2.0**-52) + 2.0**-70 * np.abs(b), c)
    return np.array([a, b, c])


def test_the_fused_multiply_add_rounds_once() -> None:
    a, b, c = _numbers(20_000, 1)
    arrays = fused(a, b, c)
    assert same_bits(arrays, [fused_scalar(*map(float, each)) for each in zip(a, b, c, strict=True)])
    kernel = _kernel(3, lambda x: x[0].apply(Operation.FMA, x[1], x[2]))
    assert same_bits(arrays, by_numba([kernel], np.array([a, b, c]))[0])
    with np.errstate(all="ignore"):
        assert not same_bits(arrays, a * b + c)
    finite = [k for k in range(2000) if math.isfinite(arrays[k])]
    exact = [Fraction(a[k]) * Fraction(b[k]) + Fraction(c[k]) for k in finite]
    assert arrays[finite].tolist() == [float(value) for value in exact]


def test_a_flip_looks_at_the_last_bit() -> None:
    turns = np.array([6755399441055744.0 + n for n in range(-5, 6)])
    expected = [-2.5 if n % 2 else 2.5 for n in range(-5, 6)]
    assert flipped(2.5, turns).tolist() == expected == [flipped_scalar(2.5, float(t)) for t in turns]
    kernel = _kernel(2, lambda x: x[0].apply(Operation.FLIP, x[1]))
    assert by_numba([kernel], np.array([np.full(11, 2.5), turns])).tolist() == [expected]


def _kernel(inputs: int, function: Callable[[list[Scalar]], Scalar]) -> Kernel:
    out = InstructionList(inputs)
    result = function([Scalar(out, k) for k in range(inputs)])
    names = tuple(f"x{k}" for k in range(inputs))
    return Kernel(
        name="one", inputs=names, outputs=("y",), instructions=tuple(out.instructions), results=(result.index,)
    )


def test_a_product_of_two_sums_is_fused_with_both_until_it_is_needed_itself() -> None:
    def function(x: list[Scalar]) -> Scalar:
        product = x[0] * x[1]
        return (product + x[2]) / (x[2] - product) / (product / x[2]) / (product + 1.0)

    written = in_arithmetic(_kernel(3, function), Fused())
    assert written.operations == {
        Operation.FMA: 2,
        Operation.NEG: 1,
        Operation.MUL: 1,
        Operation.ADD: 1,
        Operation.DIV: 4,
    }


def test_what_rounds_has_no_derivative() -> None:
    floor = in_arithmetic(_kernel(1, lambda x: x[0].apply(Operation.FLOOR)), Plain())
    sine = in_arithmetic(_kernel(1, lambda x: x[0].apply(Operation.SIN)), Fused())
    for kernel in (floor, sine):
        with pytest.raises(UlnaError, match="choose the arithmetic last"):
            tangents(kernel, ["x0"])
        with pytest.raises(UlnaError, match="choose the arithmetic last"):
            lie_derivatives(kernel, ["x0"], ["y"], 2)


def test_a_fused_sum_has_a_derivative() -> None:
    kernel = in_arithmetic(_kernel(3, lambda x: x[0] * x[1] + x[2]), Fused())
    assert kernel.operations == {Operation.FMA: 1}
    assert to_python(tangents(kernel, kernel.inputs))(2.0, 3.0, 5.0) == (3.0, 2.0, 1.0)


def test_floor_is_exact_on_special_numbers() -> None:
    evaluate = to_numpy(in_arithmetic(_kernel(1, lambda x: x[0].apply(Operation.FLOOR)), Plain()))
    values = np.concatenate([SPECIAL[np.abs(SPECIAL) != 2.0**51 + 0.5], np.arange(-8, 8) / 4])
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(evaluate(values)[0], np.floor(values))
