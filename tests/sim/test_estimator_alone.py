"""An estimator beside a plant that no law drives: continuous, on a processor, many at once, at the terminal."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from terminal import answered, refused

import ulna
from ulna import Hardware, Loop, simulate
from ulna.base import SimulationError
from ulna.campaign import Grid, Measures, Window, sweep
from ulna.loop import ExactHold, MeasurementNoise, RungeKutta4
from ulna.sim import TIME
from ulna.system import system_from_mapping

MASS = system_from_mapping(
    {"name": "mass", "states": {"s": "v", "v": "u"}, "inputs": {"u": {}}, "outputs": {"y": "s"}, "parameters": {}}
)
PENDULUM = system_from_mapping(
    {"name": "pendulum", "states": {"a": "w", "w": "-9*sin(a) - w/5"}, "outputs": {"y": "a"}}
)
START = {"s": 1.0, "v": -0.5, "s_hat": 0.2, "v_hat": 0.0}
PUSH = 0.7 * sp.sin(3 * TIME)


def estimators() -> dict:
    form = ulna.observer_form(MASS)
    return {
        "exact": ulna.exact_observer(form, ulna.Poles(-9, -10)),
        "injected": ulna.injected_observer(form, ulna.Poles(-9, -10)),
        "controller": ulna.controller_for(MASS, observer=[-9, -10]),
        "system": ulna.exact_observer(form, ulna.Poles(-9, -10)).system,
    }


def error_of_the_mass(time: float) -> np.ndarray:
    """e' = (A − L C) e, whatever the input: poles -9 and -10 give L = (19, 90)."""
    return expm(np.array([[-19.0, 1.0], [-90.0, 0.0]]) * time) @ np.array([0.8, -0.5])


@pytest.mark.parametrize("kind", ["exact", "controller", "system"])
def test_the_error_has_the_poles_of_the_observer_whatever_moves_the_plant(kind: str) -> None:
    run = simulate(Loop(plant=MASS, controller=estimators()[kind]), START, np.linspace(0, 1, 11), inputs={"u": PUSH})
    errors = np.array([run["s"] - run["s_hat"], run["v"] - run["v_hat"]]).T
    assert errors == pytest.approx(np.array([error_of_the_mass(t) for t in run.times]), abs=1e-12)
    assert abs(run["s"][-1] - 0.5) > 1e-2  # it is driven


@pytest.mark.parametrize("kind", ["injected", "controller"])
def test_on_a_processor_the_error_is_the_same_to_the_step(kind: str) -> None:
    rule = ExactHold() if kind == "injected" else RungeKutta4()
    hardware = Hardware(period=1e-3, discretisation=rule)
    loop = Loop(plant=MASS, controller=estimators()[kind], hardware=hardware)
    assert loop.required == ()
    run = simulate(loop, START, 1.0, inputs={"u": PUSH})
    for k in (0, 100, 500, 1000):
        found = (run["s"][k] - run["s_hat"][k], run["v"][k] - run["v_hat"][k])
        assert found == pytest.approx(error_of_the_mass(run.times[k]), abs=2e-6), k


def test_an_input_left_out_is_zero_for_plant_and_estimator_alike() -> None:
    loop = Loop(plant=MASS, controller=estimators()["exact"], hardware=Hardware(period=1e-2))
    run = simulate(loop, {"s": 1.0, "v": 0.0, "s_hat": 1.0, "v_hat": 0.0}, 1.0)
    assert run["v_hat"] == pytest.approx(0.0, abs=1e-15)


def filtered(time: float) -> tuple[float, float]:
    """Errors of the extended Kalman filter, by SciPy from the textbook's Riccati equation."""
    R, Q = 0.01, 0.3

    def rates(_, z):
        a, w, ah, wh, p, q, r = z
        F = np.array([[0.0, 1.0], [-9 * np.cos(ah), -0.2]])
        P = np.array([[p, q], [q, r]])
        dP = F @ P + P @ F.T - np.outer(P[:, 0], P[:, 0]) / R + np.diag([0.0, Q])
        gain = P[:, 0] / R * (a - ah)
        return [
            w,
            -9 * np.sin(a) - w / 5,
            wh + gain[0],
            -9 * np.sin(ah) - wh / 5 + gain[1],
            dP[0, 0],
            dP[0, 1],
            dP[1, 1],
        ]

    end = solve_ivp(rates, (0, time), [1.2, 0, -0.4, 0, 1, 0, 1], method="Radau", rtol=1e-11, atol=1e-13).y[:, -1]
    return end[0] - end[2], end[1] - end[3]


