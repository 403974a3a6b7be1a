"""Systems in discrete time: alone, as controllers, as plants; against SciPy, python-control, loops written by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp
from compilers import GCC
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import dlsim

import ulna
from ulna.base import PlantError, SimulationError
from ulna.deploy import c_project, compare
from ulna.loop import Hardware, Loop, Quantiser, Saturation
from ulna.program import Plain
from ulna.sim import FixedSteps, Paths
from ulna.system import System, connect, read_system, system_from_mapping, write_system

CALM = settings(max_examples=25)
PID = {
    "name": "PID as firmware has it",
    "time": "discrete",
    "period": "0.01",
    "parameters": {"kp": 2, "ki": 3, "kd": "0.1", "N": 20, "T": "0.01", "top": "1.2"},
    "definitions": {
        "e": "r - y",
        "d": "kd*N*(e - slow)",
        "raw": "kp*e + q + d",
        "new": "q + ki*T*e + (min(max(raw, -top), top) - raw)",
    },
    "states": {"q": "new", "slow": "slow + N*T*(e - slow)"},
    "inputs": {"y": {}, "r": {}},
    "outputs": {"u": "min(max(raw, -top), top)"},
}
LAG = {"states": {"x": "-x + u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}}


def linear(A: np.ndarray, B: np.ndarray, C: np.ndarray, period: str = "0.1") -> System:
    """x⁺ = A x + B u, y = C x."""
    n, m, p = len(A), B.shape[1], len(C)
    names = [*(f"x{k}" for k in range(n)), *(f"u{k}" for k in range(m))]
    rows = [" + ".join(f"({v!r})*{name}" for v, name in zip(row.tolist(), names)) for row in np.hstack([A, B])]  # noqa: B905
    shown = [" + ".join(f"({v!r})*{name}" for v, name in zip(row.tolist(), names)) for row in C]  # noqa: B905
    return system_from_mapping(
        {
            "time": "discrete",
            "period": period,
            "states": {f"x{k}": rows[k] for k in range(n)},
            "inputs": {f"u{k}": {} for k in range(m)},
            "outputs": {f"y{k}": shown[k] for k in range(p)},
        }
    )


def drawn(seed: int, n: int = 3, m: int = 2, p: int = 2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    A = random.uniform(-1, 1, (n, n))
    A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    return A, random.uniform(-1, 1, (n, m)), random.uniform(-1, 1, (p, n))


@CALM
@given(st.integers(0, 10_000))
def test_steps_are_those_of_scipy(seed: int) -> None:
    A, B, C = drawn(seed)
    u = np.random.default_rng(seed + 1).normal(size=(41, 2))
    times = np.arange(41) * 0.1
    _, y, _ = dlsim((A, B, C, np.zeros((2, 2)), 0.1), u, x0=[1, -1, 0.5])
    held = {f"u{k}": ulna.Held(times=times, values=u[:, k]) for k in range(2)}
    run = ulna.simulate(linear(A, B, C), (1, -1, 0.5), 4.0, inputs=held)
    assert run.outputs == pytest.approx(y, abs=1e-12)
    assert run.times == pytest.approx(times)
    some = ulna.simulate(linear(A, B, C), (1, -1, 0.5), times[::8], inputs=held)
    assert some.outputs == pytest.approx(y[::8], abs=1e-12)


@CALM
@given(st.integers(0, 10_000))
def test_rest_points_slopes_and_stability_are_those_by_hand(seed: int) -> None:
    A, B, C = drawn(seed)
    A *= 1.2 if seed % 2 else 1.0
    plant = linear(A, B, C)
    rest = ulna.equilibrium(plant, inputs={"u0": 1, "u1": -2})
    by_hand = np.linalg.solve(np.eye(3) - A, B @ [1, -2])
    assert list(rest.numbers.values()) == pytest.approx(by_hand.tolist(), rel=1e-9)
    found = ulna.linearise(plant)
    assert np.array(found.A, dtype=float) == pytest.approx(A)
    sizes = np.abs(found.eigenvalues)
    assert sizes == pytest.approx(sorted(np.abs(np.linalg.eigvals(A)), reverse=True))
    assert found.stable is bool(sizes.max() < 1)
    assert found.period == sp.Rational(1, 10)


def test_rest_points_of_a_logistic_map_and_their_stability() -> None:
    """x⁺ = a x (1 − x) rests at 0 and 1 − 1/a, where its slope is 2 − a."""
    for a, stable in ((sp.Rational(5, 2), True), (sp.Rational(7, 2), False)):
        data = {"time": "discrete", "period": 1, "parameters": {"a": str(a)}, "states": {"x": "a*x*(1 - x)"}}
        plant = system_from_mapping(data)
        found = ulna.equilibria(plant, {"x": (-1, 2)})
        assert [float(each["x"]) for each in found] == pytest.approx([0, float(1 - 1 / a)])
        assert [ulna.linearise(each).stable for each in found] == [False, stable]
        assert ulna.equilibrium(plant, near={"x": 1})["x"] == pytest.approx(float(1 - 1 / a))


def test_many_runs_are_the_single_ones_and_ends_are_told() -> None:
    plant = system_from_mapping(
        {
            "time": "discrete",
            "period": "0.5",
            "parameters": {"a": "0.5"},
            "states": {"x": "a*x + u"},
            "inputs": {"u": {}},
            "outputs": {"y": "x"},
        }
    )
    a, u = np.array([0.5, -0.3, 3.0, 0.9]), np.array([1.0, 2.0, 1.0, 0.0])
    many = ulna.simulate(
        plant, (1.0,), 30.0, inputs={"u": u}, parameters={"a": a}, targets={"y": u / (1 - a)}, record=Paths("y")
    )
    assert [str(many.outcome(k).name) for k in range(4)] == ["FINISHED", "FINISHED", "BLEW_UP", "FINISHED"]
    for k in range(4):
        one = ulna.simulate(plant, (1.0,), 30.0, inputs={"u": u[k]}, parameters={"a": a[k]}, throw=False)
        assert many["y"][k, : len(one.times)].tolist() == one["y"].tolist()
        assert many.end_time[k] == one.times[-1]
    assert many.steady_error[0, 0] == pytest.approx(0, abs=1e-12)
    with pytest.raises(SimulationError, match="norm of the state passed the bound"):
        ulna.simulate(plant, (1.0,), 30.0, inputs={"u": 1.0}, parameters={"a": 3.0})


def test_files_say_the_time_and_read_back(tmp_path: Any) -> None:
    pid = system_from_mapping(PID)
    assert pid.period == sp.Rational(1, 100)
    for ending in ("toml", "json"):
        write_system(pid, tmp_path / f"pid.{ending}")
        assert read_system(tmp_path / f"pid.{ending}") == pid
    assert "period 0.01 s" in repr(pid)
    assert "q+ = " in repr(pid)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"time": "sampled"}, 'Write "continuous" or "discrete"'),
        ({"time": "discrete"}, "without a period"),
        ({"period": "0.1"}, "a period in continuous time"),
        ({"time": "discrete", "period": 0}, "not a positive time"),
        ({"time": "discrete", "period": "-1"}, "not a positive time"),
    ],
)
def test_mistakes_about_the_time_are_named(changed: dict[str, Any], says: str) -> None:
    with pytest.raises(PlantError, match=says):
        system_from_mapping({**LAG, **changed})


def test_a_difference_equation_has_the_unit_of_its_state() -> None:
    data: dict[str, Any] = {"time": "discrete", "period": "0.1", "parameters": {"T": {"value": "0.1", "unit": "s"}}}
    data |= {"states": {"x": {"unit": "m", "equation": "x + T*v"}}, "inputs": {"v": {"unit": "m/s"}}}
    assert system_from_mapping(data).states[0].unit == "m"
    with pytest.raises(ulna.UnitError, match="expected m"):
        system_from_mapping({**data, "states": {"x": {"unit": "m", "equation": "v"}}})


def by_hand(plant: Any, count: int, measured: Any = float) -> tuple[np.ndarray, np.ndarray]:
    """x' = a x + b u by its exact solution under the PID, written as firmware is."""
    a, b, x0 = plant
    kp, ki, kd, N, T, top = 2.0, 3.0, 0.1, 20.0, 0.01, 1.2
    x, q, slow, xs, us = x0, 0.0, 0.0, [], []
    for _ in range(count + 1):
        e = 1.0 - measured(x)
        raw = kp * e + q + kd * N * (e - slow)
        u = min(max(raw, -top), top)
        q, slow = q + ki * T * e + (u - raw), slow + N * T * (e - slow)
        xs.append(x)
        us.append(u)
        x = math.exp(a * T) * x + math.expm1(a * T) / a * b * u
    return np.array(xs), np.array(us)


