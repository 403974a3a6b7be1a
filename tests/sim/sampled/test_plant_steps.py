"""The plant's steps between samples: as many as its fastest rate needs, against exact holds; too few are told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ulna.base import SimulationError
from ulna.loop import Hardware, Loop, Pwm, Steps
from ulna.loop.pace import periods_of
from ulna.program import to_python
from ulna.sim import FixedSteps, Outcome, simulate
from ulna.system import System, system_from_mapping

PERIOD = 1e-3


def _law(**outputs: str) -> System:
    names = {name: {} for name in ("theta", "omega", "y", "r") if any(name in text for text in outputs.values())}
    given = system_from_mapping({"name": "law", "states": {"nothing": "0"}, "inputs": names, "outputs": outputs})
    return replace(given, states=(), rates=())


MOTOR = system_from_mapping(
    {
        "name": "coreless motor",
        "parameters": {"R": {"value": 1}, "L": {"value": "4e-4"}, "K": {"value": "0.02"}, "J": {"value": "1e-5"}},
        "states": {"theta": "omega", "omega": "(K*i - 1e-5*omega)/J", "i": "(u - R*i - K*omega)/L"},
        "inputs": {"u": {}},
        "outputs": {"y": "theta"},
    }
)
SERVO = Loop(plant=MOTOR, controller=_law(u="-2*theta - 0.05*omega"), hardware=Hardware(period=PERIOD))
START = [1.0, 0.0, 0.0]


def _held_exactly(inductance: float, samples: int) -> np.ndarray:
    """The loop's states by matrix exponentials."""
    field = np.zeros((4, 4))
    field[:3] = [
        [0.0, 1.0, 0.0, 0.0],
        [0.0, -1.0, 2000.0, 0.0],
        [0.0, -0.02 / inductance, -1.0 / inductance, 1.0 / inductance],
    ]
    step, path = expm(field * PERIOD), [np.array(START)]
    for _ in range(samples):
        theta, omega, _ = path[-1]
        path.append((step @ [*path[-1], -2.0 * theta - 0.05 * omega])[:3])
    return np.array(path)


@pytest.mark.parametrize("inductance", [4e-4, 3.6e-4, 3.5e-4, 7e-5, 1e-5])
def test_a_fast_winding_is_right(inductance: float) -> None:
    run = simulate(SERVO, START, 0.1, parameters={"L": inductance})
    exact = _held_exactly(inductance, 100)
    assert np.abs((run.states - exact) / np.abs(exact).max(axis=0)).max() < 1e-5


def test_a_winding_that_is_too_fast_is_refused_in_words() -> None:
    with pytest.raises(SimulationError, match=r"(?s)moved too fast.*sample faster") as caught:
        simulate(SERVO, START, 0.1, parameters={"L": 1e-7})
    assert getattr(caught.value.value, "outcome", None) is Outcome.COARSE


def test_too_few_steps_are_told_and_enough_are_not() -> None:
    for number, outcome in ((1, Outcome.COARSE), (5, Outcome.FINISHED), (64, Outcome.FINISHED)):
        run = simulate(SERVO, START, 0.1, engine=FixedSteps(number=number), throw=False)
        assert run.outcome is outcome
    # One step would blow up here, and it is not the design that does.
    run = simulate(SERVO, START, 0.1, parameters={"L": 3e-4}, engine=FixedSteps(number=1), throw=False)
    assert run.outcome is Outcome.COARSE


def test_each_of_many_runs_takes_its_own_number_and_has_the_same_bits_alone() -> None:
    values = np.array([1e-1, 4e-4, 1e-7, 3.5e-4, 1e-5] * 9)
    many = simulate(SERVO, START, 0.1, parameters={"L": values}, threads=2)
    for k in range(5):
        alone = simulate(SERVO, START, 0.1, parameters={"L": values[k]}, throw=False)
        assert many.outcome(k) is alone.outcome is (Outcome.COARSE if values[k] == 1e-7 else Outcome.FINISHED)
        if alone.outcome is Outcome.FINISHED:
            assert np.array_equal(many.final_state[k::5], np.tile(alone.final_state, (9, 1)))
    told = simulate(SERVO, START, 0.1, parameters={"L": values}, engine=FixedSteps(number=1), threads=2)
    assert np.array_equal(told.code == 0, values == 1e-1)


def test_where_nothing_is_fast_one_step_is_taken() -> None:
    def states(engine: FixedSteps | None) -> np.ndarray:
        return simulate(SERVO, START, 0.1, parameters={"L": 0.1}, engine=engine).states

    assert np.array_equal(states(None), states(FixedSteps(number=1)))
    assert not np.array_equal(states(FixedSteps(number=2)), states(FixedSteps(number=1)))


VALVE = system_from_mapping(
    {
        "name": "valve that gets fast where it opens",
        "states": {"theta": "omega", "omega": "-(50 + 4000*theta**2)*(omega - u)"},
        "inputs": {"u": {}},
        "outputs": {"y": "theta"},
    }
)
OPENING = Loop(plant=VALVE, controller=_law(u="3*(r - theta)"), hardware=Hardware(period=PERIOD))


