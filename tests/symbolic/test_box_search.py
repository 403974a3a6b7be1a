"""All zeros in a box: known zeros, what cannot be settled, and what must not be claimed."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from ulna.base import Status
from ulna.symbolic.solving import nowhere_zero, zeros_in_box

x, y, z = sp.symbols("x y z", real=True)


def found(equations, **box):
    zeros = zeros_in_box(equations, {sp.Symbol(name, real=True): sides for name, sides in box.items()})
    return [tuple(float(v) for v in value.values()) for value in zeros.values], zeros


@pytest.mark.parametrize(
    ("equations", "box", "expected"),
    [
        ([x**2 - 2], {"x": (-3, 3)}, [(-math.sqrt(2),), (math.sqrt(2),)]),
        ([sp.sin(x)], {"x": (-7, 7)}, [(k * math.pi,) for k in range(-2, 3)]),
        ([x**3 - x], {"x": (-1, 1)}, [(-1,), (0,), (1,)]),
        ([x**2 + 1], {"x": (-1000, 1000)}, []),
        ([x * (1 - y), y * (x - 1)], {"x": (-3, 3), "y": (-3, 3)}, [(0, 0), (1, 1)]),
        ([x**2 + y**2 - 1, x - y], {"x": (-2, 2), "y": (-2, 2)}, [(-(0.5**0.5),) * 2, (0.5**0.5,) * 2]),
        ([x * (1 - x * x) - y, y - z, 2 * z], dict.fromkeys("xyz", (-4, 4)), [(-1, 0, 0), (0, 0, 0), (1, 0, 0)]),
        ([sp.Min(1, sp.Max(-1, x)) - x / 2 + sp.Rational(1, 5)], {"x": (-30, 30)}, [(-1.6,), (-0.4,), (2.4,)]),
        ([sp.Abs(x) - 1], {"x": (-3, 3)}, [(-1,), (1,)]),
        ([sp.erf(x) - sp.Rational(1, 2)], {"x": (-1, 1)}, [(0.4769362762044699,)]),
    ],
)
def test_every_zero_is_found_and_the_list_is_proved_complete(equations, box, expected):
    values, zeros = found(equations, **box)
    assert [tuple(v) for v in values] == [pytest.approx(e, abs=1e-14) for e in expected]
    assert zeros.complete("all").status is Status.PROVED
    assert all(float(ball.rad()) < 1e-12 for point in zeros.points for ball in point)


@pytest.mark.parametrize(
    ("equation", "near"),
    [
        ((x - sp.Rational(1, 3)) ** 2, 1 / 3),
        (2 * sp.sign(x) - x, 0),
        (1 / x - 1, 0),
        (sp.floor(x) + sp.Rational(1, 2), None),
    ],
)
def test_double_zeros_jumps_and_poles_are_left_open_where_they_are(equation, near):
    values, zeros = found([equation], x=(-3, 3))
    if near is None:
        assert not values
        return
    assert zeros.complete("all").status is Status.UNDECIDED
    assert all(lower <= near <= upper for ((lower, upper),) in zeros.unresolved)
    assert all(abs(float(equation.subs(x, sp.Float(v[0], 30)))) < 1e-12 for v in values)


def test_a_function_without_enclosures_proves_nothing():
    values, zeros = found([sp.gamma(x) - 2], x=(1, 4))
    assert values == []
    assert zeros.complete("all").status is Status.UNDECIDED


def test_time_that_runs_out_leaves_boxes():
    zeros = zeros_in_box([sp.sin(x)], {x: (-1e6, 1e6)}, most=50)
    assert zeros.boxes == 50
    assert zeros.complete("all").status is Status.UNDECIDED


def test_factors_that_vanish_nowhere():
    assert nowhere_zero(sp.Integer(2), {})
    assert not nowhere_zero(sp.Integer(0), {})
    assert nowhere_zero(-1 - 5 * sp.exp(-3 / x), {})
    assert nowhere_zero(2 + sp.sin(x), {x: (-5, 5)})
    assert not nowhere_zero(1 + sp.sin(x), {x: (-5, 5)})
    assert not nowhere_zero(x, {y: (1, 2)})