@CALM
@given(st.floats(-2, -0.2), st.floats(0.3, 2), st.floats(-1, 1))
def test_firmware_on_a_continuous_plant_is_the_loop_written_by_hand(a: float, b: float, x0: float) -> None:
    data = {**LAG, "parameters": {"a": a, "b": b}, "states": {"x": "a*x + b*u"}}
    loop = Loop(plant=system_from_mapping(data), controller=system_from_mapping(PID))
    assert loop.sampled
    assert loop.hardware is not None
    assert loop.hardware.period == 0.01
    run = ulna.simulate(loop, (x0,), 4.0, inputs={"r": 1.0})
    x, u = by_hand((a, b, x0), 400)
    assert run["x"] == pytest.approx(x, abs=1e-9)
    assert run["u"] == pytest.approx(u, abs=1e-9)


def test_hardware_without_a_period_takes_that_of_the_controller() -> None:
    sensors = Quantiser(step=0.05)
    loop = Loop(plant=system_from_mapping(LAG), controller=system_from_mapping(PID), hardware=Hardware(sensors=sensors))
    run = ulna.simulate(loop, (0.0,), 2.0, inputs={"r": 1.0}, engine=FixedSteps(number=4))
    x, u = by_hand((-1.0, 1.0, 0.0), 200, lambda v: 0.05 * math.floor(v / 0.05 + 0.5))
    assert run["x"] == pytest.approx(x, abs=1e-9)
    assert run["u"] == pytest.approx(u, abs=1e-9)


