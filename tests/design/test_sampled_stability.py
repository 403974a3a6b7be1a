"""Sampled eigenvalues against closed forms and runs, and the advice given before simulating."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError
from ulna.design import (
    Law,
    Poles,
    SetPoint,
    compensator,
    controller_form,
    exact_observer,
    observer_form,
    reduced_order,
    sampled_grid,
    sampling_advice,
    state_feedback,
)
from ulna.loop import Hardware, Loop, RungeKutta4, Saturation
from ulna.plants import arm_with_drive, preset
from ulna.sim import FixedSteps, Trajectory, metrics, simulate
from ulna.system import System, system_from_mapping

REAL = ["bench_servo", "transhumeral_elbow", "human_scale"]
PAPER_POLES = ("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8)


def full(plant: System) -> Law:
    """The paper's third-order law with the paper's poles."""
    return state_feedback(controller_form(plant), Poles(*PAPER_POLES))


def reduced(plant: System) -> Law:
    """The second-order law of the plant with a fast current."""
    slow = reduced_order(plant, ["i"], period=1e-3).slow
    return state_feedback(controller_form(slow), Poles(-8, -8))


def run(name: str, law: Law, seconds: float) -> Trajectory:
    """From 1 rad to the horizontal at 1 kHz with one sample of delay and the preset's voltage."""
    volts = float(preset(name).limits.voltage or 0)
    chip = Hardware(period=1e-3, delay=1e-3, saturation=Saturation(lower=-volts, upper=volts))
    loop = Loop(plant=arm_with_drive(preset(name)), controller=law, hardware=chip)
    return simulate(loop, [1.0, 0.0, 0.0], np.linspace(0, seconds, 1001))


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_an_integrator_with_a_late_law_has_the_multipliers_of_the_closed_form(share: float) -> None:
    integrator = system_from_mapping({"states": {"x": "u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    law = state_feedback(controller_form(integrator), Poles(-4), reference=SetPoint())
    period, gain = 0.1, 4.0
    delay = share * period
    grid = sampled_grid(integrator, law, {"y_ref": [0.0]}, period=period, delay=delay)
    found = np.sort_complex(np.exp(grid.eigenvalues[0] * period))
    expected = np.sort_complex(np.roots([1.0, -(1 - gain * (period - delay)), gain * delay]).astype(complex))
    assert found == pytest.approx(expected, abs=1e-12)


def test_a_sampled_run_of_law_and_observer_decays_at_the_rate_of_the_largest_multiplier() -> None:
    plant = system_from_mapping({"states": {"x": "v", "v": "-x + u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    whole = compensator(
        state_feedback(controller_form(plant), Poles(-2, -3)),
        exact_observer(observer_form(plant), Poles(-7, -8)),
    )
    period = 0.05
    rule = RungeKutta4(substeps=20)
    grid = sampled_grid(plant, whole, {}, period=period, discretisation=rule)
    chip = Hardware(period=period, delay=period, discretisation=rule)
    loop = Loop(plant=plant, controller=whole, hardware=chip)
    # A linear loop: the next samples follow from the past ones by the characteristic polynomial of the multipliers.
    states = simulate(loop, [1.0, 0.5], np.arange(0, 3.01, period), engine=FixedSteps(number=40))["x"]
    polynomial = np.poly(np.exp(grid.eigenvalues[0] * period)).real
    order = len(polynomial) - 1
    predicted = [-polynomial[1:] @ states[k - order : k][::-1] for k in range(order + 2, len(states))]
    assert states[order + 2 :] == pytest.approx(np.array(predicted), abs=2e-7)


@pytest.mark.parametrize("name", REAL)
def test_the_full_law_is_advised_against_on_real_motors_at_1_khz_and_indeed_never_settles(name: str) -> None:
    plant = arm_with_drive(preset(name))
    verdict = sampling_advice(plant, full(plant), period=1e-3)
    assert verdict.fails
    assert verdict.evidence["shortest_time_constant_over_period"] < 0.3
    assert verdict.evidence["settling_time"] > 60
    assert 1 / verdict.evidence["decay_without_sampling"] == pytest.approx(0.5, rel=1e-6)
    trial = run(name, full(plant), 10.0)
    assert metrics(trial).outputs["y"].settling_time == np.inf
    assert sampling_advice(plant, full(plant), period=5e-6).holds  # 200 kHz would do


@pytest.mark.parametrize("name", REAL)
def test_the_reduced_law_is_advised_and_settles_as_said(name: str) -> None:
    plant = arm_with_drive(preset(name))
    verdict = sampling_advice(plant, reduced(plant), period=1e-3)
    assert verdict.holds
    settled = metrics(run(name, reduced(plant), 2.0)).outputs["y"].settling_time
    assert 0.5 < settled < 0.75
    assert verdict.evidence["settling_time"] == pytest.approx(settled, rel=0.35)


def test_the_papers_own_motor_is_slow_enough_for_the_full_law_at_1_khz() -> None:
    plant = arm_with_drive(preset("paper"))
    verdict = sampling_advice(plant, full(plant), period=1e-3, limits={"u": 10.0}, start={"theta": 1.0})
    assert verdict.holds
    start = {sp.Symbol("theta", real=True): 1, sp.Symbol("omega", real=True): 0, sp.Symbol("i", real=True): 0}
    expected = abs(float(full(plant).expressions[0].subs({**plant.values, **start}))) / 10
    assert verdict.evidence["command_over_limit_of_u"] == pytest.approx(expected)
    assert sampling_advice(plant, full(plant), period=0.2).fails


def test_a_delay_beyond_the_period_and_a_law_with_integrals_are_refused() -> None:
    plant = arm_with_drive(preset("paper"))
    with pytest.raises(DesignError, match="between 0 and the period"):
        sampling_advice(plant, full(plant), period=1e-3, delay=2e-3)
    integral = state_feedback(controller_form(plant.with_values()), Poles(-2, -3, -4, -5), integral=True)
    with pytest.raises(DesignError, match="integrators"):
        sampled_grid(plant, integral, {"m2": [5.0]}, period=1e-3)
