"""Small loops for tests of campaigns: quick to compile, with answers in closed form."""

from __future__ import annotations

import sympy as sp

from ulna.loop import Hardware, Loop, MeasurementNoise, Quantiser, Saturation
from ulna.system import Signal, System, system_from_mapping

SPRING = system_from_mapping(
    {
        "name": "spring with a set point",
        "states": {"x": {"equation": "v", "unit": "m"}, "v": {"equation": "-k*(x - r) - d*v", "unit": "m/s"}},
        "inputs": {"r": {"unit": "m"}},
        "outputs": {"y": {"equation": "x", "unit": "m"}, "u": {"equation": "k*(r - x)", "unit": "m/s^2"}},
        "parameters": {
            "k": {"value": 4, "unit": "1/s^2", "range": [1, 9]},
            "d": {"value": 2, "unit": "1/s"},
        },
    }
)
"""x'' = −k (x − r) − d x'."""

RUNAWAY = system_from_mapping(
    {"name": "runaway", "states": {"x": "-x + c*x^2"}, "outputs": {"y": "x"}, "parameters": {"c": {"value": 1}}}
)
"""x' = −x + c x²: for c x(0) > 1 it blows up at −log(1 − 1 / (c x(0)))."""

PLANT = system_from_mapping(
    {
        "name": "mass",
        "states": {"x": {"equation": "v", "unit": "m"}, "v": {"equation": "u/m", "unit": "m/s"}},
        "inputs": {"u": {"unit": "N"}},
        "outputs": {"x": {"equation": "x", "unit": "m"}, "v": {"equation": "v", "unit": "m/s"}},
        "parameters": {"m": {"value": 1, "unit": "kg"}},
    }
)


def _law() -> System:
    x, v, goal = sp.symbols("x v goal", real=True)
    return System(
        name="law",
        states=(),
        rates=(),
        inputs=(Signal(name="x"), Signal(name="v"), Signal(name="goal")),
        outputs=(Signal(name="u"),),
        readouts=(-4 * (x - goal) - 3 * v,),
    )


SAMPLED = Loop(
    plant=PLANT,
    controller=_law(),
    hardware=Hardware(
        period=0.01,
        saturation=Saturation(lower=-3.0, upper=3.0),
        sensors={"x": Quantiser(step=0.001)},
        noise={"v": MeasurementNoise(std=0.01)},
    ),
)
"""A law on measured states with steps, noise and limits, around `PLANT`; its reference is `goal`."""
