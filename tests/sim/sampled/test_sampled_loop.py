"""Sampled loops against closed forms, the matrix exponential and the continuous engine."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from sampled_loops import run_loop
from scipy.linalg import expm

from ulna.base import SimulationError
from ulna.loop import (
    TIME,
    ConditionalIntegration,
    EndStop,
    Euler,
    ExactHold,
    Jitter,
    MeasurementNoise,
    MissedSamples,
    Quantiser,
    RungeKutta4,
    Saturation,
    SlewLimit,
)
from ulna.sim import EventKind, Formula, Held, Interpolated, Outcome, simulate
from ulna.system import LinearInjection, System, system_from_mapping


def _system(name: str, **parts: object) -> System:
    if "states" in parts:
        return system_from_mapping({"name": name, **parts})
    # A plant file always has states; a law has none.
    with_state = system_from_mapping({"name": name, "states": {"nothing": "0"}, **parts})
    return replace(with_state, states=(), rates=())


INTEGRATOR = _system("integrator", states={"x": "u + d"}, inputs={"u": {}, "d": {}}, outputs={"y": "x"})
LAG = _system("lag", states={"x": "-x + u"}, inputs={"u": {}}, outputs={"y": "x"})
PASS = _system("pass", inputs={"r": {}}, outputs={"u": "r"})
GAIN = _system("gain", inputs={"y": {}}, outputs={"u": "-2*y"})
FILTER = _system("filter", states={"f": "-3*f + y"}, inputs={"y": {}}, outputs={"u": "-4*f"})
ARM = _system("arm", states={"q": "v", "v": "u - sin(q)"}, inputs={"u": {}}, outputs={"y": "q"})
OBSERVER = _system(
    "observer",
    states={"a": "b + 8*(y - a)", "b": "u - sin(y) + 20*(y - a)"},
    inputs={"u": {}, "y": {}},
    outputs={"q_hat": "a", "v_hat": "b"},
)
LAW = _system("law", inputs={"q": {}, "v": {}}, outputs={"u": "sin(q) - 4*q - 3*v"})


def _injected() -> LinearInjection:
    y, u = sp.symbols("y u", real=True)
    a, b = sp.symbols("q_hat v_hat", real=True)
    return LinearInjection(
        system=OBSERVER,
        matrix=sp.ImmutableDenseMatrix([[-8, 1], [-20, 0]]),
        injection=(8 * y, u - sp.sin(y) + 20 * y),
        start=(a, b),
    )


def _order(errors: list[float]) -> float:
    """Mean number of halvings of the error per halving of the step."""
    return float(np.mean(np.log2(np.array(errors[:-1]) / np.array(errors[1:]))))


def test_a_held_input_moves_a_lag_as_its_closed_form_says() -> None:
    run = run_loop(LAG, [0.5], 1.0, {"controller": PASS, "period": 0.01, "references": {"r": 2.0}})
    np.testing.assert_allclose(run["x"], 2.0 - 1.5 * np.exp(-run.times), rtol=0, atol=2e-10)
    assert len(run.times) == 101
    assert (run["u"] == 2.0).all()


def test_a_static_law_on_an_integrator_gives_the_discrete_closed_form() -> None:
    run = run_loop(INTEGRATOR, [1.0], 1.0, {"controller": GAIN, "period": 0.05})
    np.testing.assert_allclose(run["x"], (1 - 2 * 0.05) ** np.arange(21), rtol=1e-13)


@pytest.mark.parametrize("periods", [0.4, 1.0, 2.0, 2.5])
def test_a_delay_shifts_the_input(periods: float) -> None:
    h = 0.1
    settings = {"controller": PASS, "period": h, "delay": periods * h, "references": {"r": 1.0}}
    run = run_loop(INTEGRATOR, [0.0], 1.0, settings)
    np.testing.assert_allclose(run["x"], np.maximum(0.0, run.times - periods * h), atol=1e-13)


def test_only_the_sample_times_asked_for_are_handed_back() -> None:
    settings = {"controller": GAIN, "period": 0.01}
    every = run_loop(INTEGRATOR, [1.0], 1.0, settings)
    some = run_loop(INTEGRATOR, [1.0], np.linspace(0, 1, 11), settings)
    assert np.array_equal(some.states, every.states[::10])
    assert np.array_equal(some["u_command"], every["u_command"][::10])
    with pytest.raises(SimulationError, match="not a multiple of the period"):
        run_loop(INTEGRATOR, [1.0], [0.0, 0.0153, 1.0], settings)


def test_saturation_cuts_the_command_and_says_when() -> None:
    settings = {"controller": GAIN, "period": 0.1, "saturation": Saturation(lower=-1.0, upper=1.0)}
    run = run_loop(INTEGRATOR, [1.0], 2.0, settings)
    assert run["u"].min() == -1.0
    assert run["u_command"].min() == -2.0
    # x falls by 0.1 a sample until 2 x ≤ 1.
    np.testing.assert_allclose(run["x"][:6], [1.0, 0.9, 0.8, 0.7, 0.6, 0.5], atol=1e-14)
    kinds = [(e.kind, round(e.time, 9)) for e in run.events if e.signal == "u"]
    assert kinds[0] == (EventKind.SATURATION_ENTERED, 0.0)
    assert kinds[1][0] is EventKind.SATURATION_LEFT
    assert kinds[1][1] in {0.5, 0.6}


def test_a_slew_limit_bounds_every_change() -> None:
    settings = {"controller": PASS, "period": 0.1, "slew": SlewLimit(rate=2.0), "references": {"r": 1.0}}
    run = run_loop(INTEGRATOR, [0.0], 1.0, settings)
    np.testing.assert_allclose(run["u"], np.minimum(1.0, 0.2 * np.arange(1, 12)), atol=1e-14)


def test_a_quantiser_gives_the_nearest_multiple_of_its_step() -> None:
    ramp = {"controller": GAIN, "period": 0.01, "sensors": Quantiser(step=0.125, lower=-0.5, upper=0.75)}
    run = run_loop(INTEGRATOR, [1.0], 3.0, ramp, inputs={"d": Formula(expression=-TIME)})
    expected = np.clip(0.125 * np.floor(run["x"] / 0.125 + 0.5), -0.5, 0.75)
    np.testing.assert_allclose(run["y_measured"], expected, atol=1e-15)
    np.testing.assert_array_equal(run["u_command"], -2.0 * run["y_measured"])


def test_converters_have_the_right_steps() -> None:
    assert Quantiser.encoder(bits=12).step == 2 * math.pi / 4096
    assert Quantiser.converter(bits=8, lower=0.0, upper=5.1).step == pytest.approx(0.02)


def test_disturbances_enter_as_formula_ramp_and_steps() -> None:
    idle = {"controller": PASS, "period": 0.1, "references": {"r": 0.0}}
    wave = run_loop(INTEGRATOR, [0.0], 2.0, idle, inputs={"d": Formula(expression=sp.cos(TIME))})
    np.testing.assert_allclose(wave["x"], np.sin(wave.times), atol=1e-7)
    grid = np.linspace(0, 2, 21)
    ramp = run_loop(INTEGRATOR, [0.0], 2.0, idle, inputs={"d": Interpolated(times=grid, values=grid)})
    np.testing.assert_allclose(ramp["x"], ramp.times**2 / 2, atol=1e-13)
    steps = Held(times=np.array([0.0, 1.0]), values=np.array([1.0, -1.0]))
    held = run_loop(INTEGRATOR, [0.0], 2.0, idle, inputs={"d": steps})
    np.testing.assert_allclose(held["x"], 1 - np.abs(1 - held.times), atol=1e-13)


@pytest.mark.parametrize(
    ("discretisation", "order"),
    [(Euler(), 1), (Euler(interpolate=True), 1), (RungeKutta4(interpolate=False), 1), (RungeKutta4(), 2)],
)
def test_a_discretised_filter_converges_at_its_order(discretisation: Euler | RungeKutta4, order: int) -> None:
    """Open loop: the filter sees y = e^−t and its state is known."""
    lone = _system("decay", states={"x": "-x + 0*u"}, inputs={"u": {}}, outputs={"y": "x"})
    errors = []
    for count in (10, 20, 40, 80):
        settings = {"controller": FILTER, "period": 1.0 / count, "discretisation": discretisation, "number": 8}
        run = run_loop(lone, [1.0], 1.0, settings)
        exact = (np.exp(-run.times) - np.exp(-3 * run.times)) / 2
        errors.append(float(np.abs(run["f"] - exact).max()))
    assert _order(errors) == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize(("interpolate", "order"), [(True, 2), (False, 1)])
def test_the_exact_hold_converges_at_its_order(interpolate: bool, order: int) -> None:
    errors = []
    for count in (50, 100, 200):
        settings = {
            "controller": _system("off", inputs={"q": {}}, outputs={"u": "0*q"}),
            "estimator": _injected(),
            "period": 2.0 / count,
            "discretisation": ExactHold(interpolate=interpolate),
            "number": 4,
        }
        run = run_loop(ARM, [1.0, 0.0], 2.0, settings)
        exact = _observer_alone(run.times)
        errors.append(float(np.abs(run["v_hat"] - exact).max()))
    assert _order(errors) == pytest.approx(order, abs=0.2)


def _observer_alone(times: np.ndarray) -> np.ndarray:
    """v̂ of the continuous observer on the free arm."""
    both = _system(
        "both",
        states={"q": "v", "v": "-sin(q)", "a": "b + 8*(q - a)", "b": "-sin(q) + 20*(q - a)"},
        outputs={"v_hat": "b"},
    )
    return simulate(both, [1.0, 0.0, 0.0, 0.0], times)["v_hat"]


def test_the_exact_hold_is_exact_where_what_is_injected_is_a_straight_line() -> None:
    from ulna.loop.fitted import held_matrices

    F = np.array([[-8.0, 1.0], [-20.0, 0.0]])
    phi, g0, g1 = held_matrices(F, 0.05, interpolate=True)
    w0, w1, z = np.array([1.0, 2.0]), np.array([-0.5, 3.0]), np.array([0.3, -0.7])
    fine = 20_000
    s = (np.arange(fine) + 0.5) / fine * 0.05
    step = expm(F * 0.05 / fine)
    grown = expm(F * 0.05 / fine / 2)
    total = z.copy()
    for t in s:
        total = step @ total + grown @ (w0 + (w1 - w0) * t / 0.05) * 0.05 / fine
    np.testing.assert_allclose(phi @ z + g0 @ w0 + g1 @ w1, total, rtol=1e-8)
    phi, g0, g1 = held_matrices(F, 0.05, interpolate=False)
    np.testing.assert_allclose(phi, expm(F * 0.05), rtol=1e-13)
    np.testing.assert_allclose(g0, np.linalg.solve(F, expm(F * 0.05) - np.eye(2)), rtol=1e-12)
    assert not g1.any()


@pytest.mark.parametrize("discretisation", [Euler(), RungeKutta4(), ExactHold()])
def test_the_sampled_loop_goes_to_the_continuous_one_at_first_order(
    discretisation: Euler | RungeKutta4 | ExactHold,
) -> None:
    """The hold of the input alone delays by half a period: no discretisation of the controller beats order one."""
    loop = _system(
        "loop",
        states={
            "q": "v",
            "v": "sin(a) - 4*a - 3*b - sin(q)",
            "a": "b + 8*(q - a)",
            "b": "sin(a) - 4*a - 3*b - sin(q) + 20*(q - a)",
        },
    )
    errors = []
    for count in (200, 400, 800):
        settings = {
            "controller": LAW,
            "estimator": _injected(),
            "period": 2.0 / count,
            "discretisation": discretisation,
        }
        run = run_loop(ARM, [1.0, 0.0], 2.0, settings)
        exact = simulate(loop, [1.0, 0.0, 0.0, 0.0], run.times).states[:, :2]
        errors.append(float(np.abs(run.states - exact).max()))
    assert _order(errors) == pytest.approx(1.0, abs=0.15)


def test_an_estimator_sees_the_limited_input() -> None:
    estimator = _system("model", states={"m": "u + 0*y"}, inputs={"u": {}, "y": {}}, outputs={"x_hat": "m"})
    law = _system("strong", inputs={"x": {}, "r": {}}, outputs={"u": "10*(r - x)"})
    plant = _system("plant", states={"x": "u"}, inputs={"u": {}}, outputs={"y": "x"})
    settings = {
        "controller": law,
        "estimator": estimator,
        "period": 0.01,
        "delay": 0.013,
        "saturation": Saturation(lower=-1.0, upper=1.0),
        "references": {"r": 1.0},
    }
    run = run_loop(plant, [0.0], 3.0, settings)
    np.testing.assert_allclose(run["x_hat"], run["x"], atol=1e-12)
    assert run["u_command"].max() == 10.0


@pytest.mark.parametrize("discretisation", [Euler(), RungeKutta4(), RungeKutta4(interpolate=False), ExactHold()])
def test_conditional_integration_overshoots_less(discretisation: Euler | RungeKutta4 | ExactHold) -> None:
    law = _system("pi", states={"e_int": "r - y"}, inputs={"y": {}, "r": {}}, outputs={"u": "3*(r - y) + 4*e_int"})
    plant = _system("plant", states={"x": "-x + u"}, inputs={"u": {}}, outputs={"y": "x"})
    # An estimator that the law does not read, for the exact hold to have its form.
    filtered = _system("filtered", states={"f": "-5*f + y"}, inputs={"y": {}}, outputs={"f_hat": "f"})
    y, f_hat = sp.symbols("y f_hat", real=True)
    matrix = sp.ImmutableDenseMatrix([[-5]])
    estimator = LinearInjection(system=filtered, matrix=matrix, injection=(y,), start=(f_hat,))
    peaks = []
    for anti_windup in (None, ConditionalIntegration(states=("e_int",))):
        settings = {
            "controller": law,
            "estimator": estimator,
            "period": 0.01,
            "discretisation": discretisation,
            "saturation": Saturation(lower=-1.2, upper=1.2),
            "references": {"r": 1.0},
            "anti_windup": anti_windup,
        }
        run = run_loop(plant, [0.0], 10.0, settings)
        peaks.append(run["x"].max())
        assert run["x"][-1] == pytest.approx(1.0, abs=1e-3)
        frozen = (np.diff(run["e_int"]) == 0.0) & (run["u_command"][1:] > 1.2)
        assert frozen.any() == (anti_windup is not None)
    assert peaks[1] < 1.02 < peaks[0]


def test_an_end_stop_holds_the_position_and_is_noted() -> None:
    ball = _system("ball", states={"h": "v", "v": "-10 + u"}, inputs={"u": {}}, outputs={"y": "h"})
    wall = EndStop(position="h", velocity="v", lower=0.0)
    settings = {"controller": PASS, "period": 0.001, "references": {"r": 0.0}, "end_stops": (wall,)}
    run = run_loop(ball, [0.5, 0.0], 1.0, settings)
    assert run["h"].min() == 0.0
    assert run.final_state.tolist() == [0.0, 0.0]
    entered = next(e for e in run.events if e.kind is EventKind.END_STOP_ENTERED)
    assert entered.time == pytest.approx(math.sqrt(0.1), abs=1.1e-3)
    elastic = {
        "controller": PASS,
        "period": 0.001,
        "references": {"r": 0.0},
        "end_stops": (EndStop(position="h", velocity="v", lower=0.0, restitution=0.5),),
    }
    bounced = run_loop(ball, [0.5, 0.0], 1.0, elastic)
    assert bounced["v"].max() == pytest.approx(0.5 * math.sqrt(10.0), rel=0.01)


def test_noise_has_its_variance_and_depends_on_the_seed_only() -> None:
    def measured(seed: int) -> np.ndarray:
        settings = {"controller": GAIN, "period": 1e-3, "noise": MeasurementNoise(std=0.1), "seed": seed}
        return run_loop(INTEGRATOR, [0.0], 20.0, settings)["y_measured"]

    first = measured(1)
    assert np.array_equal(first, measured(1))
    assert not np.array_equal(first, measured(2))
    still = {
        "controller": _system("off", inputs={"y": {}}, outputs={"u": "0*y"}),
        "period": 1e-3,
        "noise": MeasurementNoise(std=0.1),
    }
    noise = run_loop(INTEGRATOR, [0.0], 50.0, still)["y_measured"] / 0.1
    assert abs(noise.mean()) < 4 / math.sqrt(len(noise))
    assert noise.var() == pytest.approx(1.0, abs=0.03)
    assert abs(np.mean(noise[1:] * noise[:-1])) < 4 / math.sqrt(len(noise))
    assert np.mean(np.abs(noise) > 2) == pytest.approx(0.0455, abs=0.004)


def test_jitter_moves_the_samples_and_missed_ones_keep_the_command() -> None:
    settings = {"controller": GAIN, "period": 0.01, "clock": (Jitter(width=0.004), MissedSamples(probability=0.3))}
    run = run_loop(INTEGRATOR, [1.0], 10.0, settings)
    late = run.times - 0.01 * np.arange(len(run.times))
    assert late.min() >= 0.0
    assert late.max() < 0.004
    assert late.mean() == pytest.approx(0.002, abs=2e-4)
    kept = np.diff(run["u_command"]) == 0.0
    assert kept.mean() == pytest.approx(0.3, abs=0.05)
    # Between two samples the plant is the exact integral of what was held.
    np.testing.assert_allclose(np.diff(run["x"]), run["u"][:-1] * np.diff(run.times), atol=1e-14)


def test_a_loop_that_blows_up_ends_there_and_says_so() -> None:
    wild = _system("wild", inputs={"y": {}}, outputs={"u": "300*y"})
    settings = {"controller": wild, "period": 0.1, "bound": 1e6}
    run = run_loop(INTEGRATOR, [1.0], 10.0, settings, throw=False)
    assert run.outcome is Outcome.BLEW_UP
    assert abs(run.final_state[0]) >= 1e6
    assert run.events[-1].kind is EventKind.BLEW_UP
    with pytest.raises(SimulationError, match="passed the bound"):
        run_loop(INTEGRATOR, [1.0], 10.0, settings)


def test_a_command_that_is_no_number_never_reaches_the_plant() -> None:
    root = _system("root", inputs={"y": {}}, outputs={"u": "-sqrt(y)"})
    settings = {"controller": root, "period": 0.1, "saturation": Saturation(lower=-1.0, upper=1.0)}
    run = run_loop(INTEGRATOR, [0.05], 1.0, settings, inputs={"d": -1.0}, throw=False)
    assert run.outcome is Outcome.NOT_FINITE
    assert np.isfinite(run.states).all()
