"""Every mistake in the settings of a sampled loop is one clear error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from ulna.base import SimulationError
from ulna.sim import (
    ConditionalIntegration,
    EndStop,
    Euler,
    ExactHold,
    Jitter,
    MeasurementNoise,
    MissedSamples,
    Pwm,
    Quantiser,
    RungeKutta4,
    Sampled,
    Saturation,
    SlewLimit,
    run_ensemble,
    simulate,
)
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


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Sampled(controller=LAW, period=0.0), "positive time"),
        (lambda: Sampled(controller=LAW, period=-1e-3), "positive time"),
        (lambda: Sampled(controller=LAW, period=float("nan")), "positive time"),
        (lambda: Sampled(controller=LAW, period=0.1, delay=-1.0), "delay"),
        (lambda: Sampled(controller=LAW, period=0.1, plant_steps=0), "at least one step"),
        (lambda: Sampled(controller=LAW, period=0.1, plant_order=3), "order 2 or 4"),
        (lambda: Sampled(controller=LAW, period=0.1, seed=-1), "64 bits"),
        (lambda: Sampled(controller=LAW, period=0.1, bound=0.0), "bound"),
        (lambda: Sampled(controller=LAW, period=0.1, jitter=Jitter(width=0.2)), "not shorter than the period"),
        (lambda: Sampled(controller=LAW, period=0.1, discretisation=ExactHold()), "linear part"),
        (lambda: Saturation(lower=1.0, upper=-1.0), "not below the upper limit"),
        (lambda: Saturation(lower=float("nan"), upper=1.0), "not below the upper limit"),
        (lambda: SlewLimit(rate=0.0), "positive"),
        (lambda: EndStop(position="x", velocity="v", lower=1.0, upper=0.0), "not below the upper limit"),
        (lambda: EndStop(position="x", velocity="v", restitution=2.0), "between 0 and 1"),
        (lambda: Quantiser(step=0.0), "positive"),
        (lambda: Quantiser.encoder(bits=0), "bits"),
        (lambda: MeasurementNoise(std=-1.0), "from 0 on"),
        (lambda: MissedSamples(probability=1.0), "lies in"),
        (lambda: Jitter(width=-1.0), "from 0 on"),
        (lambda: Pwm(frequency=0.0, supply=1.0), "positive"),
        (lambda: Pwm(frequency=1e3, supply=1.0, dead_time=1e-3), "does not fit"),
        (lambda: Pwm(frequency=1e3, supply=1.0, sag=1.0), "lies in"),
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
        ({"sensors": {"w": Quantiser(step=0.1)}}, "no signal w"),
        ({"saturation": {"v": Saturation(lower=0.0, upper=1.0)}}, "no signal v"),
        ({"references": {"r": 1.0}}, "nothing reads r"),
        ({"initial": {"z": 1.0}}, "there is no z"),
        ({"parameters": {"k": 1.0}}, "it has no k"),
        ({"anti_windup": ConditionalIntegration(states=("e_int",))}, "no state e_int"),
        ({"end_stops": (EndStop(position="q", velocity="x", upper=1.0),)}, "no state 'q'"),
        ({"drive": Pwm(frequency=333.0, supply=1.0, switched=True)}, "whole number"),
    ],
)
def test_settings_that_do_not_fit_the_loop_are_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SimulationError, match=says):
        simulate(PLANT, [1.0], 1.0, time=Sampled(**{"controller": LAW, "period": 0.1, **settings}))


def test_bridges_that_switch_need_one_carrier() -> None:
    table = {"name": "two", "states": {"x": "u + v"}, "inputs": {"u": {}, "v": {}}, "outputs": {"y": "x"}}
    law = {"name": "law", "states": {"n": "0"}, "inputs": {"y": {}}, "outputs": {"u": "-y", "v": "-y"}}
    drive = {name: Pwm(frequency=f, supply=1.0, switched=True) for name, f in (("u", 100.0), ("v", 200.0))}
    with pytest.raises(SimulationError, match="different carriers .100 Hz, 200 Hz"):
        simulate(
            system_from_mapping(table),
            [1.0],
            1.0,
            time=Sampled(controller=system_from_mapping(law), period=0.1, drive=drive),
        )


def test_wires_that_lead_nowhere_are_named() -> None:
    deaf = _static("deaf", "w", "u", "w")
    with pytest.raises(SimulationError, match="input 'w' of 'deaf': nothing in the loop feeds it"):
        simulate(PLANT, [1.0], 1.0, time=Sampled(controller=deaf, period=0.1))
    lame = _static("lame", "y", "v", "y")
    with pytest.raises(SimulationError, match="none of the outputs v is an input of the plant"):
        simulate(PLANT, [1.0], 1.0, time=Sampled(controller=lame, period=0.1))
    with pytest.raises(SimulationError, match="drives it already"):
        simulate(PLANT, [1.0], 1.0, time=Sampled(controller=LAW, period=0.1), inputs={"u": 1.0})


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"horizon": 0.0}, "no positive time|not a positive time"),
        ({"initial": [[1.0, 2.0]]}, "instead of"),
        ({"initial": [[float("nan")]]}, "not a finite number"),
        ({"parameters": {"b": 1.0}}, "no such parameter"),
        ({"parameters": {"a": [1.0, 2.0]}, "initial": [[1.0]] * 3}, "numbers of runs differ"),
        ({"parameters": {"a": [1.0, float("inf")]}}, "not a finite number"),
        ({"inputs": {"w": 1.0}}, "no input w"),
        ({"inputs": {"u": 1.0}}, "drives it already"),
        ({"references": {"r": 1.0}}, "nothing reads r"),
        ({"targets": {"x2": 1.0}}, "no output"),
        ({"controller_initial": {"z": 1.0}}, "there is no z"),
        ({"controller_initial": {"z": [1.0, 2.0]}, "initial": [[1.0]] * 3}, "numbers of runs differ"),
        ({"seeds": [-1]}, "whole numbers"),
        ({"samples": 0}, "at least one interval"),
    ],
)
def test_arguments_of_an_ensemble_that_do_not_fit_are_refused(arguments: dict[str, Any], says: str) -> None:
    given = {"initial": [1.0], "horizon": 1.0, **arguments}
    with pytest.raises(SimulationError, match=says):
        run_ensemble(PLANT, time=Sampled(controller=LAW, period=0.1), **given)
