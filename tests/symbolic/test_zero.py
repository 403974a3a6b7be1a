"""The zero test proves identities, refutes the rest with a point, and says honestly when it only has samples."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import Status
from ulna.symbolic.exact import SampledZero, are_zero, is_zero

x, y, z, a, b = sp.symbols("x y z a b", real=True)
sin, cos, tan, exp, log, sqrt = sp.sin, sp.cos, sp.tan, sp.exp, sp.log, sp.sqrt
third = sp.Rational(1, 3)

IDENTITIES = [
    sin(x) ** 2 + cos(x) ** 2 - 1,
    sin(2 * x) - 2 * sin(x) * cos(x),
    sin(x + y) - sin(x) * cos(y) - cos(x) * sin(y),
    cos(x - y) - cos(x) * cos(y) - sin(x) * sin(y),
    tan(x / 2) - (1 - cos(x)) / sin(x),
    tan(x + y) - (tan(x) + tan(y)) / (1 - tan(x) * tan(y)),
    sin(3 * x / 2) - sin(x) * cos(x / 2) - cos(x) * sin(x / 2),
    sin((x + y) / a) - sin(x / a) * cos(y / a) - cos(x / a) * sin(y / a),
    sin((x + y) ** 2) - sin(x**2 + 2 * x * y + y**2),
    sin(x + sp.pi / 3) - sin(x) / 2 - sqrt(3) * cos(x) / 2,
    exp(x + y) - exp(x) * exp(y),
    exp(x / 2) ** 3 - exp(3 * x / 2),
    x**a * x - x ** (a + 1),
    exp(a * log(x)) - x**a,
    log(x * y) - log(x) - log(y),
    log(x**2 * y) - 2 * log(x) - log(y),
    log(exp(x) * y) - x - log(y),
    log(x / y) + log(y) - log(x),
    sqrt(x * y) - sqrt(x) * sqrt(y),
    sqrt(1 / x) - 1 / sqrt(x),
    sqrt(x**2 + y**2) ** 3 / (x**2 + y**2) - sqrt(x**2 + y**2),
    x**third * x ** (2 * third) - x,
    sqrt(1 - sin(x) ** 2) - sp.Abs(cos(x)),
    sqrt((x - y) ** 2) - sp.Abs(x - y),
    1 / (sqrt(x) - 1) - (sqrt(x) + 1) / (x - 1),
    sqrt(6) * sqrt(2 * x) - 2 * sqrt(3 * x),
    sp.Abs(x) * sp.sign(x) - x,
    sp.cosh(x) ** 2 - sp.sinh(x) ** 2 - 1,
    sp.tanh(x) - (exp(2 * x) - 1) / (exp(2 * x) + 1),
    sp.asinh(x) - log(x + sqrt(1 + x**2)),
    sin(2 * sp.asin(x)) - 2 * x * sqrt(1 - x**2),
    cos(sp.atan(x) + y) - (cos(y) - x * sin(y)) / sqrt(1 + x**2),
    sin(sp.atan2(y, x)) - y / sqrt(x**2 + y**2),
    sp.acos(x) + sp.asin(x) - sp.pi / 2,
    (x**2 - y**2) / (x - y) - x - y,
    sp.Function("p")(x) * (x + 1) - x * sp.Function("p")(x) - sp.Function("p")(x),
]


@pytest.mark.parametrize("expression", IDENTITIES, ids=str)
def test_identities_are_proved(expression: sp.Expr) -> None:
    assert is_zero(expression).status is Status.PROVED


@pytest.mark.parametrize("expression", IDENTITIES, ids=str)
def test_a_slightly_wrong_identity_is_refuted_with_its_point_and_value(expression: sp.Expr) -> None:
    wrong = expression + sp.Rational(1, 10**15) * x
    verdict = is_zero(wrong)
    assert verdict.fails
    claimed = verdict.evidence["value"]
    assert claimed != 0
    if not wrong.has(sp.Function("p")):
        value = sp.N(wrong.subs(verdict.evidence["point"]), 30)
        assert abs(value / claimed - 1) < sp.Rational(1, 10**15)


def test_a_tiny_factor_is_not_taken_for_zero() -> None:
    assert is_zero(x / 10**60).fails
    assert is_zero(exp(-200) * x).fails


def test_a_difference_below_double_precision_is_seen() -> None:
    assert is_zero(sp.Rational(10**30 + 1, 10**30) * x - x).fails


def test_a_true_identity_without_known_relations_is_only_supported() -> None:
    verdict = is_zero(sp.gamma(x + 1) - x * sp.gamma(x))
    assert verdict.status is Status.SUPPORTED
    assert verdict.evidence["points"] > 0


def test_an_expression_that_is_nowhere_real_is_undecided() -> None:
    assert is_zero(sqrt(-1 - x**2)).status is Status.UNDECIDED


def test_a_vanishing_denominator_is_undecided() -> None:
    assert is_zero(x / (sin(x) ** 2 + cos(x) ** 2 - 1)).status is Status.UNDECIDED


def test_an_expression_above_the_size_limit_is_not_proved() -> None:
    verdict = is_zero((x + 1) ** 2 - x**2 - 2 * x - 1, test=SampledZero(operations=2))
    assert verdict.status is Status.SUPPORTED


def test_no_time_means_no_proof() -> None:
    assert is_zero(sin(2 * x) - 2 * sin(x) * cos(x), test=SampledZero(seconds=0)).status is Status.SUPPORTED


def test_points_near_a_base_decide_what_holds_only_there() -> None:
    branch = sp.asin(sin(x)) - x
    assert is_zero(branch).fails
    near = SampledZero(near={x: sp.Rational(1, 10)}, radius=sp.Rational(1, 10))
    assert is_zero(branch, test=near).holds
    assert is_zero(branch, test=SampledZero(near={x: sp.pi})).fails


def test_a_base_may_contain_parameters() -> None:
    test = SampledZero(near={x: a + 10}, radius=sp.Rational(1, 100))
    assert is_zero(sp.Abs(x - a) - (x - a), test=test).holds


def test_logarithms_and_roots_find_their_domain() -> None:
    assert is_zero(log(-x) + sqrt(x + 2) - sp.asin(x + y)).fails


def test_piecewise_and_unknown_functions_are_sampled() -> None:
    assert is_zero(sp.Piecewise((x, x > 0), (-x, True)) - sp.Abs(x)).status is Status.SUPPORTED
    assert is_zero(sp.Max(x, y) + sp.Min(x, y) - x - y).status is Status.SUPPORTED
    assert is_zero(sp.Piecewise((x, x > y), (y, True)) - x).fails


def test_the_same_seed_gives_the_same_point() -> None:
    first, second = is_zero(x * sin(y) - 1), is_zero(x * sin(y) - 1)
    assert first.evidence["point"] == second.evidence["point"]


def test_many_expressions_name_the_one_that_fails() -> None:
    assert are_zero([sp.S.Zero, x - x, sin(x) ** 2 + cos(x) ** 2 - 1]).status is Status.PROVED
    verdict = are_zero([sp.S.Zero, x])
    assert verdict.fails
    assert verdict.evidence["index"] == 1


leaves = st.sampled_from([x, y, a, sp.S.One, sp.Rational(1, 2), sp.Integer(-3)])
expressions = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.builds(lambda u, v: u + v, inner, inner),
        st.builds(lambda u, v: u * v, inner, inner),
        st.builds(lambda u: u / (1 + a**2), inner),
        st.builds(sin, inner),
        st.builds(cos, inner),
        st.builds(lambda u: exp(u / 4), inner),
        st.builds(lambda u: sqrt(1 + u**2), inner),
        st.builds(lambda u: log(2 + sin(u)), inner),
    ),
    max_leaves=7,
)


@settings(max_examples=60, deadline=None)
@given(expressions)
def test_an_expression_less_its_expansion_is_zero(expression: sp.Expr) -> None:
    assert is_zero(expression - sp.expand(expression)).holds


@settings(max_examples=60, deadline=None)
@given(expressions, expressions)
def test_the_product_rule_is_proved(first: sp.Expr, second: sp.Expr) -> None:
    rule = sp.diff(first * second, x) - first.diff(x) * second - first * second.diff(x)
    assert not is_zero(rule).fails


@settings(max_examples=60, deadline=None)
@given(expressions)
def test_a_proof_never_contradicts_a_sample(expression: sp.Expr) -> None:
    shifted = expression - sp.together(expression) + sp.Rational(1, 7**20)
    assert is_zero(shifted).fails
