"""Maps are inverted on the branch through the base point."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import Status
from ulna.symbolic.exact import SampledZero, is_zero
from ulna.symbolic.solving import Inversion, invert_map

x1, x2, x3, x4 = x = sp.symbols("x1:5", real=True)
z1, z2, z3, z4 = z = sp.symbols("z1:5", real=True)
a, G, I1, J, k, K, L, M, B = sp.symbols("a G I1 J k K L M B", real=True)
sin, cos, exp, sqrt = sp.sin, sp.cos, sp.exp, sp.sqrt
zero, one = sp.S.Zero, sp.S.One
slope = sp.Rational(49, 5)


def inverted(forward: list[sp.Expr], near: list[sp.Expr], seconds: float = 10.0) -> Inversion:
    count = len(forward)
    return invert_map(forward, x[:count], z[:count], near=dict(zip(x, near, strict=False)), seconds=seconds)


def same(first: sp.Expr, second: sp.Expr) -> bool:
    return is_zero(first - second).status is Status.PROVED


# Published and constructed transformations: Zak 2003 ch. 7; Slotine & Li 1991 sec. 6.1.2, 6.3; Khalil 2002 sec. 13.1;
# Chiasson 1994 (series motor).
KNOWN = {
    "arm with motor": ([x1, x2, slope * sin(x1) + x3], [zero] * 3, [z1, z2, z3 - slope * sin(z1)]),
    "flexible joint": (
        [
            x1,
            x2,
            -(M * G * L / I1) * sin(x1) - (k / I1) * (x1 - x3),
            -(M * G * L / I1) * x2 * cos(x1) - (k / I1) * (x2 - x4),
        ],
        [zero] * 4,
        [z1, z2, z1 + (I1 * z3 + M * G * L * sin(z1)) / k, z2 + (I1 * z4 + M * G * L * z2 * cos(z1)) / k],
    ),
    "input-state": ([x1, -2 * x1 + a * x2 + sin(x1)], [zero] * 2, [z1, (z2 + 2 * z1 - sin(z1)) / a]),
    "sine chain": ([x1, a * sin(x2)], [zero] * 2, [z1, sp.asin(z2 / a)]),
    "bilinear": ([x1 + x2 * x3, x2, x3], [zero] * 3, [z1 - z2 * z3, z2, z3]),
    "circle": ([x1**2 + x2**2, x2], [one, zero], [sqrt(z1 - z2**2), z2]),
    "circle, other half": ([x1**2 + x2**2, x2], [-one, zero], [-sqrt(z1 - z2**2), z2]),
    "linear equation inside": ([x1 * exp(x2) + x3, x2, x3], [zero] * 3, [(z1 - z3) * exp(-z2), z2, z3]),
    "series motor": ([x2, (K * x1**2 - B * x2) / J], [one, one], [sqrt((J * z2 + B * z1) / K), z1]),
    "rotation": (
        [x1 * cos(a) - x2 * sin(a), x1 * sin(a) + x2 * cos(a)],
        [one, zero],
        [z1 * cos(a) + z2 * sin(a), z2 * cos(a) - z1 * sin(a)],
    ),
    "exponential": ([exp(x1) * x2, x1], [zero, one], [z2, z1 * exp(-z2)]),
    "moebius": ([x1 / (1 + x1), x2 * (1 + x1)], [one, zero], [z1 / (1 - z1), z2 * (1 - z1)]),
    "sine beyond a quarter turn": ([sin(x1) + x2, x2], [sp.pi, zero], [sp.pi - sp.asin(z1 - z2), z2]),
    "cosine on the lower side": ([cos(x1), x2], [-one, zero], [-sp.acos(z1), z2]),
    "tangent one turn on": ([sp.tan(x1), x2], [sp.pi, zero], [sp.pi + sp.atan(z1), z2]),
    "hyperbolic": ([sp.sinh(x1), x2 * sp.cosh(x1)], [one, zero], [sp.asinh(z1), z2 / sqrt(1 + z1**2)]),
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_inverses_are_found_and_proved(name: str) -> None:
    forward, near, expected = KNOWN[name]
    found = inverted(forward, near)
    assert found.expressions is not None
    assert found.verdict.status is Status.PROVED
    assert all(same(one, two) for one, two in zip(found.expressions, expected, strict=True))


@pytest.mark.parametrize(
    ("forward", "near"),
    [
        ([x1 * cos(x2), x1 * sin(x2)], [one, zero]),
        ([x1 * sin(x2) * cos(x3), x1 * sin(x2) * sin(x3), x1 * cos(x2)], [one, one, zero]),
        ([x1**3 + x1, x2], [one, zero]),
        ([exp(x1) + x2, exp(-x1) + x2], [zero, zero]),
        ([x1**2 + a * x1 + x2, x2], [one, zero]),
        ([x2 * exp(x1), x1 + x2 * exp(x1)], [zero, one]),
    ],
    ids=str,
)
def test_inverses_without_a_reference_hold_near_the_base_point(forward: list[sp.Expr], near: list[sp.Expr]) -> None:
    found = inverted(forward, near)
    assert found.expressions is not None
    assert found.verdict.holds
    there = dict(zip(z, forward, strict=False))
    base = dict(zip(x, near, strict=False))
    test = SampledZero(near=base, radius=sp.Rational(1, 1000))
    assert all(is_zero(one.xreplace(there) - x[i], test=test).holds for i, one in enumerate(found.expressions))


def test_the_conditions_of_the_branch_are_told() -> None:
    assert inverted(*KNOWN["circle"][:2]).positive == (z1 - z2**2,)
    chain = inverted(*KNOWN["sine chain"][:2])
    assert chain.nonzero == (a,)
    assert same(chain.positive[0] * a**2, a**2 - z2**2)


def test_a_singular_base_point_is_moved_and_named() -> None:
    found = inverted([x1**2 + x2, x2], [zero, zero])
    assert found.expressions == (sqrt(z1 - z2), z2)
    assert found.verdict.evidence["base"][x1] > 0


def test_a_map_without_elementary_inverse_is_undecided_with_what_was_tried() -> None:
    found = inverted([x1 + x2 * sin(x1) + x2**5, x2 * exp(x1) + x1**3 + x2], [one, one], seconds=0.5)
    assert found.expressions is None
    assert found.verdict.status is Status.UNDECIDED
    assert found.verdict.evidence["tried"]


def test_a_map_with_dependent_components_is_undecided() -> None:
    found = inverted([x1 + x2, 2 * x1 + 2 * x2], [zero, zero])
    assert found.expressions is None
    assert found.verdict.status is Status.UNDECIDED


polynomials = st.lists(st.integers(-3, 3), min_size=3, max_size=3)


@settings(max_examples=15, deadline=None)
@given(polynomials, polynomials, st.permutations([0, 1, 2]))
def test_triangular_maps_are_always_inverted(first: list[int], second: list[int], order: list[int]) -> None:
    forward = [
        x1,
        x2 * exp(x1) + first[0] * x1**2 + first[1] * sin(x1) + first[2],
        2 * x3 + second[0] * x1 * x2 + second[1] * cos(x2) + second[2],
    ]
    found = inverted([forward[i] for i in order], [one, one, one])
    assert found.verdict.status is Status.PROVED


def test_a_branch_that_hangs_on_the_size_of_a_parameter_is_checked_near_the_given_value() -> None:
    slip, amount = -a * G * sin(k * sp.atan(B * x2)), {a: sp.Rational(4, 5), G: slope, B: sp.Integer(10)}
    near = {x1: sp.Integer(20), x2: sp.Rational(1, 10), **amount}
    usual = invert_map([x1, slip], (x1, x2), (z1, z2), near={**near, k: sp.Rational(3, 2)})
    beyond = invert_map([x1, slip], (x1, x2), (z1, z2), near={**near, k: sp.Rational(5, 2)})
    assert usual.expressions is not None
    assert beyond.expressions is not None
    assert usual.expressions != beyond.expressions
    assert beyond.verdict.holds
    assert k in beyond.verdict.evidence["parameters"]


def test_roots_of_squares_are_taken_on_the_side_of_the_base_point() -> None:
    forward = [x1, a * (sqrt(x2) - sqrt(x1)), a**2 * (sqrt(x3) / sqrt(x2) - 1)]
    found = inverted(forward, [one, one, one])
    assert found.expressions is not None
    assert not any(e.has(sp.Abs, sp.sign) for e in found.expressions)
    assert same(found.expressions[1], (sqrt(z1) + z2 / a) ** 2)


@pytest.mark.parametrize(("power", "sides"), [(3, 2), (2, 1)])
def test_an_inverse_through_a_flat_point_is_real_on_every_side_where_it_can_be(power: int, sides: int) -> None:
    found = inverted([x1, x2**power], [zero, zero])
    assert found.expressions is not None
    back = [found.expressions[1].subs(z2, t**power) for t in (sp.Rational(1, 8), -sp.Rational(1, 8))]
    assert [t == b for t, b in zip((sp.Rational(1, 8), -sp.Rational(1, 8)), back, strict=True)] == [True, sides == 2]


@pytest.mark.parametrize(("first", "second"), [(sp.Integer(0), sp.pi / 2), (sp.Integer(2), sp.Rational(-1, 2))])
def test_the_angles_of_two_links_follow_from_the_place_of_their_end(first: sp.Expr, second: sp.Expr) -> None:
    a, b, k, m, y1, y2 = sp.symbols("a b k m y1 y2", real=True)
    place = [k * sp.cos(a) + m * sp.cos(a + b), k * sp.sin(a) + m * sp.sin(a + b)]
    found = invert_map(place, (a, b), (y1, y2), near={a: first, b: second}, seconds=8)
    assert found.expressions is not None
    angles = {a: first + sp.Rational(1, 50), b: second - sp.Rational(1, 40), k: sp.Integer(2), m: sp.Rational(3, 2)}
    seen = {y: e.subs(angles) for y, e in zip((y1, y2), place, strict=True)} | {k: angles[k], m: angles[m]}
    for angle, expression in zip((a, b), found.expressions, strict=True):
        assert abs(sp.N(expression.subs(seen) - angles[angle], 30)) < 1e-25


def test_blocks_of_linear_equations_are_solved_one_after_the_other() -> None:
    q, r, s, t, z1, z2, z3, z4, z5 = sp.symbols("q r s t z1 z2 z3 z4 z5", real=True)
    p = sp.Symbol("p", real=True)
    mass = 3 - sp.cos(p) ** 2
    forward = [p, (2 * q - sp.cos(p) * r) / mass, (r - sp.cos(p) * q) / mass, s + q * t, t - r * s + q**2]
    found = invert_map(
        forward, (p, q, r, s, t), (z1, z2, z3, z4, z5), near=dict.fromkeys((p, q, r, s, t), sp.Integer(0))
    )
    assert found.expressions is not None
    back = dict(zip((z1, z2, z3, z4, z5), forward, strict=True))
    at = {p: sp.Rational(1, 7), q: sp.Rational(1, 5), r: sp.Rational(-1, 9), s: sp.Rational(1, 3), t: sp.Rational(2, 7)}
    for x, expression in zip((p, q, r, s, t), found.expressions, strict=True):
        assert abs(sp.N(expression.subs(back).subs(at) - at[x], 30)) < 1e-25