def test_a_discrete_plant_with_a_discrete_controller_is_python_controls() -> None:
    control = pytest.importorskip("control")
    A, B, C = drawn(7, m=1, p=1)
    plant = linear(A, B, C, "0.01")
    law = system_from_mapping(
        {
            "time": "discrete",
            "period": "0.01",
            "states": {"q": "q + 0.1*(r - y0)"},
            "inputs": {"y0": {}, "r": {}},
            "outputs": {"u0": "0.2*(r - y0) + 0.3*q"},
        }
    )
    steps = np.arange(200) * 0.01
    both = control.interconnect(
        [
            control.ss(A, B, C, 0, 0.01, name="plant", inputs="u", outputs="y"),
            control.ss(1, 0.1, 0.3, 0.2, 0.01, name="law", inputs="e", outputs="u"),
            control.summing_junction(["r", "-y"], "e"),
        ],
        inputs="r",
        outputs="y",
        dt=0.01,
    )
    expected = control.forced_response(both, steps, np.ones(200)).outputs
    loop = Loop(plant=plant, controller=law)
    assert not loop.sampled
    assert loop.system.period == plant.period
    assert sorted(map(abs, ulna.linearise(loop.system).eigenvalues)) == pytest.approx(sorted(abs(both.poles())))
    alone = ulna.simulate(loop, (0, 0, 0), 1.99, inputs={"r": 1.0})
    assert alone["y0"] == pytest.approx(np.ravel(expected), abs=1e-12)
    processor = ulna.simulate(
        Loop(plant=plant, controller=law, hardware=Hardware()), (0, 0, 0), 1.99, inputs={"r": 1.0}
    )
    assert processor["y0"] == pytest.approx(alone["y0"], abs=1e-12)
    assert processor["u0"] == pytest.approx(alone["u0"], abs=1e-12)


