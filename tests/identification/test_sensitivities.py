"""Slopes along a motion: against closed forms, the complex step and `simulate`."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import ulna
from ulna.identification import IdentificationError, sensitivities
from ulna.plants import model
from ulna.sim import Formula, Held, Interpolated, simulate
from ulna.symbolic.formulas import parse_formula
from ulna.system import System, system_from_mapping

LAG: dict[str, Any] = {
    "name": "lag",
    "parameters": {"K": 2, "T": "1/2"},
    "states": {"x": {"equation": "(K*u - x)/T"}},
    "inputs": {"u": {}},
    "outputs": {"y": {"equation": "3*x + K*u"}},
}
PENDULUM: dict[str, Any] = {
    "name": "pendulum",
    "parameters": {"g": 9.8, "l": 0.7, "c": 0.3, "b": 2},
    "states": {"theta": {"equation": "omega"}, "omega": {"equation": "-g/l*sin(theta) - c*omega + b*u"}},
    "inputs": {"u": {}},
    "outputs": {"y": {"equation": "l*sin(theta)"}},
}
STEP = 1e-30


def _plant(data: dict[str, Any]) -> System:
    return system_from_mapping(data)


def test_slopes_of_a_lag_are_its_closed_form() -> None:
    times = np.linspace(0.0, 2.0, 41)
    found = sensitivities(_plant(LAG), [1.5], times, along=["K", "x", "T"], inputs={"u": 4.0})
    gain, constant, decay = 2.0, 0.5, np.exp(-times / 0.5)
    assert found.finished
    assert found.states[:, 0] == pytest.approx(8.0 - 6.5 * decay, abs=1e-10)
    slope_of_constant = -6.5 * decay * times / constant**2
    assert found.state_slopes[:, 0] == pytest.approx(np.stack([4 - 4 * decay, decay, slope_of_constant], 1), abs=1e-10)
    assert found.outputs[:, 0] == pytest.approx(3 * found.states[:, 0] + gain * 4.0)
    assert found.output_slopes[:, 0, 0] == pytest.approx(3 * (4 - 4 * decay) + 4.0, abs=1e-9)


def _pendulum(times: np.ndarray, u: Any, **moved: complex) -> Any:
    """(N, 2) states in complex arithmetic."""
    p = {"g": 9.8, "l": 0.7, "c": 0.3, "b": 2.0, "theta": 0.4, "omega": -1.0} | moved

    def rates(t: float, x: np.ndarray) -> list[complex]:
        return [x[1], -p["g"] / p["l"] * np.sin(x[0]) - p["c"] * x[1] + p["b"] * u(t)]

    rows, state = [[p["theta"], p["omega"]]], np.array([p["theta"], p["omega"]], dtype=complex)
    for begin, end in pairwise(times):
        done = solve_ivp(rates, (begin, end), state, method="DOP853", rtol=3e-14, atol=1e-14)
        state = done.y[:, -1]
        rows.append(state)
    return np.array(rows)


@pytest.mark.parametrize("kind", [Held, Interpolated])
def test_slopes_equal_the_complex_step_to_nine_digits(kind: type) -> None:
    times = np.linspace(0.0, 3.0, 31)
    samples = np.random.default_rng(3).uniform(-2, 2, 31)
    given = kind(times=times, values=samples)
    if kind is Held:
        drive = lambda t: samples[min(int(t * 10 + 1e-9), 30)]  # noqa: E731
    else:
        drive = lambda t: np.interp(t, times, samples)  # noqa: E731
    along = ["l", "omega", "c", "theta", "b"]
    found = sensitivities(_plant(PENDULUM), [0.4, -1.0], times, along=along, inputs={"u": given})
    base = {"l": 0.7, "omega": -1.0, "c": 0.3, "theta": 0.4, "b": 2.0}
    for k, name in enumerate(along):
        due = _pendulum(times, drive, **{name: base[name] + STEP * 1j}).imag / STEP
        assert found.state_slopes[:, :, k] == pytest.approx(due, abs=1e-9 * np.abs(due).max()), name


def test_states_of_very_unequal_sizes_have_slopes_as_exact() -> None:
    data = LAG | {"states": {"x": {"equation": "(K*u - x)/T"}, "z": {"equation": "(1e-9*x - z)/T"}}}
    times = np.linspace(0.0, 2.0, 21)
    found = sensitivities(_plant(data), {"x": 1.0}, times, along=["T"], inputs={"u": 1.0})
    s = times / 0.5
    z = 1e-9 * (2.0 - 2.0 * np.exp(-s) - s * np.exp(-s))
    slope = 1e-9 * (2.0 * np.exp(-s) - np.exp(-s) + s * np.exp(-s)) * -s / 0.5
    assert found.states[:, 1] == pytest.approx(z, rel=1e-10, abs=1e-20)
    assert found.state_slopes[:, 1, 0] == pytest.approx(slope, rel=1e-9, abs=1e-20)


def test_slopes_in_discrete_time_are_those_of_the_steps() -> None:
    data = {
        "name": "steps",
        "time": "discrete",
        "period": 0.1,
        "parameters": {"a": 0.9},
        "states": {"x": {"equation": "a*x + u"}},
        "inputs": {"u": {}},
        "outputs": {"x": {"equation": "x"}},
    }
    times = np.array([0.0, 0.1, 0.3, 0.5])
    found = sensitivities(_plant(data), [2.0], times, along=["a", "x"])
    assert found.states[:, 0] == pytest.approx(2.0 * 0.9 ** np.array([0, 1, 3, 5]))
    assert found.output_slopes[:, 0, 0] == pytest.approx(2.0 * np.array([0, 1, 3, 5]) * 0.9 ** np.array([-1, 0, 2, 4]))
    assert found.output_slopes[:, 0, 1] == pytest.approx(0.9 ** np.array([0, 1, 3, 5]))
    with pytest.raises(IdentificationError, match="multiples of its period"):
        sensitivities(_plant(data), [2.0], np.array([0.0, 0.12]), along=["a"])


def test_a_static_law_has_slopes_too() -> None:
    data = {"name": "law", "parameters": {"k": 3}, "inputs": {"u": {}}, "outputs": {"y": {"equation": "k*u^2"}}}
    times = np.array([0.0, 1.0, 2.0])
    found = sensitivities(_plant(data), [], times, along=["k"], inputs={"u": Held(times=times, values=times)})
    assert found.output_slopes[:, 0, 0] == pytest.approx(times**2)


def test_kinks_have_the_slope_of_the_side_they_are_on() -> None:
    drag = {"parameters": {"c": 0.5}, "states": {"v": {"equation": "u - c*v*abs(v)"}}, "inputs": {"u": {}}}
    plant = _plant({"name": "drag", **drag, "outputs": {"v": {"equation": "v"}}})
    times = np.linspace(0.0, 4.0, 4001)
    given = {"u": Held(times=np.array([0.0, 1.0, 2.5]), values=np.array([3.0, -4.0, 2.0]))}
    found = sensitivities(plant, [0.2], times, along=["c"], inputs=given)
    side = [simulate(plant, [0.2], times, inputs=given, parameters={"c": 0.5 + d})["v"] for d in (-1e-5, 1e-5)]
    assert found.state_slopes[:, 0, 0] == pytest.approx((side[1] - side[0]) / 2e-5, abs=1e-6)


def test_a_motion_that_ends_early_has_no_values_from_there_on() -> None:
    data = {"name": "escape", "parameters": {"a": 1}, "states": {"x": {"equation": "a*x^2"}}}
    plant = _plant(data | {"outputs": {"x": {"equation": "x"}}})
    found = sensitivities(plant, [1.0], np.linspace(0, 2, 21), along=["a"])
    assert not found.finished
    assert np.isfinite(found.states[:10]).all()
    assert np.isnan(found.states[11:]).all()


def test_what_cannot_be_asked_is_told() -> None:
    plant, times = _plant(PENDULUM), np.array([0.0, 1.0])
    with pytest.raises(IdentificationError, match="no parameter and no state"):
        sensitivities(plant, [0, 0], times, along=["k"])
    with pytest.raises(IdentificationError, match="no such input"):
        sensitivities(plant, [0, 0], times, along=["l"], inputs={"v": 1.0})
    formula = Formula(expression=parse_formula("sin(1)*l", {s.name: s for s in plant.parameter_symbols}))
    with pytest.raises(IdentificationError, match="formula of time"):
        sensitivities(plant, [0, 0], times, along=["l"], inputs={"u": formula})
    with pytest.raises(IdentificationError, match="3 values for 2 states"):
        sensitivities(plant, [0, 0, 0], times, along=["l"])
    bare = PENDULUM | {"parameters": PENDULUM["parameters"] | {"l": {}}}
    with pytest.raises(IdentificationError, match="without a value: l"):
        sensitivities(_plant(bare), [0, 0], times, along=["l"])
    with pytest.raises(IdentificationError, match="there is no 'k'"):
        sensitivities(plant, [0, 0], times, along=["l"], parameters={"k": 1.0})
    dry = {"name": "dry", "parameters": {"m": 1}, "states": {"v": {"equation": "-m*sign(v)"}}}
    with pytest.raises(IdentificationError, match="sqrt"):
        sensitivities(_plant(dry), [1.0], times, along=["m"])


def test_a_catalogue_plant_by_its_name_and_any_holder_of_a_system() -> None:
    plant = model("duffing")
    name = plant.parameters[0].name
    found = sensitivities(plant, [0.1] * len(plant.states), np.linspace(0, 1, 5), along=[name])
    assert found.finished


@pytest.mark.parametrize("start", [-1.0, 0.0])
def test_a_motion_without_a_first_step_is_nan_from_its_start(start) -> None:
    tank = system_from_mapping(
        {
            "format": 1,
            "name": "tank",
            "parameters": {"a": 1},
            "states": {"h": "-a*sqrt(h)"},
            "outputs": {"y": "h"},
        }
    )
    found = ulna.sensitivities(tank, [start], np.linspace(0, 3, 31), along=["a"]).outputs[:, 0]
    assert found[0] == start
    assert np.isnan(found[1:]).all()
