"""Singular perturbation: exact quasi-steady states, its condition, the full law's limit for faster fast states."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError
from ulna.design import Law, Poles, close_loop, controller_form, reduced_order, state_feedback
from ulna.plants import arm_with_drive, preset
from ulna.sim import simulate
from ulna.system import System, system_from_mapping

REAL = ["bench_servo", "transhumeral_elbow", "human_scale"]
SLOW = ("-6+2j", "-6-2j")


def plant(inductance: sp.Expr | None = None) -> System:
    """The elbow, with another inductance in H."""
    arm = arm_with_drive(preset("transhumeral_elbow"))
    return arm if inductance is None else arm.with_parameters({"La": inductance})


def full_law(system: System) -> Law:
    """The third-order law that keeps the current's own pole, so that only the slow poles are chosen."""
    values = {p.name: p.si_value for p in system.parameters}
    current = -values["Ra"] / values["La"]  # type: ignore[operator]
    return state_feedback(controller_form(system.with_values()), Poles(*SLOW, current))


def reduced_law(system: System) -> Law:
    """The second-order law of the slow plant."""
    return state_feedback(controller_form(reduced_order(system, ["i"]).slow.with_values()), Poles(*SLOW))


@pytest.mark.parametrize("name", ["paper", *REAL])
def test_the_quasi_steady_state_makes_the_fast_rates_vanish_exactly(name: str) -> None:
    arm = arm_with_drive(preset(name))
    reduction = reduced_order(arm, ["i"])
    rates = dict(zip((s.name for s in arm.states), arm.inline(arm.rates), strict=True))
    assert sp.simplify(rates["i"].subs(sp.Symbol("i", real=True), reduction.manifold["i"])) == 0
    assert [s.name for s in reduction.slow.states] == ["theta", "omega"]
    assert not any(r.has(sp.Symbol("La", real=True)) for r in reduction.slow.rates)


def test_the_condition_is_met_by_real_motors_and_not_by_the_papers() -> None:
    for name in REAL:
        verdict = reduced_order(arm_with_drive(preset(name)), ["i"], period=1e-3).verdict
        assert verdict.holds
        assert verdict.evidence["period_over_time_constant"] >= 3
    paper = reduced_order(arm_with_drive(preset("paper")), ["i"], period=1e-3)
    assert paper.verdict.fails
    assert paper.time_constants == pytest.approx((0.1,))
    assert reduced_order(arm_with_drive(preset("bench_servo")), ["i"], period=1e-4).verdict.fails
    assert reduced_order(arm_with_drive(preset("paper")), ["i"]).verdict.fails  # no separation either


def test_without_values_the_condition_is_undecided() -> None:
    states = {"x": "-x + z", "z": "-z/e + u"}
    symbols = system_from_mapping(
        {"states": states, "inputs": {"u": {}}, "outputs": {"y": "x"}, "parameters": {"e": {}}}
    )
    reduction = reduced_order(symbols, ["z"])
    assert not reduction.verdict.holds
    assert not reduction.verdict.fails
    e, u, x = (sp.Symbol(n, real=True) for n in "eux")
    assert reduction.slow.rates[0] == e * u - x


def test_a_fast_state_that_does_not_settle_is_refused_by_the_verdict() -> None:
    unstable = system_from_mapping(
        {"states": {"x": "-x + z", "z": "1000*z + u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}}
    )
    verdict = reduced_order(unstable, ["z"], period=1.0).verdict
    assert verdict.fails
    assert "does not settle" in verdict.evidence["reason"]


def test_names_and_rates_that_determine_nothing_are_refused() -> None:
    integrator = system_from_mapping({"states": {"x": "z", "z": "u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    with pytest.raises(DesignError, match="do not determine"):
        reduced_order(integrator, ["z"])
    with pytest.raises(DesignError, match="no such state: w"):
        reduced_order(integrator, ["w"])
    with pytest.raises(DesignError, match="2 of 2"):
        reduced_order(integrator, ["x", "z"])


def test_a_nonlinear_fast_state_is_solved_for_exactly() -> None:
    curved = system_from_mapping(
        {"states": {"x": "-x + z", "z": "100*(log(1 + x**2) + u - exp(z))"}, "inputs": {"u": {}}, "outputs": {"y": "x"}}
    )
    reduction = reduced_order(curved, ["z"])
    residual = curved.rates[1].subs(sp.Symbol("z", real=True), reduction.manifold["z"])
    assert sp.simplify(residual) == 0


def test_the_full_law_tends_to_the_reduced_law_at_first_order_in_the_inductance() -> None:
    point = {"theta": sp.Rational(4, 10), "omega": sp.Rational(-7, 10)}
    differences = []
    for k in range(4):
        arm = plant(sp.Rational(1, 1000 * 2**k))
        at = {sp.Symbol(n, real=True): v for n, v in point.items()}
        slow = reduced_law(arm).expressions[0].subs(at)
        manifold = reduced_order(arm, ["i"]).manifold["i"].subs(arm.values)
        at[sp.Symbol("i", real=True)] = manifold.subs({**at, sp.Symbol("u", real=True): slow})
        differences.append(abs(float(full_law(arm).expressions[0].subs(at) - slow)))
    rates = np.log2(np.array(differences[:-1]) / differences[1:])
    assert rates == pytest.approx(1.0, abs=0.05)
    assert rates[-1] == pytest.approx(1.0, abs=0.01)


def test_on_the_full_plant_the_reduced_law_differs_from_the_ideal_at_first_order_in_the_inductance() -> None:
    times = np.linspace(0, 1.5, 151)
    ideal = simulate(close_loop(reduced_order(plant(), ["i"]).slow, reduced_law(plant())).system, [0.8, 0.0], times)
    errors = []
    for k in range(3):
        arm = plant(sp.Rational(1, 2000 * 2**k))
        run = simulate(close_loop(arm, reduced_law(arm)).system, [0.8, 0.0, 0.0], times)
        errors.append(float(np.abs(run["theta"] - ideal["theta"]).max()))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(1.0, abs=0.1)
    assert errors[-1] < 5e-3
