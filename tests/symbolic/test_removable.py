"""What reads 0/0 has a value where its limit is the same from all sides, and a series near by."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

import ulna
from ulna.symbolic.solving import limit_at, without_holes

x, v, V, a = sp.symbols("x v V a", real=True)
GATE = (V + a) / 10 / (1 - sp.exp(-(V + a) / 10))


@pytest.mark.parametrize(
    ("expression", "at", "limit"),
    [
        (sp.sin(x) / x, {x: 0}, 1),
        ((1 - sp.cos(x)) / x**2, {x: 0}, sp.Rational(1, 2)),
        (sp.diff(sp.sin(x) / x, x), {x: 0}, 0),
        (v * sp.sin(x) / x + x, {x: 0, v: 3}, 3),
        (GATE, {V: -40, a: 40}, 1),
        (x**2 + v, {x: 2, v: 1}, 5),
    ],
)
def test_a_removable_singularity_has_its_limit(expression, at, limit):
    assert limit_at(expression, {s: sp.Integer(n) for s, n in at.items()}) == limit


@pytest.mark.parametrize("expression", [1 / x, sp.sin(x) / x**2, sp.sin(x) / sp.Abs(x), sp.log(x)])
def test_a_pole_and_a_jump_have_none(expression):
    assert limit_at(expression, {x: sp.Integer(0)}).has(sp.nan, sp.zoo, sp.oo)
    assert without_holes(expression, [x], {}) == expression


@pytest.mark.parametrize(("expression", "symbol", "place"), [(-v * sp.sin(x) / x + v, x, 0), (GATE, V, -40)])
def test_near_a_hole_a_series_gives_the_same_to_rounding(expression, symbol, place):
    filled = without_holes(expression, [x, v, V], {a: sp.Integer(40)})
    (pair, _) = next(iter(filled.atoms(sp.Piecewise))).args
    edge = math.sqrt(float(pair.args[1].rhs))
    for part in (-1, -0.3, 0.7, 1):
        at = {v: sp.Rational(3, 7), a: 40, symbol: place + sp.Rational(str(0.999 * part * edge))}
        assert abs(sp.N(filled.subs(at) - expression.subs(at), 30)) < 1e-15
    hole = {v: sp.Integer(2), a: sp.Integer(40), symbol: sp.Integer(place)}
    assert filled.subs(hole) == limit_at(expression, hole)


def test_runs_start_in_holes_and_pass_through_them():
    plant = ulna.system_from_mapping(
        {"name": "plant", "states": {"x": "w", "w": "-x*cos(x)/2 - sin(x)/x*w + (1 - cos(x))/x**2 - 1/2"}}
    )
    assert ulna.equilibrium(plant)["x"] == 0
    assert ulna.linearise(plant).A == sp.Matrix([[0, 1], [-sp.Rational(1, 2), -1]])
    grid = np.linspace(0, 4, 41)
    whole = ulna.simulate(plant, [0, 1], grid)
    # From where it is at 2 s the rest of the way is the same; on the way it has passed x = 0 or not.
    rest = ulna.simulate(plant, [whole["x"][20], whole["w"][20]], grid[:21])
    assert np.abs(rest["x"] - whole["x"][20:]).max() < 1e-12
    assert whole.outcome.name == "FINISHED"