def test_a_plant_that_gets_fast_along_the_run_is_right() -> None:
    run = simulate(OPENING, [0.0, 0.0], 1.0, inputs={"r": 1.2})
    state = np.zeros(2)
    for k in range(1000):
        if k % 250 == 0:
            assert run.states[k] == pytest.approx(state, abs=1e-6)
        u = 3.0 * (1.2 - state[0])

        def rates(_: float, x: Any, u: float = u) -> list[float]:
            return [x[1], -(50.0 + 4000.0 * x[0] ** 2) * (x[1] - u)]

        state = solve_ivp(rates, (0.0, PERIOD), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    assert run.states[-1] == pytest.approx(state, abs=1e-6)
    told = simulate(OPENING, [0.0, 0.0], 1.0, inputs={"r": 1.2}, engine=FixedSteps(number=1), throw=False)
    assert told.outcome is Outcome.COARSE


def test_a_plant_that_escapes_blew_up() -> None:
    plant = system_from_mapping(
        {"name": "escape", "states": {"y": "y**3 + u"}, "inputs": {"u": {}}, "outputs": {"out": "y"}}
    )
    loop = Loop(plant=plant, controller=_law(u="0*y"), hardware=Hardware(period=PERIOD))
    run = simulate(loop, [2.0], 1.0, throw=False)
    assert run.outcome is Outcome.BLEW_UP
    assert run.times[-1] == pytest.approx(0.125, abs=2 * PERIOD)


@pytest.mark.parametrize("number", [0, True, -3])
def test_a_number_of_steps_that_is_none_is_refused(number: Any) -> None:
    with pytest.raises(SimulationError, match="whole number"):
        FixedSteps(number=number)
    # What checks annotations in the tests stands in the way of 1.5.
    given = object.__new__(Steps)
    object.__setattr__(given, "number", 1.5)
    with pytest.raises(SimulationError, match="whole number"):
        given.__post_init__()


def _rate(matrix: np.ndarray) -> float:
    """Period · fastest rate, as the loop sees it."""
    rows = {f"x{i}": " + ".join(f"({float(a)!r})*x{j}" for j, a in enumerate(r)) for i, r in enumerate(matrix)}
    rows["x0"] += " + u"
    return _rate_of(rows, {})


def _rate_of(rows: dict[str, str], at: dict[str, float]) -> float:
    plant = system_from_mapping({"name": "p", "states": rows, "inputs": {"u": {}}, "outputs": {"y": "x0"}})
    flow = Loop(plant=plant, controller=_law(u="-y"), hardware=Hardware(period=PERIOD)).flow
    known = {**flow.numbers, **at}
    return periods_of(to_python(flow.pace)(*(known.get(name, 0.0) for name in flow.pace.inputs))[0]) / PERIOD


@pytest.mark.parametrize(
    ("text", "x0", "rate"),
    [
        ("-abs(3000*x0)", 0.5, 3000.0),
        ("-max(0, 3000*x0)", 0.5, 3000.0),
        ("-max(0, 3000*x0)", -0.5, 0.0),
        ("-min(0.1, 3000*x0)", -0.5, 3000.0),
        ("-sign(x0) - 2000*x0", 0.5, 2000.0),
        ("-50*tanh(x0/0.001)", 0.0, 50000.0),
        ("-1000*atan2(x0, 2)", 0.0, 500.0),
        ("-1000*asinh(x0)", 0.0, 1000.0),
    ],
)
def test_the_rate_is_seen_through_kinks_and_every_function(text: str, x0: float, rate: float) -> None:
    assert _rate_of({"x0": f"{text} + u"}, {"x0": x0}) == pytest.approx(rate, rel=1e-6)


def test_the_fastest_rate_is_that_of_the_largest_eigenvalue() -> None:
    random = np.random.default_rng(8)
    for n in (1, 2, 3, 5):
        for _ in range(4):
            matrix = random.normal(size=(n, n)) * 10.0 ** random.uniform(-1, 5)
            exact = np.abs(np.linalg.eigvals(matrix)).max()
            assert 0.5 * exact < _rate(matrix) < 2.0 * exact
    # Units change little, and two equal masses hide no vibration.
    units = np.diag([1.0, 1e-3, 1e3])
    matrix = units @ np.array([[-1.0, 3.0, 0.0], [2.0, -900.0, 5.0], [1.0, 0.0, -40.0]]) @ np.linalg.inv(units)
    assert 0.4 * 900 < _rate(matrix) < 2.5 * 900
    masses = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-1e6, 1e6, 0, 0], [1e6, -1e6, 0, 0]], dtype=float)
    assert 0.4 * np.sqrt(2e6) < _rate(masses) < 2.5 * np.sqrt(2e6)
    assert _rate(np.array([[0.0, 1e6], [0.0, 0.0]])) == 0.0


def test_stretches_of_constant_input_count_and_not_the_period() -> None:
    flow = SERVO.flow
    assert flow.stretch == 1.0
    late = Loop(plant=MOTOR, controller=SERVO.controller, hardware=Hardware(period=PERIOD, delay=0.25e-3)).flow
    assert late.stretch == pytest.approx(0.75)
    pulsed = Hardware(period=PERIOD, drive=Pwm(frequency=2e4, supply=24.0, switched=True))
    assert Loop(plant=MOTOR, controller=SERVO.controller, hardware=pulsed).flow.stretch == pytest.approx(0.05)
