"""Every mistake in the settings of a sampled loop is one clear error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from sampled_loops import loop_of, run_loop

from ulna.base import SimulationError
from ulna.loop import (
    ConditionalIntegration,
    EndStop,
    Euler,
    ExactHold,
    Guard,
    Hardware,
    Jitter,
    Loop,
    MeasurementNoise,
    MissedSamples,
    Pwm,
    Quantiser,
    RungeKutta4,
    SafeOutput,
    Saturation,
    SlewLimit,
)
from ulna.sim import Figures, FixedSteps, Paths, Taylor, simulate
from ulna.system import System, system_from_mapping

PLANT = system_from_mapping(
    {
        "name": "plant",
        "states": {"x": "a*u"},
        "inputs": {"u": {}},
        "outputs": {"y": "x"},
        "parameters": {"a": {"value": 1}},
    }
)


def _static(name: str, wanted: str, given: str, formula: str) -> System:
    """A law; a plant file always has states."""
    table = {"name": name, "states": {"nothing": "0"}, "inputs": {wanted: {}}, "outputs": {given: formula}}
    return replace(system_from_mapping(table), states=(), rates=())


LAW = _static("law", "y", "u", "-y")
BASE: dict[str, Any] = {"controller": LAW, "period": 0.1}
LOOP = Loop(plant=PLANT, controller=LAW, hardware=Hardware(period=0.1))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Hardware(period=0.0), "positive time"),
        (lambda: Hardware(period=-1e-3), "positive time"),
        (lambda: Hardware(period=float("nan")), "positive time"),
        (lambda: Hardware(period=0.1, delay=-1.0), "delay"),
        (lambda: Hardware(period=0.1, delay=1e9), "remembers 1000 at most"),
        (
            lambda: Loop(plant=PLANT, controller=LAW, hardware=Hardware(delay=0.1)),
            "only a controller that runs once a period",
        ),
        (lambda: Hardware(period=0.1, clock=Jitter(width=0.2)), "not shorter than the period"),
        (lambda: Hardware(period=0.1, end_stops=(EndStop(position="x", velocity="v"),) * 2), "one position has two"),
        (lambda: SafeOutput(float("inf")), "finite number"),
        (lambda: Guard(largest=0.0), "positive"),
        (lambda: FixedSteps(number=0), "expected a whole number, at least 1"),
        (lambda: FixedSteps(order=3), "order 2 or 4"),
        (lambda: FixedSteps(bound=0.0), "bound"),
        (lambda: Loop(plant=PLANT, hardware=Hardware(period=0.1)), "no controller"),
        (lambda: Loop(plant=PLANT, controller=3, hardware=Hardware(period=0.1)), "not a system and has none"),
        (lambda: Loop(plant=PLANT, controller=LAW, hardware=Hardware(period=0.1)).system, "runs once a period"),
        (lambda: Loop(plant=PLANT, controller=LAW).step, "continuous"),
        (lambda: loop_of(PLANT, {**BASE, "discretisation": ExactHold()}), "linear part"),
        (lambda: Saturation(lower=1.0, upper=-1.0), "not below the upper limit"),
        (lambda: Saturation(lower=float("nan"), upper=1.0), "not below the upper limit"),
        (lambda: SlewLimit(rate=0.0), "positive"),
        (lambda: EndStop(position="x", velocity="v", lower=1.0, upper=0.0), "not below the upper limit"),
        (lambda: EndStop(position="x", velocity="v", restitution=2.0), "between 0 and 1"),
        (lambda: Quantiser(step=0.0), "positive"),
        (lambda: Quantiser.encoder(bits=0), "bits"),
        (lambda: MeasurementNoise(std=-1.0), "expected 0 or a positive"),
        (lambda: MissedSamples(probability=1.0), "expected a number in"),
        (lambda: Jitter(width=-1.0), "0 s or more"),
        (lambda: Pwm(frequency=0.0, supply=1.0), "positive"),
        (lambda: Pwm(frequency=1e3, supply=1.0, dead_time=1e-3), "does not fit"),
        (lambda: Pwm(frequency=1e3, supply=1.0, sag=1.0), "expected a number in"),
        (lambda: Pwm(frequency=1e3, supply=1.0, switched=True, ripple=True), "not both"),
        (lambda: Euler(substeps=0), "at least one step"),
        (lambda: RungeKutta4(substeps=0), "at least one step"),
    ],
)
def test_a_value_out_of_its_range_is_refused(make: Callable[[], Any], says: str) -> None:
    with pytest.raises(SimulationError, match=says):
        make()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"period": 2.0}, "longer than the run"),
        ({"period": 1e-320}, "inf samples"),
        ({"sensors": {"w": Quantiser(step=0.1)}}, "no signal w"),
        ({"saturation": {"v": Saturation(lower=0.0, upper=1.0)}}, "no signal v"),
        ({"references": {"r": 1.0}}, "no input r"),
        ({"initial": {"z": 1.0}}, "unknown: z"),
        ({"parameters": {"k": 1.0}}, "no such parameter"),
        ({"anti_windup": ConditionalIntegration(states=("e_int",))}, "no state e_int"),
        ({"end_stops": (EndStop(position="q", velocity="x", upper=1.0),)}, "no state 'q'"),
        ({"drive": Pwm(frequency=333.0, supply=1.0, switched=True)}, "whole number"),
    ],
)
def test_settings_that_do_not_fit_the_loop_are_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SimulationError, match=says):
        run_loop(PLANT, [1.0], 1.0, dict(**{**BASE, **settings}))


def test_bridges_that_switch_need_one_carrier() -> None:
    table = {"name": "two", "states": {"x": "u + v"}, "inputs": {"u": {}, "v": {}}, "outputs": {"y": "x"}}
    law = {"name": "law", "states": {"n": "0"}, "inputs": {"y": {}}, "outputs": {"u": "-y", "v": "-y"}}
    drive = {name: Pwm(frequency=f, supply=1.0, switched=True) for name, f in (("u", 100.0), ("v", 200.0))}
    with pytest.raises(SimulationError, match="different carriers .100 Hz, 200 Hz"):
        run_loop(
            system_from_mapping(table),
            [1.0],
            1.0,
            {"controller": system_from_mapping(law), "period": 0.1, "drive": drive},
        )


def test_wires_that_lead_nowhere_are_named() -> None:
    deaf = _static("deaf", "w", "u", "w")
    with pytest.raises(SimulationError, match="input 'w' of 'deaf': nothing in the loop feeds it"):
        run_loop(PLANT, [1.0], 1.0, {"controller": deaf, "period": 0.1})
    lame = _static("lame", "y", "v", "y")
    with pytest.raises(SimulationError, match="none of the outputs v is an input of the plant"):
        run_loop(PLANT, [1.0], 1.0, {"controller": lame, "period": 0.1})
    with pytest.raises(SimulationError, match="drives it already"):
        run_loop(PLANT, [1.0], 1.0, {"controller": LAW, "period": 0.1}, inputs={"u": 1.0})


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"times": 0.0}, "0 s follows 0 s"),
        ({"initial": [[1.0, 2.0]]}, "instead of"),
        ({"initial": [[float("nan")]]}, "not a finite number"),
        ({"parameters": {"b": 1.0}}, "no such parameter"),
        ({"parameters": {"a": [1.0, 2.0]}, "initial": [[1.0]] * 3}, "numbers differ"),
        ({"parameters": {"a": [1.0, float("inf")]}}, "not a finite number"),
        ({"inputs": {"w": [1.0, 2.0]}}, "no input w"),
        ({"inputs": {"u": [1.0, 2.0]}}, "drives it already"),
        ({"targets": {"x2": [1.0, 2.0]}}, "x2 is not an output"),
        ({"initial": {"x": 1.0, "z": [1.0, 2.0]}}, "unknown: z"),
        ({"initial": {"x": [1.0, 2.0, 3.0]}, "parameters": {"a": [1.0, 2.0]}}, "numbers differ"),
        ({"seed": [-1]}, "whole numbers"),
        ({"seed": -1}, r"from 0 to 2\^64 - 1"),
        ({"times": [1.0, 2.0], "seed": [1]}, "begin at 0 s"),
        ({"record": Paths("w"), "seed": [1]}, "no such signal"),
        ({"engine": Taylor()}, "has a processor"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(arguments: dict[str, Any], says: str) -> None:
    given = {"initial": [1.0], "times": 1.0, **arguments}
    with pytest.raises(SimulationError, match=says):
        simulate(LOOP, **given)


def test_an_ensemble_has_intervals_and_only_the_paths_it_keeps() -> None:
    with pytest.raises(SimulationError, match="at least one interval"):
        Figures(samples=0)
    many = simulate(LOOP, [[1.0], [2.0]], 1.0, record=Paths("x"))
    assert many["x"].shape == (2, 11)
    with pytest.raises(SimulationError, match="this ensemble keeps those of x"):
        many["u"]