def test_limits_and_whole_delays_of_a_discrete_plant() -> None:
    """x⁺ = x + u with u = −x, limited to ±1 and one period late."""
    plant = system_from_mapping({"time": "discrete", "period": 2, "states": {"x": "x + u"}, "inputs": {"u": {}}})
    law = system_from_mapping({"inputs": {"x": {}}, "outputs": {"u": "-x"}})
    hardware = Hardware(saturation=Saturation(lower=-1, upper=1), delay=2.0)
    run = ulna.simulate(Loop(plant=plant, controller=law, hardware=hardware), (3.0,), 12.0)
    assert run["x"].tolist() == [3, 3, 2, 1, 0, -1, -1]


def test_python_control_gives_and_takes_periods() -> None:
    control = pytest.importorskip("control")
    given_ = control.tf([1], [1, -0.5], dt=0.1)
    ours = ulna.from_control(given_)
    assert ours.period == sp.Rational(1, 10)
    steps = np.arange(30) * 0.1
    step = control.step_response(given_, steps).outputs
    assert ulna.simulate(ours, (0.0,), 2.9, inputs={ours.inputs[0].name: 1.0}).outputs[:, 0] == pytest.approx(step)
    back = ulna.to_control(ours)
    assert back.dt == 0.1
    again = control.input_output_response(back, steps, np.ones(30))
    assert np.ravel(again.outputs) == pytest.approx(step)
    A, B, C = drawn(3)
    ours = ulna.from_control(control.ss(A, B, C, 0, 0.25))
    assert (ours.period, len(ours.states)) == (sp.Rational(1, 4), 3)
    assert ulna.to_control(system_from_mapping(LAG)).dt == 0


def motor_loop(band: float) -> Loop:
    """A geared motor with dry friction behind a Hall sensor, and a cascade whose band empties the integral."""
    motor = system_from_mapping(
        {
            "states": {"th": "om", "om": "(0.03*(u - 0.03*om)/1.5 - 1e-5*om - 0.012*tanh(om/0.05))/2e-5"},
            "inputs": {"u": {}},
            "outputs": {"y": "th"},
        }
    )
    cascade = system_from_mapping(
        {
            "time": "discrete",
            "period": "1e-3",
            "parameters": {"band": band, "T": "1e-3"},
            "definitions": {
                "speed": "(y - yf)/0.005",
                "e": "20*(r - y) - speed",
                "new": "Piecewise((0, abs(r - y) < band), (q + T*e, True))",
            },
            "states": {"yf": "yf + T*speed", "q": "new"},
            "inputs": {"y": {}, "r": {}},
            "outputs": {"u": "0.02*e + 0.1*new"},
        }
    )
    hardware = Hardware(
        sensors=Quantiser(step=2 * math.pi / 24), saturation=Saturation(lower=-3, upper=3), arithmetic=Plain()
    )
    return Loop(plant=motor, controller=cascade, hardware=hardware)


def test_a_band_that_empties_the_integral_ends_the_hunting() -> None:
    hunting, calm = (
        np.ptp(ulna.simulate(motor_loop(band), (0, 0), 3.0, inputs={"r": 62.8318})["th"][-500:]) for band in (0.0, 0.13)
    )
    assert hunting > 0.03
    assert calm < 1e-4


@pytest.mark.skipif(GCC is None, reason="there is no gcc")
def test_firmware_in_c_is_the_simulation_bit_for_bit(tmp_path: Any) -> None:
    loop = motor_loop(0.13)
    c_project(loop, tmp_path / "c")
    assert compare(tmp_path / "c", loop, samples=3000, inputs={"r": 6.0}).equal


