"""The extended Kalman filter of a processor against one in NumPy, and where explicit steps of the other fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ulna
from ulna.base import SimulationError
from ulna.deploy import firmware
from ulna.loop import Euler, ExactHold, Hardware, Loop, MeasurementNoise, Parts, RungeKutta4
from ulna.program import Plain, Precision
from ulna.system import system_from_mapping

PERIOD = 1e-3
LEVITATION = ulna.model("magnetic_levitation").with_values()
LAW = ulna.state_feedback(ulna.controller_form(LEVITATION), ulna.Poles(-20, -25, -30))
TUNING = ulna.KalmanNoise(process=[0, "1e-2", "1e-1"], measurement=["1e-13"], covariance=["1e-8", "1e-6", "1e-4"])
START = {"x": 0.0102, "s": 0.0, "i": 1.0, "x_hat": 0.01, "s_hat": 0.0, "i_hat": 1.0, "u": 2.0}

Vector = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Independent:
    """An extended Kalman filter in matrices; every slope by complex steps, which are exact to rounding."""

    def __init__(self, f: Vector, h: Callable[[np.ndarray], np.ndarray], noise: tuple[Any, Any, Any], x: Any) -> None:
        self.f, self.h, self.x = f, h, np.array(x, dtype=float)
        self.Q, self.R, self.P = (np.diag(np.array(each, dtype=float)) for each in noise)

    def step(self, x: np.ndarray, u: np.ndarray, substeps: int) -> np.ndarray:
        h = PERIOD / substeps
        for _ in range(substeps):
            k1 = self.f(x, u)
            k2 = self.f(x + h / 2 * k1, u)
            k3 = self.f(x + h / 2 * k2, u)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + self.f(x + h * k3, u))
        return x

    @staticmethod
    def slopes(g: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
        return np.stack([np.imag(g(x + 1e-40j * e)) / 1e-40 for e in np.eye(len(x))], axis=1)

    def predict(self, u: np.ndarray, substeps: int = 1) -> None:
        phi = self.slopes(lambda x: self.step(x, u, substeps), self.x.astype(complex))
        self.x = self.step(self.x, u, substeps)
        half = self.Q * PERIOD / 2
        self.P = phi @ (self.P + half) @ phi.T + half

    def update(self, y: np.ndarray) -> None:
        H = self.slopes(self.h, self.x.astype(complex))
        S = H @ self.P @ H.T + self.R / PERIOD
        K = np.linalg.solve(S, H @ self.P).T
        self.x = self.x + K @ (y - self.h(self.x))
        self.P = (np.eye(len(self.x)) - K @ H) @ self.P


def _levitated(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    m, k, g, L, R = 0.1, 9.8e-5, 9.8, 0.05, 2.0
    return np.array([x[1], g - k * x[2] ** 2 / (m * x[0] ** 2), (u[0] - R * x[2]) / L])


def _loop(**parts: Any) -> Loop:
    controller = ulna.compensator(LAW, ulna.extended_kalman_filter(LEVITATION, TUNING))
    hardware = Hardware(period=PERIOD, noise=MeasurementNoise(std=1e-5), **parts)
    return Loop(plant=LEVITATION, controller=controller, hardware=hardware)


def test_magnetic_levitation_with_noise_is_held_and_its_estimates_are_those_of_numpy() -> None:
    run = ulna.simulate(_loop(), START, 2.0)
    assert np.abs(run["x"][1000:] - 0.01).max() < 2e-4
    other = Independent(_levitated, lambda x: x[:1], ([0, 1e-2, 1e-1], [1e-13], [1e-8, 1e-6, 1e-4]), (0.01, 0, 1))
    for k, y in enumerate(run["y_measured"]):
        if k:
            other.predict(run["u_limited"][k - 1 : k])
        other.update(np.array([y]))
        found = [run[f"{name}_hat"][k] for name in "xsi"]
        assert found == pytest.approx(other.x, rel=1e-9, abs=1e-12), k
    assert run["cov_s_s"][-1] == pytest.approx(other.P[1, 1], rel=1e-6)
    assert run["cov_x_i"][-1] == pytest.approx(other.P[0, 2], rel=1e-6)


def test_steps_of_the_filter_in_continuous_time_stop_being_finite() -> None:
    """What a processor would do with its differential equations, and why it does not."""
    both = _loop().controller
    bare = Parts(system=both.system, law=both.law.system, observer=both.observer.system, initial=_loop().initial)
    hardware = Hardware(period=PERIOD, noise=MeasurementNoise(std=1e-5))
    run = ulna.simulate(Loop(plant=LEVITATION, controller=bare, hardware=hardware), START, 2.0, throw=False)
    assert not run.outcome.finished
    assert run.times[-1] < 0.05


@pytest.mark.parametrize("rule", [RungeKutta4(substeps=3), Euler(substeps=2)])
def test_the_prediction_is_the_step_that_was_asked_for(rule: Any) -> None:
    loop = _loop(discretisation=rule)
    run = ulna.simulate(loop, START, 0.3)
    other = Independent(_levitated, lambda x: x[:1], ([0, 1e-2, 1e-1], [1e-13], [1e-8, 1e-6, 1e-4]), (0.01, 0, 1))
    if isinstance(rule, Euler):
        h = PERIOD / 2

        def euler(x: np.ndarray, u: np.ndarray, _substeps: int) -> np.ndarray:
            half = x + h * _levitated(x, u)
            return half + h * _levitated(half, u)

        other.step = euler  # type: ignore[method-assign]
    for k, y in enumerate(run["y_measured"]):
        if k:
            other.predict(run["u_limited"][k - 1 : k], substeps=3)
        other.update(np.array([y]))
    assert [run[f"{name}_hat"][-1] for name in "xsi"] == pytest.approx(other.x, rel=1e-9)


def test_several_outputs_that_bend_are_read_at_once() -> None:
    """A pendulum seen by its sine and by a mixture: one value after the other is all of them together."""
    plant = system_from_mapping(
        {
            "name": "pendulum",
            "states": {"a": "w", "w": "-9*sin(a) - w/5 + u"},
            "inputs": {"u": {}},
            "outputs": {"high": "sin(a)", "mixed": "w + a**2/2"},
        }
    )
    tuning = ulna.KalmanNoise(process={"w": 2, "a": 0}, measurement={"mixed": "1/100", "high": "1/1000"})
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    controller = ulna.compensator(law, ulna.extended_kalman_filter(plant, tuning))
    hardware = Hardware(period=PERIOD, delay=1e-3, noise={"high": MeasurementNoise(std=0.05)})
    run = ulna.simulate(Loop(plant=plant, controller=controller, hardware=hardware), (1.0, 0.0), 0.5)

    def shown(x: np.ndarray) -> np.ndarray:
        return np.array([np.sin(x[0]), x[1] + x[0] ** 2 / 2])

    def rates(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.array([x[1], -9 * np.sin(x[0]) - x[1] / 5 + u[0]])

    other = Independent(rates, shown, ([0, 2], [1e-3, 1e-2], [1, 1]), (0, 0))
    applied = np.concatenate([[0.0], run["u_limited"]])
    for k in range(len(run.times)):
        if k:
            other.predict(applied[k - 1 : k])
        other.update(np.array([run["high_measured"][k], run["mixed_measured"][k]]))
        found = [run["a_hat"][k], run["w_hat"][k], run["cov_a_w"][k]]
        assert found == pytest.approx([*other.x, other.P[0, 1]], rel=1e-8, abs=1e-11), k


def test_of_a_linear_plant_the_covariance_is_the_riccati_equations() -> None:
    """Constant slopes: the covariance settles where the discrete algebraic Riccati equation says."""
    from scipy.linalg import solve_discrete_are

    plant = system_from_mapping(
        {"name": "cart", "states": {"p": "v", "v": "u - v"}, "inputs": {"u": {}}, "outputs": {"y": "p"}}
    )
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    noise = ulna.KalmanNoise(process=[0, 3], measurement=["1e-6"])
    controller = ulna.compensator(law, ulna.extended_kalman_filter(plant, noise))
    run = ulna.simulate(
        Loop(plant=plant, controller=controller, hardware=Hardware(period=PERIOD)), (0.1, 0.0), 1.0
    )  # fmt: skip
    A = np.array([[0.0, 1.0], [0.0, -1.0]]) * PERIOD
    phi = np.eye(2) + A + A @ A / 2 + A @ A @ A / 6 + A @ A @ A @ A / 24
    half = np.diag([0, 3 * PERIOD / 2])
    H, R = np.array([[1.0, 0.0]]), np.array([[1e-6 / PERIOD]])
    before = solve_discrete_are(phi.T, H.T, phi @ half @ phi.T + half, R)
    gain = before @ H.T / (H @ before @ H.T + R)
    after = before - gain @ H @ before
    found = [run[name][-1] for name in ("cov_p_p", "cov_p_v", "cov_v_v")]
    assert found == pytest.approx([after[0, 0], after[0, 1], after[1, 1]], rel=1e-8)


@pytest.mark.parametrize("precision", Precision)
def test_the_covariance_stays_positive_in_either_precision(precision: Precision) -> None:
    loop = _loop(arithmetic=Plain())
    made = firmware(
        loop, precision=precision, initial={k: v for k, v in START.items() if k.endswith("hat") or k == "u"}
    )
    assert made.initial[next(s for s, n in made.memory.items() if n == "state_cov_x_x")] == 1e-8
    random = np.random.default_rng(3)
    slots = dict(made.initial)
    rows = 0.01 + 1e-5 * random.standard_normal((3000, 1))
    answer = made.run(rows)
    assert np.isfinite(answer).all()
    assert not answer[:, -1].any()
    assert np.abs(answer[-1000:, 1] - 0.01).max() < 1e-4
    assert slots == dict(made.initial)


def test_a_filter_is_not_held_exactly() -> None:
    with pytest.raises(SimulationError, match=r"ExactHold\(\): it needs an estimator whose linear part is known"):
        _loop(discretisation=ExactHold())


def test_the_first_covariance_is_the_filters_in_every_loop() -> None:
    sampled = ulna.simulate(_loop(), START, 0.01)
    assert 0 < sampled["cov_i_i"][0] == pytest.approx(1e-4)
    continuous = replace(_loop(), hardware=None)
    named = {name: value for name, value in START.items() if name != "u"}
    assert ulna.simulate(continuous, named, 0.01)["cov_i_i"][0] == pytest.approx(1e-4)
