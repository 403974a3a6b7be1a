"""Cascades: exact poles of the inner loop, exact outer plant, limits without windup."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError
from ulna.design import Poles, SetPoint, close_cascade, controller_form, inner_loop, loop_grid, state_feedback
from ulna.plants import arm_with_drive, preset
from ulna.sim import metrics, simulate
from ulna.system import connect, linearise, system_from_mapping

FAST = ("-3000+1000j", "-3000-1000j")


def test_the_inner_loop_has_exactly_its_two_poles_with_the_shaft_held() -> None:
    plant = arm_with_drive(preset("human_scale")).with_values()
    loop = inner_loop(plant, "i", Poles(*FAST))
    held = system_from_mapping(
        {"states": {"i": "-(0.316*i)/0.00008 + u/0.00008"}, "inputs": {"u": {}}, "outputs": {"i": "i"}}
    )
    whole = connect({"p": held, "c": loop.system}, {"c.i": "p.i", "p.u": "c.u"}, outputs=["p.i"], name="inner")
    s = sp.Symbol("s")
    polynomial = linearise(whole, {}).A.charpoly(s).as_expr()
    assert sp.expand(polynomial - (s**2 + 6000 * s + 10_000_000)) == 0


def test_the_outer_plant_is_the_arm_driven_by_its_current() -> None:
    plant = arm_with_drive(preset("bench_servo"))
    loop = inner_loop(plant, "i", Poles(*FAST))
    assert [s.name for s in loop.outer.inputs] == ["i_ref"]
    assert [s.name for s in loop.outer.states] == ["theta", "omega"]
    i, wanted = sp.Symbol("i", real=True), sp.Symbol("i_ref", real=True)
    assert sp.expand(loop.outer.rates[1] - plant.inline(plant.rates)[1].subs(i, wanted)) == 0


@pytest.mark.parametrize("cancel", [False, True])
def test_a_cascade_settles_where_the_outer_law_says(cancel: bool) -> None:
    plant = arm_with_drive(preset("human_scale"))
    loop = inner_loop(plant, "i", Poles(*FAST), cancel_coupling=cancel)
    law = state_feedback(controller_form(loop.outer.with_values()), Poles(-8, -8), reference=SetPoint())
    whole = close_cascade(loop, law)
    grid = loop_grid(whole, {"y_ref": [0.3]}, guess={"theta": 0.3})
    assert grid.rest_of("theta")[0] == pytest.approx(0.3, abs=1e-9)
    slowest = np.sort(grid.eigenvalues[0].real)[-2:]
    assert slowest == pytest.approx([-8, -8], rel=0.35 if not cancel else 0.1)


def test_limits_hold_and_the_integral_does_not_wind_up() -> None:
    plant = arm_with_drive(preset("human_scale"))
    limited = inner_loop(
        plant, "i", Poles(*FAST), cancel_coupling=True, reference_limit=sp.Integer(9), command_limit=sp.Integer(6)
    )
    law = state_feedback(controller_form(limited.outer.with_values()), Poles(-9, -9), reference=SetPoint())
    run = simulate(close_cascade(limited, law), [1.1, 0.0, 0.0, 0.0], np.linspace(0, 3, 1501))
    assert np.abs(run["i"]).max() <= 9.0 * 1.05
    assert np.abs(run["u"]).max() <= 6.0 + 1e-12
    assert np.abs(run["i_ref"]).max() > 12.0  # the outer law asked for more
    assert np.abs(run["u"]).max() > 5.99
    figures = metrics(run).outputs["y"]
    assert figures.overshoot < 0.15
    assert abs(figures.steady_error) < 1e-4


def test_states_that_the_input_does_not_drive_alone_are_refused() -> None:
    plant = arm_with_drive(preset("human_scale"))
    with pytest.raises(DesignError, match="input enters elsewhere"):
        inner_loop(plant, "omega", Poles(*FAST))
    with pytest.raises(DesignError, match="states are theta, omega, i"):
        inner_loop(plant, "current", Poles(*FAST))
    with pytest.raises(DesignError, match="positive"):
        inner_loop(plant, "i", Poles(*FAST), command_limit=sp.Integer(0))
