"""A kernel means what its expressions mean, in every lowering."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from typing import Any

import heyoka as hy
import numba
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import FormulaError, SimulationError
from ulna.program import Operation, restricted, to_numpy, to_python, to_python_source
from ulna.program.lowering.casadi import to_casadi
from ulna.program.lowering.heyoka import to_heyoka
from ulna.symbolic.compiling import kernel

x, y, z = sp.symbols("x y z", real=True)
third = sp.Rational(1, 3)
SMOOTH = {
    "polynomial": x**5 - 2 * x * y / 3 + y**2 * z - 7,
    "negative_powers": x / y**2 - 3 / (x * z) + y ** (-1) * z,
    "roots": sp.sqrt(x) + y ** sp.Rational(3, 2) - z ** sp.Rational(-1, 2) + x**third + (x * y) ** sp.Rational(-5, 2),
    "trigonometric": sp.sin(x) * sp.cos(y) + sp.tan(z / 2) - sp.sec(x / 3) + sp.cot(y + 1),
    "inverse": sp.asin(x / 4) + sp.acos(y / 4) - sp.atan(z) + sp.atan2(y, x),
    "hyperbolic": sp.sinh(x) - sp.cosh(y) * sp.tanh(z) + sp.asinh(x) + sp.acosh(1 + y) + sp.atanh(z / 4),
    "exponential": sp.exp(-x / 2) * sp.log(y) + x**y + sp.exp(1) * sp.pi * sp.sqrt(2) * z,
    "negated": -x - y - z,
    "constant": sp.Rational(22, 7),
    "input": y,
}
EDGED = {
    "limited": sp.Min(sp.Max(x, -1, y / 2), 1, z),
    "absolute": sp.Abs(x - y) * sp.sign(y - z),
    "step": sp.Heaviside(x - y) + sp.Heaviside(z - 1, sp.S.Zero),
    "pieces": sp.Piecewise((x**2, (x < y) & (z <= 1)), (-x, (x > 2) | sp.Eq(y, z)), (z, sp.Ne(x, z)), (0, True)),
}
STAIRS = {"stairs": sp.floor(3 * x) + sp.ceiling(y) + sp.Mod(z, sp.Rational(1, 4))}
EVERYTHING = {**SMOOTH, **EDGED, **STAIRS}
POINTS = np.random.default_rng(3).uniform(0.1, 2.9, (40, 3))


def exact(expression: sp.Expr, point: np.ndarray) -> float:
    values = {symbol: sp.Rational(float(value)) for symbol, value in zip((x, y, z), point, strict=True)}
    return float(sp.N(sp.sympify(expression).subs(values), 30))


@pytest.mark.parametrize("label", EVERYTHING)
def test_kernel_agrees_with_high_precision_arithmetic(label: str) -> None:
    evaluate = to_python(kernel(label, (x, y, z), {label: EVERYTHING[label]}))
    for point in POINTS[:12]:
        assert evaluate(*point)[0] == pytest.approx(exact(EVERYTHING[label], point), rel=1e-12, abs=1e-13)


def test_scalar_numpy_and_python_source_are_bit_equal() -> None:
    everything = kernel("everything", (x, y, z), EVERYTHING)
    namespace: dict[str, Any] = {"math": math}
    exec(to_python_source(everything), namespace)  # noqa: S102 - the generated source is what is tested
    from_numpy = to_numpy(everything)
    for point in POINTS:
        values = tuple(map(float, point))
        assert from_numpy(*values) == namespace["kernel"](*values)


def test_arrays_broadcast_and_agree_with_scalars() -> None:
    everything = kernel("everything", (x, y, z), EVERYTHING)
    evaluate = to_numpy(everything)
    rows, columns = POINTS[:5, 0].reshape(5, 1), POINTS[:7, 1]
    results = evaluate(rows, columns, 0.75)
    assert all(result.shape == (5, 7) for result in results)
    for i, j in ((0, 0), (4, 6), (2, 3)):
        expected = evaluate(float(rows[i, 0]), float(columns[j]), 0.75)
        np.testing.assert_allclose([result[i, j] for result in results], expected, rtol=1e-13, atol=1e-14)


def test_heyoka_agrees() -> None:
    continuous = kernel("continuous", (x, y, z), SMOOTH | EDGED)
    expressions = to_heyoka(continuous)
    compiled = hy.cfunc(list(expressions.values()), vars=hy.make_vars("x", "y", "z"))
    evaluate = to_numpy(continuous)
    for point in POINTS:
        np.testing.assert_allclose(compiled(inputs=point), evaluate(*map(float, point)), rtol=1e-12, atol=1e-13)


def test_heyoka_refuses_a_staircase() -> None:
    with pytest.raises(SimulationError, match="floor"):
        to_heyoka(kernel("stairs", (x, y, z), STAIRS))


def test_casadi_agrees() -> None:
    everything = kernel("everything", (x, y, z), EVERYTHING)
    function, evaluate = to_casadi(everything), to_numpy(everything)
    for point in POINTS:
        np.testing.assert_allclose(
            np.asarray(function(point)).ravel(), evaluate(*map(float, point)), rtol=1e-12, atol=1e-13
        )


def test_numba_compiles_the_source_and_agrees() -> None:
    everything = kernel("everything", (x, y, z), EVERYTHING)
    namespace: dict[str, Any] = {"math": math}
    exec(to_python_source(everything), namespace)  # noqa: S102 - the generated source is what is tested
    compiled = numba.njit(error_model="numpy")(namespace["kernel"])
    evaluate = to_python(everything)
    for point in POINTS[:10]:
        np.testing.assert_allclose(compiled(*map(float, point)), evaluate(*map(float, point)), rtol=1e-14, atol=1e-15)


def test_common_subexpressions_are_computed_once() -> None:
    shared = kernel("shared", (x, y), {"a": sp.sin(x * y) + 1, "b": 3 * sp.sin(x * y), "c": sp.sin(y * x) ** 2})
    assert shared.operations[Operation.SIN] == 1
    assert shared.operation_count == 5  # x y, sin, + 1, 3 ·, squared


def test_integer_powers_are_multiplication_chains() -> None:
    powers = kernel("powers", (x,), {"a": x**12, "b": x**-3})
    assert Operation.POW not in powers.operations
    # x², x⁴, x⁸, x⁸·x⁴; x³ = x·x² shares x²; one division.
    assert powers.operations == {Operation.MUL: 5, Operation.DIV: 1}


def test_rationals_are_rounded_once_to_the_nearest_double() -> None:
    value = sp.Rational(1764, 10000)
    (single,) = kernel("c", (), {"c": value}).instructions
    assert single.value == float(sp.N(value, 60)) == 0.1764
    huge = sp.Rational(10**400 + 1, 10**400)
    assert to_python(kernel("c", (), {"c": huge}))() == (1.0,)


def test_infinities_and_nan_come_out_as_in_ieee_arithmetic() -> None:
    wild = kernel(
        "wild", (x,), {"a": 1 / x, "b": sp.log(x), "c": sp.sqrt(x - 1), "d": sp.exp(1000 + x), "e": x**-third}
    )
    for evaluate in (to_python(wild), lambda value: tuple(float(r[0]) for r in to_numpy(wild)([value]))):
        a, b, c, d, e = evaluate(0.0)
        assert (a, b, d, e) == (math.inf, -math.inf, math.inf, math.inf)
        assert math.isnan(c)


def test_an_unselected_branch_may_be_singular() -> None:
    sinc = to_numpy(kernel("sinc", (x,), {"sinc": sp.Piecewise((sp.sin(x) / x, sp.Ne(x, 0)), (1, True))}))
    assert sinc(0.0) == (1.0,)
    assert sinc(0.5) == (math.sin(0.5) / 0.5,)


def test_a_limiter_hands_nan_on() -> None:
    limited = kernel("limited", (x,), {"u": sp.Min(sp.Max(x, -24), 24)})
    assert math.isnan(to_python(limited)(math.nan)[0])
    assert np.isnan(to_numpy(limited)(np.array([math.nan]))[0][0])
    assert math.isnan(hy.cfunc(list(to_heyoka(limited).values()), vars=[hy.expression("x")])(inputs=[math.nan])[0])


def test_names_that_are_no_identifiers_are_allowed() -> None:
    odd = (sp.Symbol("lambda", real=True), sp.Symbol("x'", real=True), sp.Symbol("v1", real=True))
    product = kernel("odd", odd, {"p": sp.sin(odd[0]) * odd[1] ** 2 + odd[2]})
    assert to_python(product)(0.5, 3.0, 1.0)[0] == pytest.approx(math.sin(0.5) * 9.0 + 1.0, rel=1e-15)


def test_restriction_keeps_values_and_drops_the_rest() -> None:
    everything = kernel("everything", (x, y, z), EVERYTHING)
    small = restricted(everything, ("input", "polynomial"))
    assert small.operation_count < 15
    point = (0.3, 0.4, 0.5)
    full = dict(zip(everything.outputs, to_python(everything)(*point), strict=True))
    assert to_python(small)(*point) == (full["input"], full["polynomial"])
    with pytest.raises(FormulaError, match="absent"):
        restricted(everything, ("absent",))


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ({"a": x + sp.Symbol("w", real=True), "b": sp.Symbol("q", real=True)}, r"q \(in b\), w \(in a\)"),
        ({"a": sp.Symbol("x") + y}, "other assumptions"),
        ({"a": sp.Function("mystery")(x)}, "mystery"),
        ({"a": sp.Derivative(sp.Function("f")(x), x)}, "Derivative"),
        ({"a": x + sp.I}, "not a finite real"),
        ({"a": x + sp.zoo * y}, "not a finite real"),
        ({"a": x * sp.Integer(10) ** 400}, "not a finite real"),
        ({"a": sp.gamma(x)}, "gamma"),
    ],
)
def test_what_has_no_value_is_refused_by_name(outputs: dict[str, sp.Expr], message: str) -> None:
    with pytest.raises(FormulaError, match=message):
        kernel("bad", (x, y), outputs)


def test_two_inputs_of_one_name_are_refused() -> None:
    with pytest.raises(FormulaError, match="input x appears more than once"):
        kernel("bad", (x, sp.Symbol("x")), {"a": x})


leaves = st.sampled_from([x, y, z, sp.Rational(1, 3), sp.Integer(2), sp.Integer(-1)])
trees = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.builds(lambda a, b: a + b, inner, inner),
        st.builds(lambda a, b: a - b, inner, inner),
        st.builds(lambda a, b: a * b, inner, inner),
        st.builds(lambda a: a / (1 + a**2), inner),
        st.builds(sp.sin, inner),
        st.builds(lambda a: sp.exp(sp.cos(a)), inner),
        st.builds(lambda a, b: sp.Piecewise((a, a < b), (b, True)), inner, inner),
    ),
    max_leaves=8,
)


@settings(max_examples=40)
@given(tree=trees, point=st.tuples(*(st.fractions(-2, 2, max_denominator=64) for _ in range(3))))
def test_random_expressions_keep_their_value(tree: sp.Expr, point: tuple) -> None:
    lowered = kernel("tree", (x, y, z), {"value": tree})
    values = {symbol: sp.Rational(v.numerator, v.denominator) for symbol, v in zip((x, y, z), point, strict=True)}
    expected = float(sp.N(sp.sympify(tree).subs(values), 30))
    found = to_python(lowered)(*(float(v) for v in point))[0]
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9) or _near_a_jump(tree, values)


def _near_a_jump(tree: sp.Expr, values: dict[Any, Any]) -> bool:
    """A comparison of two sides that are equal up to rounding may fall either way."""
    comparisons: Any = tree.atoms(sp.StrictLessThan, sp.StrictGreaterThan)
    sides = [abs(sp.N((c.lhs - c.rhs).subs(values), 30)) for c in comparisons]
    return any(side < 1e-12 for side in sides)


def test_kernels_are_the_same_in_every_process() -> None:
    code = (
        "import sympy as sp\nfrom ulna.symbolic.compiling import kernel\n"
        "x, y, z = sp.symbols('x y z', real=True)\n"
        "print(kernel('k', (x, y, z), {'a': sp.Min(x, y*z, sp.Max(x*y, z)) + x*y*sp.sin(z) + z**2/3}).instructions)"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(texts) == 1
