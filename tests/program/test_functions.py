"""Sine, exponential, power and so on as kernels have them written out, against forty digits."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from compilers import by_numba, inspected

import ulna.program.arithmetic
from ulna.program import (
    AbstractArithmetic,
    Fused,
    InstructionList,
    Kernel,
    Operation,
    Plain,
    Precision,
    Scalar,
    in_arithmetic,
    to_numpy,
)

ARITHMETICS = [kind(precision=precision) for kind in (Plain, Fused) for precision in Precision]
TABLE = re.findall(r"^\| ([\w, ]+) \| ([\d.]+) \|", str(ulna.program.arithmetic.__doc__), flags=re.MULTILINE)
STATED = {Operation(name): float(error) for names, error in TABLE for name in names.split(", ")}


def function(operation: Operation, arithmetic: AbstractArithmetic | None = None) -> Kernel:
    """One operation, written out where an arithmetic is given."""
    count = 2 if operation in (Operation.POW, Operation.ATAN2) else 1
    out = InstructionList(count)
    first, *others = (Scalar(out, k) for k in range(count))
    result = first.apply(operation, *others).index
    kernel = Kernel(
        name=operation.value,
        inputs=("x", "y")[:count],
        outputs=("f",),
        instructions=tuple(out.instructions),
        results=(result,),
    )
    return kernel if arithmetic is None else in_arithmetic(kernel, arithmetic)


def values(operation: Operation, arithmetic: AbstractArithmetic, *x: np.ndarray | float) -> np.ndarray:
    return to_numpy(function(operation, arithmetic), precision=arithmetic.precision)(*map(np.atleast_1d, x))[0]


def ulps(found: np.ndarray, exact: list, precision: Precision, least: float = 0.0) -> np.ndarray:
    """Errors in units in the last place of the exact values, of `least` where they are smaller."""
    errors = []
    smallest = -1022 if precision is Precision.DOUBLE else -126
    for value, true in zip(found.tolist(), exact, strict=True):
        size = max(abs(true), mpmath.mpf(least))
        exponent = max(int(mpmath.floor(mpmath.log(size, 2))), smallest) if size else smallest
        errors.append(abs(mpmath.mpf(value) - true) / mpmath.mpf(2) ** (exponent - precision.bits + 1))
    return np.array([float(each) for each in errors])


def sizes(random: np.random.Generator, low: float, high: float, count: int = 400) -> np.ndarray:
    """Numbers of both signs of all magnitudes between two powers of ten."""
    return random.choice([-1.0, 1.0], count) * 10.0 ** random.uniform(low, high, count)


def angles(random: np.random.Generator, precision: Precision) -> np.ndarray:
    single = precision is Precision.SINGLE
    zeros = np.arange(-150, 151) * (math.pi / 2)
    near = zeros[zeros != 0.0] + random.uniform(-1, 1, 300) * (1e-3 if single else 1e-9)
    wide = random.uniform(-6e3, 6e3, 300) * (1.0 if single else 500.0)
    return np.concatenate([random.uniform(-7, 7, 500), wide, near, zeros, sizes(random, -30, 0)])


def arguments(operation: Operation, precision: Precision) -> tuple[np.ndarray, ...]:
    """Random and hard points of the domain, rounded to the precision."""
    random = np.random.default_rng(list(Operation).index(operation))
    single = precision is Precision.SINGLE
    top, bottom = (88.0, -103.9) if single else (709.0, -745.0)
    decades = 37.0 if single else 307.0
    breaks = (np.arange(-20, 21) + 0.5) * math.log(2.0)
    near_one = 1.0 + sizes(random, -15, -0.5)
    match operation:
        case Operation.SIN | Operation.COS | Operation.TAN:
            x: tuple[np.ndarray, ...] = (angles(random, precision),)
        case Operation.EXP:
            x = (np.concatenate([random.uniform(bottom, top, 600), breaks, sizes(random, -20, 0)]),)
        case Operation.LOG:
            powers = 2.0 ** np.arange(-130.0, 127.0) * math.sqrt(2.0)
            x = (np.concatenate([abs(sizes(random, -decades - 7, decades)), near_one, powers]),)
        case Operation.SINH | Operation.COSH:
            x = (np.concatenate([random.uniform(-top, top, 300), random.uniform(-2, 2, 600), sizes(random, -20, 0)]),)
        case Operation.TANH | Operation.ASINH | Operation.ATAN:
            x = (np.concatenate([sizes(random, -decades, decades), random.uniform(-3, 3, 900)]),)
        case Operation.ACOSH:
            x = (1.0 + abs(np.concatenate([sizes(random, -7, decades), sizes(random, -3, 1, 900)])),)
        case Operation.ASIN | Operation.ACOS | Operation.ATANH:
            edge = (1.0 - precision.dtype(2.0**-precision.bits)) * (1.0 - abs(sizes(random, -15, 0)))
            x = (np.concatenate([random.uniform(-1, 1, 900), edge, 1e-3 - edge, sizes(random, -20, 0)]),)
        case Operation.ATAN2:
            x = sizes(random, -9, 9, 900), sizes(random, -9, 9, 900)
        case Operation.POW:
            base = np.concatenate([random.uniform(0, 10, 300), abs(sizes(random, -decades, decades, 300)), near_one])
            base = base.astype(precision.dtype).astype(float)
            base = base[base != 1.0]
            most = np.abs(0.99 * top / np.log(base))
            x = base, random.uniform(-1, 1, len(base)) * np.minimum(most, 1e6)
        case _:
            x = (np.concatenate([random.uniform(-9, 9, 500), sizes(random, -30, 15)]),)
    return tuple(each.astype(precision.dtype).astype(float) for each in x)


EXACT: dict[Operation, Callable] = {
    Operation.POW: mpmath.power,
    **{each: getattr(mpmath, each.value) for each in STATED if each is not Operation.POW},
}


def test_every_function_has_a_stated_error() -> None:
    elementary = {i.operation for each in Operation for i in _operations_left(each)}
    assert not elementary & STATED.keys()
    assert len(STATED) == 17


def _operations_left(operation: Operation) -> tuple:
    return function(operation, Plain()).instructions if operation in STATED else ()


@pytest.mark.parametrize("operation", STATED)
@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=str)
def test_errors_stay_below_what_is_stated(operation: Operation, arithmetic: AbstractArithmetic) -> None:
    x = arguments(operation, arithmetic.precision)
    found = values(operation, arithmetic, *x)
    least = 0.0
    if operation in (Operation.SIN, Operation.COS, Operation.TAN):
        least = 1e-13 if arithmetic.precision is Precision.DOUBLE else 1e-5
    if operation is Operation.TAN:
        near_poles = np.abs(found) > 1.0 / least
        x, found = (x[0][~near_poles],), found[~near_poles]
    with mpmath.workdps(40):
        exact = [EXACT[operation](*map(mpmath.mpf, each)) for each in zip(*x, strict=True)]
        assert ulps(found, exact, arithmetic.precision, least).max() <= STATED[operation]


@pytest.mark.parametrize("precision", Precision)
def test_the_measure_of_errors_sees_a_wrong_last_digit(precision: Precision) -> None:
    x = np.array([1.0, 2.5, 300.0])
    with mpmath.workdps(40):
        exact = [mpmath.log(mpmath.mpf(each)) for each in x]
        wrong = np.array([float(each) for each in exact]) * (1.0 + 3.0 * 2.0**-precision.bits)
        assert ulps(wrong, exact, precision).max() > 1.0


EDGES = [
    (Operation.EXP, (-math.inf,), 0.0),
    (Operation.EXP, (math.inf,), math.inf),
    (Operation.EXP, (0.0,), 1.0),
    (Operation.LOG, (0.0,), -math.inf),
    (Operation.LOG, (-0.0,), -math.inf),
    (Operation.LOG, (-1.0,), math.nan),
    (Operation.LOG, (math.inf,), math.inf),
    (Operation.LOG, (1.0,), 0.0),
    (Operation.SIN, (0.0,), 0.0),
    (Operation.SIN, (math.inf,), math.nan),
    (Operation.COS, (0.0,), 1.0),
    (Operation.COS, (-math.inf,), math.nan),
    (Operation.TAN, (0.0,), 0.0),
    (Operation.SINH, (0.0,), 0.0),
    (Operation.SINH, (-math.inf,), -math.inf),
    (Operation.COSH, (-math.inf,), math.inf),
    (Operation.COSH, (0.0,), 1.0),
    (Operation.TANH, (0.0,), 0.0),
    (Operation.TANH, (math.inf,), 1.0),
    (Operation.TANH, (-30.0,), -1.0),
    (Operation.ASINH, (0.0,), 0.0),
    (Operation.ASINH, (-math.inf,), -math.inf),
    (Operation.ACOSH, (1.0,), 0.0),
    (Operation.ACOSH, (0.5,), math.nan),
    (Operation.ACOSH, (math.inf,), math.inf),
    (Operation.ATANH, (1.0,), math.inf),
    (Operation.ATANH, (-1.0,), -math.inf),
    (Operation.ATANH, (1.5,), math.nan),
    (Operation.ATANH, (0.0,), 0.0),
    (Operation.ASIN, (1.0,), math.pi / 2),
    (Operation.ASIN, (0.0,), 0.0),
    (Operation.ASIN, (1.5,), math.nan),
    (Operation.ACOS, (-1.0,), math.pi),
    (Operation.ACOS, (1.0,), 0.0),
    (Operation.ACOS, (-1.5,), math.nan),
    (Operation.ATAN, (-math.inf,), -math.pi / 2),
    (Operation.ATAN, (0.0,), 0.0),
]


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=str)
def test_edges_are_those_of_ieee_arithmetic(arithmetic: AbstractArithmetic) -> None:
    for operation, x, expected in EDGES:
        found = values(operation, arithmetic, *x)[0]
        rounded = arithmetic.precision.rounded(expected)
        assert found == rounded or (math.isnan(found) and math.isnan(rounded)), (operation, x)
    for operation in STATED:
        if operation not in (Operation.POW, Operation.ATAN2):
            assert math.isnan(values(operation, arithmetic, math.nan)[0]), operation


SPECIAL = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    2.0,
    -2.0,
    3.0,
    -3.0,
    0.5,
    -0.5,
    2.5,
    math.inf,
    -math.inf,
    math.nan,
    1e30,
    -1e30,
    1e-30,
)


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=str)
@pytest.mark.parametrize("operation", [Operation.POW, Operation.ATAN2])
def test_edges_of_two_arguments_are_those_of_c(operation: Operation, arithmetic: AbstractArithmetic) -> None:
    pairs = np.array(list(itertools.product(SPECIAL, repeat=2)))
    found = values(operation, arithmetic, pairs[:, 0], pairs[:, 1])
    kind = arithmetic.precision.dtype
    with np.errstate(all="ignore"):
        reference = {Operation.POW: np.power, Operation.ATAN2: np.arctan2}[operation]
        expected = reference(pairs[:, 0].astype(kind), pairs[:, 1].astype(kind))
        np.testing.assert_array_max_ulp(found.astype(kind), expected.astype(kind), 2)
    assert np.signbit(found).tolist() == np.where(np.isnan(found), np.signbit(found), np.signbit(expected)).tolist()


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=str)
def test_whole_powers_of_whole_numbers_are_exact(arithmetic: AbstractArithmetic) -> None:
    pairs = [
        (float(b), float(n)) for b in range(-12, 13) for n in range(16) if abs(b) ** n < 2**arithmetic.precision.bits
    ]
    base, exponent = np.array(pairs).T
    assert values(Operation.POW, arithmetic, base, exponent).tolist() == [b**n for b, n in pairs]


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=str)
def test_values_beyond_the_range_of_numbers_come_monotonically(arithmetic: AbstractArithmetic) -> None:
    kind = arithmetic.precision.dtype
    limits = np.finfo(kind)
    for edge in (math.log(float(limits.max)), math.log(float(limits.smallest_subnormal)) - math.log(2.0), 0.0):
        x = np.asarray(kind(edge) + np.arange(-300, 301) * 8 * abs(np.spacing(kind(edge or 1.0))), dtype=float)
        found = values(Operation.EXP, arithmetic, x).astype(float)
        assert (np.diff(found[np.isfinite(found)]) >= 0.0).all()
        assert not np.isnan(found).any()
        assert np.isfinite(found).all() == (edge <= 0.0)
    small = np.concatenate([[0.0], float(limits.smallest_subnormal) * 2.0 ** np.arange(60)])
    assert (np.diff(values(Operation.LOG, arithmetic, small)) > 0.0).all()


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=str)
def test_sine_and_tanh_never_leave_their_range(arithmetic: AbstractArithmetic) -> None:
    top = (np.arange(-200, 201) + 0.5)[:, None] * math.pi + np.linspace(-1e-3, 1e-3, 101)
    # Fused by a unit at most.
    most = 1.0 + (2.0 ** (1 - arithmetic.precision.bits) if isinstance(arithmetic, Fused) else 0.0)
    assert np.abs(values(Operation.SIN, arithmetic, top.ravel())).max() <= most
    assert np.abs(values(Operation.COS, arithmetic, top.ravel() + math.pi / 2)).max() <= most
    assert np.abs(values(Operation.TANH, arithmetic, np.linspace(-25, 25, 20_001))).max() <= most


@pytest.mark.parametrize("precision", Precision)
def test_angles_that_mean_nothing_have_no_sine(precision: Precision) -> None:
    arithmetic = Plain(precision=precision)
    far = 2.0 ** (precision.bits - 2)
    assert np.isnan(values(Operation.SIN, arithmetic, np.array([far, -4 * far, 1e30]))).all()
    assert np.abs(values(Operation.SIN, arithmetic, np.linspace(0.1, 0.99, 999) * far)).max() <= 1.0


def test_large_angles_are_off_by_a_unit_in_their_last_place() -> None:
    x = 10.0 ** np.random.default_rng(1).uniform(6, 10, 500)
    for arithmetic, units in ((Plain(), 1.0), (Fused(), 0.0)):
        for operation in (Operation.SIN, Operation.COS):
            found = values(operation, arithmetic, x)
            with mpmath.workdps(40):
                exact = [float(EXACT[operation](mpmath.mpf(each))) for each in x]
            assert (np.abs(found - exact) <= 4.5e-16 + units * np.spacing(x)).all()


def test_numba_makes_vector_code_without_calls() -> None:
    kernels = [function(operation, Plain()) for operation in (Operation.SIN, Operation.EXP, Operation.LOG)]
    text = inspected(kernels)
    assert "mulpd" in text
    assert not re.search(r"call.*\b(sin|exp|log|pow|floor)\b", text)
    assert "exp" in inspected([function(Operation.EXP)])
    x = np.linspace(0.1, 5.0, 40)[None, :]
    whole = by_numba(kernels, x)
    assert all((by_numba(kernels, np.ascontiguousarray(x[:, k : k + 1]))[:, 0] == whole[:, k]).all() for k in range(5))
