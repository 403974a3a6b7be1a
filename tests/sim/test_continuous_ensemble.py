"""Many runs of continuous loops at a time: ends and figures against closed forms, the same bits in any company."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm

from ulna.base import SimulationError
from ulna.loop import EndStop, Hardware, Loop, Saturation
from ulna.program import FlowSeries, to_python
from ulna.sim import Ends, Ensemble, Figures, Outcome, Settling, Taylor, simulate
from ulna.sim.continuous import ensemble as engine
from ulna.symbolic.compiling import kernel
from ulna.system import System, system_from_mapping

OSCILLATOR = system_from_mapping(
    {
        "name": "oscillator",
        "states": {"x": "v", "v": "u - w^2*x - 2*d*v"},
        "inputs": {"u": {}},
        "outputs": {"y": "x", "a": "u - w^2*x - 2*d*v"},
        "parameters": {"w": {"value": 5}, "d": {"value": 1}},
    }
)
RANDOM = np.random.default_rng(3)
W, D = RANDOM.uniform(3, 8, 300), RANDOM.uniform(0.2, 2, 300)


def oscillators(runs: slice = slice(None), **how: Any) -> Ensemble:
    parameters = {"w": W[runs], "d": D[runs]}
    given: dict[str, Any] = {"parameters": parameters, "threads": 1, "record": Figures(samples=1)} | how
    return simulate(OSCILLATOR, [1.0, 0.0], 12.0, **given)


def equal_bits(one: Ensemble, other: Ensemble, rows: slice = slice(None)) -> bool:
    arrays = [f.name for f in fields(Ensemble) if isinstance(getattr(one, f.name), np.ndarray)]
    return all(getattr(one, name)[rows].tobytes() == getattr(other, name).tobytes() for name in arrays)


def test_coefficients_of_a_flow_are_those_of_its_solution() -> None:
    x, y = sp.symbols("x y", real=True)
    field = kernel("f", (x, y), {"x'": y, "y'": -x, "energy": x**2 + y**2, "product": sp.exp(x)})
    series = FlowSeries(field, ("x", "y"), ("x'", "y'"))
    for _ in range(8):
        series.grow()
    found = dict(zip(series.kernel(7).outputs, to_python(series.kernel(7))(0.3, -0.4), strict=True))
    derivatives = [0.3, -0.4, -0.3, 0.4]
    for k in range(8):
        assert found[f"x:{k}"] == pytest.approx(derivatives[k % 4] / math.factorial(k), rel=1e-14)
        assert found[f"energy:{k}"] == pytest.approx(0.25 if k == 0 else 0.0, abs=1e-16)
    assert found["product:1"] == pytest.approx(math.exp(0.3) * -0.4, rel=1e-14)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-13])
def test_ends_are_those_of_the_matrix_exponential_to_the_tolerance(tolerance: float) -> None:
    for horizon in (0.3, 2.0, 12.0):
        many = simulate(
            OSCILLATOR,
            [1.0, 0.0],
            horizon,
            engine=Taylor(tolerance=tolerance),
            parameters={"w": W, "d": D},
            inputs={"u": D},
            record=Ends(),
        )
        for k in range(0, 300, 30):
            matrix = np.array([[0, 1, 0], [-(W[k] ** 2), -2 * D[k], D[k]], [0, 0, 0]])
            exact = expm(horizon * matrix) @ [1.0, 0.0, 1.0]
            np.testing.assert_allclose(many.final_state[k], exact[:2], rtol=0, atol=20 * tolerance)


def test_figures_are_those_of_the_closed_form() -> None:
    many = oscillators()
    damped = np.sqrt(W**2 - D**2)
    np.testing.assert_allclose(many.overshoot[:, 0], np.exp(-D * np.pi / damped), rtol=0, atol=1e-13)
    np.testing.assert_allclose(many.peak_error[:, 0], 1.0, rtol=0, atol=0)
    end = np.exp(-12 * D) * (np.cos(12 * damped) + D / damped * np.sin(12 * damped))
    np.testing.assert_allclose(many.steady_error[:, 0], end, rtol=0, atol=1e-12)
    # The acceleration starts at −w² and is never larger.
    np.testing.assert_allclose(many.peak_error[:, 1], W**2, rtol=1e-14)


def test_settling_is_the_last_entry_into_the_band() -> None:
    many = oscillators()
    for k in range(0, 300, 12):
        one = simulate(OSCILLATOR, [1.0, 0.0], 12.0, parameters={"w": W[k], "d": D[k]}, events=(Settling(output="y"),))
        expected = one.events[-1].time if one.events else math.inf
        assert many.settling_time[k, 0] == pytest.approx(expected, abs=1e-9)


def test_a_loose_tolerance_with_its_long_steps_misses_no_excursion() -> None:
    loose = oscillators(engine=Taylor(tolerance=1e-6))
    exact = oscillators(engine=Taylor(tolerance=1e-14))
    np.testing.assert_allclose(loose.overshoot[:, 0], exact.overshoot[:, 0], atol=1e-6)
    # An excursion that is barely one moves its ends by the root of the error.
    np.testing.assert_allclose(loose.settling_time[:, 0], exact.settling_time[:, 0], atol=1e-5)


def test_an_output_on_its_target_all_the_time_has_no_way_to_go() -> None:
    still = simulate(OSCILLATOR, [[0.0, 0.0]], 1.0, record=Figures(samples=1))
    assert np.isnan(still.settling_time).all()
    assert np.isnan(still.overshoot).all()
    assert (still.peak_error == 0.0).all()


def test_an_output_that_ends_outside_its_band_has_not_settled() -> None:
    drifting = system_from_mapping({"states": {"x": "1 + 0*x"}, "outputs": {"y": "x"}})
    there = simulate(drifting, [[-2.0], [-1.0]], 1.0, record=Figures(samples=1))
    assert there.settling_time[0, 0] == math.inf
    # x = t − 1 enters |x| ≤ 0.02 at 0.98.
    assert there.settling_time[1, 0] == pytest.approx(0.98, abs=1e-14)
    np.testing.assert_allclose(there.final_state[:, 0], [-1.0, 0.0], atol=1e-15)


@pytest.mark.parametrize(("chunk", "look", "crowd"), [(16, 1, 1.0), (32, 2, 0.5), (4096, 7, 0.0)])
def test_company_changes_no_bit(monkeypatch: pytest.MonkeyPatch, chunk: int, look: int, crowd: float) -> None:
    whole = oscillators()
    monkeypatch.setattr(engine, "CHUNK", chunk)
    monkeypatch.setattr(engine, "LOOK", look)
    monkeypatch.setattr(engine, "CROWD", crowd)
    assert equal_bits(whole, oscillators(threads=2))
    for rows in (slice(0, 1), slice(17, 20), slice(299, 300)):
        assert equal_bits(whole, oscillators(rows), rows)


def test_a_run_that_blows_up_or_stops_being_finite_is_one_result_among_others() -> None:
    wild = system_from_mapping({"states": {"x": "x^2 - sqrt(3 - x)*0"}, "outputs": {"y": "x"}})
    many = simulate(wild, [[-1.0], [2.0], [0.5]], 1.0, engine=Taylor(bound=2.5), record=Figures(samples=10))
    assert many.outcome(1) is Outcome.BLEW_UP
    # x = 1 / (1/2 − t).
    assert many.end_time[1] == pytest.approx(0.5 - 0.4, abs=1e-12)
    np.testing.assert_allclose(many.final_state[[0, 2], 0], [-0.5, 1.0], rtol=1e-12)
    draining = system_from_mapping({"states": {"x": "-sqrt(x) - 1"}, "outputs": {"y": "x"}})
    ended = simulate(draining, [[1.0], [900.0]], 1.0, record=Ends())
    assert ended.outcome(0) is Outcome.EDGE
    assert ended.outcome(1) is Outcome.FINISHED


def test_few_steps_are_one_result_too() -> None:
    short = simulate(OSCILLATOR, [[1.0, 0.0]], 12.0, engine=Taylor(maximum_steps=3), record=Ends())
    assert short.outcome(0) is Outcome.STEP_LIMIT


@pytest.mark.parametrize(
    "settings",
    [
        Hardware(saturation=Saturation(lower=-1.0, upper=1.0)),
        Hardware(end_stops=(EndStop(position="x", velocity="v", lower=-0.2, restitution=0.5),)),
    ],
)
def test_loops_with_limits_and_walls_have_the_ends_of_single_runs(settings: Hardware) -> None:
    force = np.array([0.5, 3.0, -3.0])
    loop = Loop(plant=OSCILLATOR, hardware=settings)
    many = simulate(loop, [1.0, 0.0], 5.0, inputs={"u": force}, record=Figures(samples=50))
    for k, value in enumerate(force):
        one = simulate(loop, [1.0, 0.0], np.linspace(0, 5, 51), inputs={"u": value})
        assert np.array_equal(many.final_state[k], one.final_state)


def test_a_plant_too_long_to_be_compiled_runs_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    from ulna.sim.continuous import lane_step

    other = System(**{f.name: getattr(OSCILLATOR, f.name) for f in fields(System)})
    quick = simulate(other, [[1.0, 0.0]], 2.0, engine=Taylor(bound=1e9), record=Ends())
    monkeypatch.setattr(lane_step, "LARGEST", 5)
    slow = simulate(other, [[1.0, 0.0]], 2.0, engine=Taylor(bound=1e10), record=Ends())
    np.testing.assert_allclose(slow.final_state, quick.final_state, atol=1e-12)


def test_a_staircase_is_refused_in_plain_words() -> None:
    stairs = system_from_mapping({"states": {"x": "-floor(x)"}, "outputs": {"y": "x"}})
    with pytest.raises(SimulationError, match="step function"):
        simulate(stairs, [[1.0]], 1.0)
