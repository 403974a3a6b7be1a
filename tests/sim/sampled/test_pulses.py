"""Bridges: their mean, and their pulses one by one, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from ulna.sim import Jitter, Pwm, Quantiser, Sampled, run_ensemble, simulate
from ulna.system import System, system_from_mapping


def _system(name: str, **parts: object) -> System:
    if "states" in parts:
        return system_from_mapping({"name": name, **parts})
    # A plant file always has states; a law has none.
    with_state = system_from_mapping({"name": name, "states": {"nothing": "0"}, **parts})
    return replace(with_state, states=(), rates=())


INTEGRATOR = _system("integrator", states={"x": "u"}, inputs={"u": {}}, outputs={"y": "x"})
PASS = _system("pass", inputs={"r": {}}, outputs={"u": "r"})


@pytest.mark.parametrize(("command", "mean"), [(6.0, 12 * 0.95 * 0.48), (-20.0, -12 * 0.9 * 0.98), (0.1, 0.0)])
def test_a_bridge_gives_pulses_with_the_mean_that_the_formula_says(command: float, mean: float) -> None:
    for switched in (False, True):
        drive = Pwm(frequency=1000.0, supply=12.0, dead_time=2e-5, sag=0.1, switched=switched)
        settings = Sampled(controller=PASS, period=0.01, drive=drive, references={"r": command})
        run = simulate(INTEGRATOR, [0.0], 0.1, time=settings)
        assert run.final_state[0] == pytest.approx(0.1 * mean, abs=1e-12)


def _two_bridges(*, switched: bool, delay: float = 0.0, plant_steps: int = 1) -> tuple[System, Sampled]:
    """Two inputs with a bridge each, and one that has none."""
    plant = _system(
        "two wheels",
        states={"a": "u - a", "b": "v - 2*b + a", "c": "w"},
        inputs={"u": {}, "v": {}, "w": {}},
        outputs={"y": "b"},
    )
    law = _system("three", inputs={"r": {}}, outputs={"u": "7*r", "v": "-3*r", "w": "r"})
    drive = {
        "u": Pwm(frequency=1000.0, supply=12.0, switched=switched),
        "v": Pwm(frequency=1000.0, supply=10.0, sag=0.1, dead_time=5e-5, switched=switched),
    }
    settings = Sampled(
        controller=law, period=0.01, drive=drive, references={"r": 1.0}, delay=delay, plant_steps=plant_steps
    )
    return plant, settings


def test_several_inputs_have_pulses_of_their_own() -> None:
    plant, settings = _two_bridges(switched=True)
    run = simulate(plant, [0.0, 0.0, 0.0], 0.05, time=settings)
    # By hand: over each carrier the three stretches between the pulses' ends, a linear plant, matrix exponentials.
    parts = {"u": 7 / 12, "v": 0.3 - 0.05}
    heights = {"u": 12.0, "v": -10.0 * (1 - 0.1 * 0.3)}
    field = np.zeros((6, 6))
    field[:3] = [[-1, 0, 0, 1, 0, 0], [1, -2, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]
    x = np.zeros(3)
    for _ in range(50):
        for begin, end in ((0.0, parts["v"]), (parts["v"], parts["u"]), (parts["u"], 1.0)):
            on = [heights[name] if end <= part else 0.0 for name, part in parts.items()]
            x = (expm(field * 1e-3 * (end - begin)) @ np.array([*x, *on, 1.0]))[:3]
    np.testing.assert_allclose(run.final_state, x, rtol=1e-11)
    mean = simulate(plant, [0.0, 0.0, 0.0], 0.05, time=_two_bridges(switched=False)[1])
    assert 1e-5 < np.abs(mean.final_state - x).max() < 1e-2


def test_pulses_with_a_delay_change_their_width_within_the_period() -> None:
    plant, settings = _two_bridges(switched=True, delay=0.004)
    late = simulate(plant, [0.0, 0.0, 0.0], 0.06, time=settings)
    prompt = simulate(plant, [0.0, 0.0, 0.0], [0.0, 0.04, 0.05, 0.06], time=_two_bridges(switched=True)[1])
    # Nothing happens for four of the ten carriers; the state then is that of 4 ms earlier.
    grid = [0.0, 0.05, 0.056, 0.06]
    fine = replace(_two_bridges(switched=True)[1], period=0.002)
    reference = simulate(plant, [0.0, 0.0, 0.0], grid, time=fine)
    np.testing.assert_allclose(late.final_state, reference.states[2], rtol=1e-12)
    assert abs(prompt.final_state[0] - late.final_state[0]) > 1e-4


@pytest.mark.parametrize(("order", "steps"), [(2, 1), (2, 3), (4, 2)])
def test_pulses_are_integrated_with_the_order_and_steps_asked_for(order: int, steps: int) -> None:
    plant = _system("lag", states={"x": "-20*x + u", "v": "sin(x)"}, inputs={"u": {}}, outputs={"y": "x"})
    law = _system("pass", inputs={"r": {}}, outputs={"u": "r"})
    bridge = Pwm(frequency=100.0, supply=12.0, switched=True)
    settings = Sampled(controller=law, period=0.05, drive=bridge, references={"r": 5.0})
    tight = simulate(plant, [0.0, 0.0], 1.0, time=replace(settings, plant_steps=64))
    errors = [
        np.abs(
            simulate(plant, [0.0, 0.0], 1.0, time=replace(settings, plant_order=order, plant_steps=count)).states
            - tight.states
        ).max()
        for count in (steps, 2 * steps)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


NONLINEAR = _system(
    "nonlinear",
    states={"a": "-20*a + u - 5*b", "b": "a - 3*sin(b) + v"},
    inputs={"u": {}, "v": {}},
    outputs={"y": "b"},
)
FEEDBACK = _system("feedback", inputs={"y": {}}, outputs={"u": "6 - 5*y", "v": "-4*y - 1"})


def _bridged(kind: str, frequency: float, **settings: object) -> Sampled:
    drive = {
        "u": Pwm(frequency=frequency, supply=12.0, switched=kind == "switched", ripple=kind == "ripple"),
        "v": Pwm(frequency=frequency, supply=6.0, sag=0.1, switched=kind == "switched", ripple=kind == "ripple"),
    }
    return Sampled(controller=FEEDBACK, period=0.02, drive=drive, **settings)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(("kind", "order"), [("ripple", 2), ("mean", 1)])
# A whole number of carriers: pulses change at the start of one, and a rounded delay would be an error of its own.
@pytest.mark.parametrize("delay", [0.0, 0.01])
def test_the_ripple_is_right_to_second_order_and_the_mean_to_first(kind: str, order: int, delay: float) -> None:
    errors = []
    for frequency in (400.0, 800.0):
        every = simulate(NONLINEAR, [0.1, 0.2], 1.0, time=_bridged("switched", frequency, delay=delay, plant_steps=4))
        # Steps enough that only the averaging is seen.
        fast = simulate(NONLINEAR, [0.1, 0.2], 1.0, time=_bridged(kind, frequency, delay=delay, plant_steps=8))
        errors.append(np.abs(every.states - fast.states).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)
    assert errors[1] < (1e-4 if kind == "ripple" else 1e-2)


@pytest.mark.parametrize("kind", ["switched", "ripple"])
def test_pulses_have_the_same_bits_alone_and_among_others(kind: str) -> None:
    settings = _bridged(kind, 500.0, delay=0.009, sensors=Quantiser(step=1e-3), jitter=Jitter(width=0.004))
    initial = np.random.default_rng(4).uniform(-1.0, 1.0, (43, 2))
    many = run_ensemble(NONLINEAR, initial, 1.0, time=settings, threads=2)
    for k in (0, 21, 42):
        one = simulate(NONLINEAR, initial[k], 1.0, time=replace(settings, seed=k))
        assert np.array_equal(one.final_state, many.final_state[k])