def test_a_filters_covariance_starts_at_its_initial_value_unless_it_is_named() -> None:
    kalman = ulna.extended_kalman_filter(PENDULUM, ulna.KalmanNoise(process=[0, 0.3], measurement=[0.01]))
    loop = Loop(plant=PENDULUM, controller=kalman)
    assert loop.initial == {"cov_a_a": 1.0, "cov_a_w": 0.0, "cov_w_w": 1.0}
    start = {"a": 1.2, "w": 0.0, "a_hat": -0.4}
    run = simulate(loop, start, 1.5)
    assert (run["a"][-1] - run["a_hat"][-1], run["w"][-1] - run["w_hat"][-1]) == pytest.approx(filtered(1.5), abs=1e-9)
    named = simulate(loop, start | {"cov_a_a": 5.0}, 1.5)
    assert abs(named["a_hat"][-1] - run["a_hat"][-1]) > 1e-6
    processor = simulate(Loop(plant=PENDULUM, controller=kalman, hardware=Hardware(period=1e-3)), start, 1.5)
    assert processor["a_hat"][-1] == pytest.approx(run["a_hat"][-1], abs=1e-4)
    assert simulate(loop, [1.2, 0.0], 1.5)["a_hat"][-1] == simulate(loop, {"a": 1.2, "w": 0.0}, 1.5)["a_hat"][-1]


def test_many_runs_of_a_noisy_estimator_are_those_of_single_ones() -> None:
    hardware = Hardware(period=1e-2, noise=MeasurementNoise(std=0.05))
    loop = Loop(plant=MASS, controller=estimators()["controller"], hardware=hardware)
    measures = Measures(windows=(Window(signal="s_hat", begin=0.5, end=1.0),))
    plan = Grid(axes={"s": [0.5, 1.0], "u": [0.0, 1.0]})
    result = sweep(loop, plan, measures, horizon=1.0, initial={"s_hat": 1.0})
    spread = result["most_s_hat"] - result["least_s_hat"]
    assert (spread > 0.02).all()
    assert ulna.campaign.replay(result, 3).identical


def test_what_neither_drives_nor_estimates_is_refused() -> None:
    stray = system_from_mapping({"states": {"q": "y - q"}, "inputs": {"y": {}}, "outputs": {"w": "q"}})
    with pytest.raises(SimulationError, match="none of the outputs w is an input of the plant, or the estimate"):
        Loop(plant=MASS, controller=stray)


FILE = """
name = "pendulum"
[states]
a = "w"
w = "-9*sin(a) - w/5"
[outputs]
y = "a"
"""


@pytest.fixture
def pendulum(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(FILE)
    return str(path)


def test_at_the_terminal_an_observer_runs_beside_the_plant(pendulum) -> None:
    start = ["--initial", "1.2,0", "--observer-initial", "a=-0.4", "--horizon", "1.5"]
    kalman = answered("simulate", pendulum, "--kalman", "0,0.3:0.01", *start)["signals"]
    errors = kalman["a"][-1] - kalman["a_hat"][-1], kalman["w"][-1] - kalman["w_hat"][-1]
    assert errors == pytest.approx(filtered(1.5), abs=1e-9)
    high = ["--observer-poles=-1,-2", "--high-gain", "0.1"]
    for more in (["--observer-poles=-9,-10", "--period", "1e-3"], high):
        found = answered("simulate", pendulum, *more, *start)["signals"]
        assert found["a_hat"][0] == pytest.approx(-0.4)
        assert abs(found["a"][-1] - found["a_hat"][-1]) < 1e-3


def test_estimates_that_nothing_makes_have_no_start(pendulum) -> None:
    assert "nothing in the loop estimates a" in refused("simulate", pendulum, "--observer-initial", "1,0")
    asked = ["--observer-poles=-9,-10", "--observer-initial"]
    assert "1 numbers, 2 states (a, w)" in refused("simulate", pendulum, *asked, "1")
    assert "there is no state 'b'" in refused("simulate", pendulum, *asked, "b=1")
