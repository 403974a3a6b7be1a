"""Unknown loads: one controller for all of them, exact at rest, sampled or not, and what the grid must reject."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError
from ulna.design import (
    Poles,
    SetPoint,
    close_loop,
    compensator,
    controller_form,
    exact_observer,
    extended_state_observer,
    load_robust_compensator,
    loop_grid,
    observer_form,
    sampled_grid,
    state_feedback,
    with_disturbance,
)
from ulna.design.observers.observer import error_matrix
from ulna.plants import arm_with_drive, load_estimate, model, preset
from ulna.sim import metrics, simulate
from ulna.studies.prosthesis.load_robust_designs import load_robust_design, robust_grid
from ulna.system import System, system_from_mapping

NAMES = ["paper", "bench_servo", "transhumeral_elbow", "human_scale"]


def cart() -> System:
    """m x'' = −k sin x + u with unknown constants at hand."""
    return system_from_mapping(
        {
            "states": {"x": "v", "v": "(u - k*sin(x))/m"},
            "inputs": {"u": {}},
            "outputs": {"y": "x"},
            "parameters": {"m": {"value": 2}, "k": {"value": 3}},
        }
    )


def test_the_observer_of_a_plant_with_disturbance_has_exactly_the_poles_given() -> None:
    extended = with_disturbance(cart().with_values(), {"v": 1})
    matrix = error_matrix(extended_state_observer(extended, Poles(-3, -4, -5)))
    s = sp.Symbol("s")
    assert sp.factor(matrix.charpoly(s).as_expr()) == (s + 3) * (s + 4) * (s + 5)


def test_the_estimate_converges_to_a_disturbance_that_was_never_announced() -> None:
    design = load_robust_compensator(cart(), {"v": sp.Rational(1, 2)}, law=Poles(-3, -3), observer=Poles(-9, -9, -9))
    pushed = cart()
    force = sp.Rational(7, 5)
    pushed = replace(pushed, rates=(pushed.rates[0], pushed.rates[1] + force / sp.Symbol("m", real=True)))
    loop = close_loop(pushed, design.compensator).system
    run = simulate(loop, np.zeros(5), np.linspace(0, 6, 61), inputs={"y_ref": 0.7})
    assert run["x"][-1] == pytest.approx(0.7, abs=1e-6)
    assert run["disturbance_hat"][-1] == pytest.approx(1.4, abs=1e-5)


def test_without_mismatch_the_loop_has_the_poles_of_law_and_observer() -> None:
    design = load_robust_compensator(cart(), {"v": 1}, law=Poles(-3, -4), observer=Poles(-9, -10, -11))
    grid = loop_grid(close_loop(cart(), design.compensator).system, {"y_ref": [-1.0, 0.0, 1.0]})
    for row in grid.eigenvalues:
        assert np.sort(row.real) == pytest.approx([-11, -10, -9, -4, -3], abs=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_every_load_resistance_and_angle_is_stable_and_exact_at_rest(name: str) -> None:
    p = preset(name)
    design = load_robust_design(p)
    continuous = robust_grid(p, design, counts=(26, 7, 21))
    assert continuous.left_of(-5.0).holds
    assert np.degrees(np.abs(continuous.rest_of("theta") - continuous.points["y_ref"]).max()) < 1e-6
    sampled = robust_grid(p, design, counts=(26, 7, 21), period=1e-3)
    assert sampled.left_of(-5.0).holds
    assert design.verdict.holds


@pytest.mark.parametrize("name", NAMES)
def test_a_step_at_the_nominal_load_overshoots_less_than_5_percent(name: str) -> None:
    p = preset(name)
    design = load_robust_design(p)
    loop = close_loop(arm_with_drive(p), design.compensator).system
    rest = loop_grid(loop, {"y_ref": [0.0]}).rest[0]
    run = simulate(loop, rest, np.linspace(0, 2.5, 501), inputs={"y_ref": 0.6})
    figures = metrics(run, targets={"y": 0.6}).outputs["y"]
    assert figures.overshoot < 0.05
    assert np.degrees(abs(figures.steady_error)) < 0.2
    assert figures.settling_time < 1.0


def test_the_estimated_torque_gives_the_load_and_its_bounds_hold_the_truth() -> None:
    p = preset("transhumeral_elbow")
    design = load_robust_design(p)
    loop = close_loop(arm_with_drive(p), design.compensator).system
    for load, share in ((0.0, 0.8), (0.3, 1.0), (0.75, 1.2)):
        grid = loop_grid(
            loop, {"m2": [load], "Ra": [1.43 * share], "y_ref": [0.4]}, guess={"theta": 0.4, "theta_hat": 0.4}
        )
        estimate = load_estimate(p, float(grid.rest_of("load_torque_hat")[0]), 0.4)
        assert estimate.lower - 1e-9 <= load <= estimate.upper + 1e-9
        if share == 1.0:
            assert estimate.mass == pytest.approx(load, abs=1e-9)


def test_the_papers_compensator_loses_stability_below_about_3_4_kg_and_the_grid_says_where() -> None:
    arm = model("one_link_arm")
    design = arm.with_values()
    law = state_feedback(controller_form(design), Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    whole = compensator(law, exact_observer(observer_form(design), Poles(-9, -10, -11)))
    loads = np.linspace(2.0, 5.0, 301)
    grid = loop_grid(close_loop(arm, whole).system, {"m2": loads})
    border = loads[grid.abscissa < 0].min()
    assert border == pytest.approx(3.4, abs=0.06)
    verdict = grid.left_of(0.0)
    assert verdict.fails
    assert verdict.evidence["where"]["m2"] < border


def test_poles_too_fast_for_the_sampling_are_rejected_by_the_sampled_grid_alone() -> None:
    p = preset("paper")
    plant = arm_with_drive(p)
    design = load_robust_compensator(
        plant.with_parameters({"m2": sp.Rational(13, 9)}),
        {"omega": 1},
        law=Poles(-10, -10, -10),
        observer=Poles(*[-146] * 4),
    )
    over = {"m2": np.linspace(0, 5, 11), "Ra": [0.8, 1.0, 1.2], "y_ref": np.radians([-86, 0, 86])}
    guess = {"theta": "y_ref", "theta_hat": "y_ref"}
    assert loop_grid(close_loop(plant, design.compensator).system, over, guess=guess).left_of(-4.5).holds
    assert sampled_grid(plant, design.compensator, over, period=1e-3, guess=guess).left_of(0.0).fails


def test_a_loop_without_equilibrium_counts_as_the_worst() -> None:
    drifting = system_from_mapping({"states": {"x": "1 + x**2 + p"}, "parameters": {"p": {"value": 0}}})
    grid = loop_grid(drifting, {"p": [-2.0, 0.0]}, guess={"x": -1.2})
    assert grid.abscissa[0] == pytest.approx(-2.0)
    assert grid.abscissa[1] == np.inf
    assert grid.where == {"p": 0.0}


def test_wrong_names_are_refused() -> None:
    with pytest.raises(DesignError, match="no such state: w"):
        with_disturbance(cart(), {"w": 1})
    with pytest.raises(DesignError, match="enters no rate"):
        with_disturbance(cart(), {"v": 0})
    with pytest.raises(DesignError, match="no parameter or input q"):
        loop_grid(cart(), {"q": [1.0]})
    with pytest.raises(DesignError, match="2 given"):
        load_robust_compensator(cart(), {"v": 1}, law=Poles(-3, -3), observer=Poles(-9, -9), reference=SetPoint())
