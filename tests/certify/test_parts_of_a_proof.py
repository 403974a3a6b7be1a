"""Parts of the prover by themselves: where it rests, what lies inside, what is limited."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from flint import arb

from ulna.certify import Region, prove
from ulna.certify.region.balls import slopes_of
from ulna.certify.region.box import comes_back, inside
from ulna.certify.region.domain import Domain
from ulna.certify.region.form import form_of, in_states
from ulna.certify.region.limited import limited_loop
from ulna.certify.region.rest import rest
from ulna.loop import Hardware, Loop, Saturation
from ulna.system import system_from_mapping


def _alone(rate: str) -> Loop:
    """A plant of one state, by itself."""
    return Loop(plant=system_from_mapping({"name": "alone", "states": {"x": rate}, "outputs": {"y": "x"}}))


@pytest.mark.parametrize("rate", ["-x**2", "-1 - x**2", "exp(-x)"])
def test_a_double_root_or_none_is_no_equilibrium_that_stands_alone(rate: str) -> None:
    found = prove(_alone(rate), Region())
    assert found.evidence["reason"] == "no isolated equilibrium is found near the operating point"


def test_an_equilibrium_is_enclosed() -> None:
    limited = limited_loop(_alone("2 - x**2"), {})
    found = rest(slopes_of(form_of(_alone("2 - x**2"), limited)), np.array([1.0]))
    assert found is not None
    (ball,) = found.balls
    assert (ball * ball).contains(2)
    assert float(ball.rad()) < 1e-6


@pytest.mark.parametrize(("side", "lies"), [("0.49", True), ("0.51", False)])
def test_a_box_lies_inside_a_level_or_not(side: str, lies: bool) -> None:
    """V = x² ≤ 1/4."""
    form = in_states(limited_loop(_alone("-x"), {}))
    found = rest(slopes_of(form), np.zeros(1))
    assert found is not None
    assert comes_back(form)
    assert inside(form, found, sp.Matrix([[1]]), sp.Rational(1, 4), {"x": sp.Rational(side)}) is lies


def test_the_way_back_counts_even_where_no_rate_reads_it() -> None:
    z = sp.Symbol("z", real=True)
    form = replace(in_states(limited_loop(_alone("-1"), {})), symbols=(z,), inverse=(sp.asin(z),))
    assert Domain(form).holds([arb(0, 0.5)])
    assert not Domain(form).holds([arb(0, 2)])


def test_an_equilibrium_beyond_a_limit_is_none() -> None:
    """x' = u − 2 with u = 2 − x: holding takes 2."""
    plant = system_from_mapping({"name": "p", "states": {"x": "u - 2"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    law = system_from_mapping({"name": "l", "states": {"i": "-i"}, "inputs": {"x": {}}, "outputs": {"u": "2 - x"}})
    for limit, there in ((3.0, True), (1.0, False)):
        hardware = Hardware(saturation=Saturation(lower=-limit, upper=limit))
        limited = limited_loop(Loop(plant=plant, controller=law, hardware=hardware), {})
        assert (rest(slopes_of(in_states(limited)), np.zeros(2)) is not None) is there


def test_limits_go_by_name_whatever_their_order() -> None:
    plant = system_from_mapping(
        {"name": "two", "states": {"p": "u1", "q": "u2"}, "inputs": {"u1": {}, "u2": {}}, "outputs": {"y": "p"}}
    )
    law = system_from_mapping(
        {
            "name": "law",
            "states": {"idle": "-idle"},
            "inputs": {"p": {}, "q": {}},
            "outputs": {"u1": "-p", "u2": "-q"},
        }
    )
    limits = {"u2": Saturation(lower=-5.0, upper=6.0), "u1": Saturation(lower=-0.5, upper=np.inf)}
    limited = limited_loop(Loop(plant=plant, controller=law, hardware=Hardware(saturation=limits)), {})
    found = {s.name: (low, high) for s, low, high in zip(limited.limited, limited.lower, limited.upper, strict=True)}
    assert found == {"u1": (sp.Rational(-1, 2), sp.Integer(10) ** 300), "u2": (-5, 6)}
