"""Bridges: their mean, and their pulses one by one, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sampled_loops import run_loop
from scipy.linalg import expm

from ulna.loop import Flow, Hardware, Jitter, Loop, Pwm, Quantiser, Steps
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
        settings = {"controller": PASS, "period": 0.01, "drive": drive, "references": {"r": command}}
        run = run_loop(INTEGRATOR, [0.0], 0.1, settings)
        assert run.final_state[0] == pytest.approx(0.1 * mean, abs=1e-12)


def _two_bridges(*, switched: bool, delay: float = 0.0, number: int = 1) -> tuple[System, dict[str, Any]]:
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
    settings = {
        "controller": law,
        "period": 0.01,
        "drive": drive,
        "references": {"r": 1.0},
        "delay": delay,
        "number": number,
    }
    return plant, settings


def test_several_inputs_have_pulses_of_their_own() -> None:
    plant, settings = _two_bridges(switched=True)
    run = run_loop(plant, [0.0, 0.0, 0.0], 0.05, settings)
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
    mean = run_loop(plant, [0.0, 0.0, 0.0], 0.05, _two_bridges(switched=False)[1])
    assert 1e-5 < np.abs(mean.final_state - x).max() < 1e-2


def test_pulses_with_a_delay_change_their_width_within_the_period() -> None:
    plant, settings = _two_bridges(switched=True, delay=0.004)
    late = run_loop(plant, [0.0, 0.0, 0.0], 0.06, settings)
    prompt = run_loop(plant, [0.0, 0.0, 0.0], [0.0, 0.04, 0.05, 0.06], _two_bridges(switched=True)[1])
    # Nothing happens for four of the ten carriers; the state then is that of 4 ms earlier.
    grid = [0.0, 0.05, 0.056, 0.06]
    fine = dict(_two_bridges(switched=True)[1], period=0.002)
    reference = run_loop(plant, [0.0, 0.0, 0.0], grid, fine)
    np.testing.assert_allclose(late.final_state, reference.states[2], rtol=1e-12)
    assert abs(prompt.final_state[0] - late.final_state[0]) > 1e-4


@pytest.mark.parametrize(("order", "steps"), [(2, 1), (2, 3), (4, 2)])
def test_pulses_are_integrated_with_the_order_and_steps_asked_for(order: int, steps: int) -> None:
    plant = _system("lag", states={"x": "-20*x + u", "v": "sin(x)"}, inputs={"u": {}}, outputs={"y": "x"})
    law = _system("pass", inputs={"r": {}}, outputs={"u": "r"})
    bridge = Pwm(frequency=100.0, supply=12.0, switched=True)
    settings = {"controller": law, "period": 0.05, "drive": bridge, "references": {"r": 5.0}}
    tight = run_loop(plant, [0.0, 0.0], 1.0, dict(settings, number=64))
    errors = [
        np.abs(run_loop(plant, [0.0, 0.0], 1.0, dict(settings, order=order, number=count)).states - tight.states).max()
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


def _bridged(kind: str, frequency: float, **settings: object) -> dict[str, Any]:
    drive = {
        "u": Pwm(frequency=frequency, supply=12.0, switched=kind == "switched", ripple=kind == "ripple"),
        "v": Pwm(frequency=frequency, supply=6.0, sag=0.1, switched=kind == "switched", ripple=kind == "ripple"),
    }
    return {"controller": FEEDBACK, "period": 0.02, "drive": drive, **settings}


@pytest.mark.parametrize(("kind", "order"), [("ripple", 2), ("mean", 1)])
# A whole number of carriers: pulses change at the start of one, and a rounded delay would be an error of its own.
@pytest.mark.parametrize("delay", [0.0, 0.01])
def test_the_ripple_is_right_to_second_order_and_the_mean_to_first(kind: str, order: int, delay: float) -> None:
    errors = []
    for frequency in (400.0, 800.0):
        every = run_loop(NONLINEAR, [0.1, 0.2], 1.0, _bridged("switched", frequency, delay=delay, number=4))
        # Steps enough that only the averaging is seen.
        fast = run_loop(NONLINEAR, [0.1, 0.2], 1.0, _bridged(kind, frequency, delay=delay, number=8))
        errors.append(np.abs(every.states - fast.states).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.25)
    assert errors[1] < (1e-4 if kind == "ripple" else 1e-2)


@pytest.mark.parametrize("kind", ["switched", "ripple"])
def test_pulses_have_the_same_bits_alone_and_among_others(kind: str) -> None:
    settings = _bridged(kind, 500.0, delay=0.009, sensors=Quantiser(step=1e-3), clock=Jitter(width=0.004))
    initial = np.random.default_rng(4).uniform(-1.0, 1.0, (43, 2))
    many = run_loop(NONLINEAR, initial, 1.0, settings, threads=2)
    for k in (0, 21, 42):
        one = run_loop(NONLINEAR, initial[k], 1.0, dict(settings, seed=k))
        assert np.array_equal(one.final_state, many.final_state[k])


@pytest.mark.parametrize("kind", ["switched", "ripple"])
def test_loops_that_differ_in_carriers_and_steps_alone_are_one_program(kind: str) -> None:
    def flow(frequency: float, number: int, delay: float = 0.005) -> Flow:
        chip = Hardware(drive=_bridged(kind, frequency)["drive"], period=0.02, delay=delay)
        return Loop(plant=NONLINEAR, controller=FEEDBACK, hardware=chip).flow_by(Steps(number=number))

    slow, fast = flow(400.0, 1), flow(1600.0, 3)
    assert slow.motion == fast.motion
    assert (slow.numbers["carriers"], fast.numbers["carriers"]) == (8.0, 32.0)
    assert slow.motion != flow(400.0, 1, delay=0.0).motion