STEPPED = {**LAG, "time": "discrete", "period": "0.1"}
INTEGRAL = {"states": {"q": "r - y"}, "inputs": {"y": {}, "r": {}}, "outputs": {"u": "q"}}


@pytest.mark.parametrize(
    ("plant", "controller", "hardware", "says"),
    [
        (LAG, PID, Hardware(period=0.02), "periods differ.*0.01 s.*0.02 s"),
        (STEPPED, PID, None, "periods differ"),
        (STEPPED, INTEGRAL, None, "is in continuous time"),
        ({**STEPPED, "period": "0.01"}, PID, Hardware(delay=0.015), "acts between two of them"),
    ],
)
def test_loops_whose_times_do_not_fit_are_refused(
    plant: dict[str, Any], controller: dict[str, Any], hardware: Hardware | None, says: str
) -> None:
    with pytest.raises(SimulationError, match=says):
        Loop(plant=system_from_mapping(plant), controller=system_from_mapping(controller), hardware=hardware)


def test_runs_whose_times_do_not_fit_are_refused() -> None:
    plant = system_from_mapping(STEPPED)
    with pytest.raises(SimulationError, match="not a multiple of its period"):
        ulna.simulate(plant, (0.0,), (0, 0.15, 0.3))
    with pytest.raises(SimulationError, match=r"moves in steps of 0\.1 s"):
        ulna.simulate(plant, (0.0,), 1.0, engine=ulna.Taylor())


def test_a_continuous_controller_of_a_discrete_plant_is_discretised_by_its_processor() -> None:
    """Euler's q⁺ = q + T (r − y) is the discrete controller written out."""
    plant = system_from_mapping({**LAG, "time": "discrete", "period": "0.1", "states": {"x": "0.5*x + u"}})
    law = {"inputs": {"y": {}, "r": {}}, "outputs": {"u": "0.1*(r - y) + q"}}
    smooth = system_from_mapping({**law, "states": {"q": "r - y"}})
    stepped = system_from_mapping({**law, "time": "discrete", "period": "0.1", "states": {"q": "q + 0.1*(r - y)"}})
    one = ulna.simulate(
        Loop(plant=plant, controller=smooth, hardware=Hardware(discretisation=ulna.Euler())),
        (0.0,),
        5.0,
        inputs={"r": 1.0},
    )
    other = ulna.simulate(Loop(plant=plant, controller=stepped), (0.0,), 5.0, inputs={"r": 1.0})
    assert one["y"] == pytest.approx(other["y"], abs=1e-12)


def test_parts_of_different_times_are_not_joined_and_vector_fields_are_refused() -> None:
    plant, law = system_from_mapping(LAG), system_from_mapping(PID)
    with pytest.raises(PlantError, match="time passes differently"):
        connect(
            {"plant": plant, "law": law}, {"law.y": "plant.y", "plant.u": "law.u"}, outputs=["plant.y"], name="both"
        )
    stepped = system_from_mapping({**LAG, "time": "discrete", "period": "0.1"})
    for question in (ulna.control_affine, ulna.controller_form, ulna.observability, ulna.zero_dynamics):
        with pytest.raises(PlantError, match=r"moves in steps of 0\.1 s and has none"):
            question(stepped)


def test_analysis_answers_what_there_is_in_discrete_time() -> None:
    """A stable chain whose second state nothing reaches."""
    A, B, C = np.array([[0.5, 1.0], [0.0, 0.25]]), np.array([[1.0], [0.0]]), np.array([[1.0, 0.0]])
    found = ulna.analyse(linear(A, B, C))
    assert found["equilibrium"].value is True
    assert found["stable"].value is True
    assert sorted(found["eigenvalues"].value, key=abs) == pytest.approx([0.25, 0.5])
    assert (found["reachability_rank"].value, found["observability_rank"].value) == (1, 2)
    assert ulna.analyse(linear(2.5 * A, B, C))["stable"].value is False
    edge = ulna.analyse(linear(2 * A, B, C))["stable"]
    assert edge.value is None
    assert "unit circle" in edge.verdict.evidence["reason"]
