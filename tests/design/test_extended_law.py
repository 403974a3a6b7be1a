"""Dynamic feedback: flat plants whose outputs no static law decouples follow references, here and at the terminal."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from terminal import answered, refused

import ulna
from ulna.base import NoFormError
from ulna.design import extended_law
from ulna.loop import Hardware, Loop
from ulna.sim import TIME
from ulna.system import system_from_mapping

CAR = """
name = "car steered through its rate"
[parameters]
L = 2.5
[states]
x = "v*cos(th)"
y = "v*sin(th)"
th = "v/L*tan(d)"
d = "r"
[inputs]
v = {}
r = {}
[outputs]
px = "x"
py = "y"
"""
UNICYCLE = system_from_mapping(
    {
        "name": "unicycle",
        "states": {"x": "v*cos(th)", "y": "v*sin(th)", "th": "w"},
        "inputs": {"v": {}, "w": {}},
        "outputs": {"px": "x", "py": "y"},
    }
)
PATH = {"px": 2 * TIME, "py": sp.sin(TIME)}


def with_derivatives(order: int) -> dict:
    given = {f"{name}_ref": value for name, value in PATH.items()}
    return given | {f"{n}_ref_d{k}": sp.diff(e, TIME, k) for n, e in PATH.items() for k in range(1, order + 1)}


def test_errors_of_a_unicycle_decay_with_the_poles_of_each_chain() -> None:
    """s² + 3 s + 2 in x, s² + 7 s + 12 in y: the errors are sums of two exponentials."""
    law = extended_law(UNICYCLE, ulna.Poles(-1, -2, -3, -4), reference=ulna.Track())
    assert [s.name for s in law.system.outputs] == ["v", "w"]
    assert [s.name for s in law.system.states] == ["xi1"]
    speed, way = float(np.hypot(2, 1)), float(np.arctan2(1, 2))
    start = {"x": 0.5, "y": -0.3, "th": way, "xi1": speed}  # the velocity is right, the place is not
    run = ulna.simulate(Loop(plant=UNICYCLE, controller=law), start, np.linspace(0, 3, 31), inputs=with_derivatives(2))
    t = run.times
    assert run["x"] - 2 * t == pytest.approx(0.5 * (2 * np.exp(-t) - np.exp(-2 * t)), abs=1e-9)
    assert run["y"] - np.sin(t) == pytest.approx(-0.3 * (4 * np.exp(-3 * t) - 3 * np.exp(-4 * t)), abs=1e-9)


def test_the_integrators_run_on_the_processor() -> None:
    law = extended_law(UNICYCLE, ulna.Poles(-1, -2, -3, -4), reference=ulna.Track())
    loop = Loop(plant=UNICYCLE, controller=law, hardware=Hardware(period=1e-3))
    start = {"x": 0.5, "y": -0.3, "th": float(np.arctan2(1, 2)), "xi1": float(np.hypot(2, 1))}
    run = ulna.simulate(loop, start, 3.0, inputs=with_derivatives(2))
    assert run["x"][-1] - 6 == pytest.approx(0.5 * (2 * np.exp(-3) - np.exp(-6)), abs=5e-3)


def test_what_no_extension_decouples_is_refused() -> None:
    twice = system_from_mapping(
        {
            "states": {"x": "u", "y": "v"},
            "inputs": {"u": {}, "v": {}},
            "outputs": {"a": "x", "b": "x**2"},
        }
    )
    with pytest.raises(NoFormError, match="cannot be steered independently"):
        extended_law(twice, ulna.Poles(-1, -2))


@pytest.fixture
def car(tmp_path):
    path = tmp_path / "car.toml"
    path.write_text(CAR)
    return str(path)


def test_a_lane_change_at_the_terminal(car) -> None:
    asked = ["--extend", "--track", "--controller-poles=-2,-2.5,-3,-2,-2.5,-3", "--initial", "y=0.2,xi1=10"]
    lane = ["--reference", "px=10*t", "--reference", "py=1.75*(1 + tanh(t - 4))", "--horizon", "9"]
    signals = answered("simulate", car, *asked, *lane)["signals"]
    time = np.linspace(0, 9, len(signals["x"]))
    late = time > 6
    assert np.array(signals["py"])[late] == pytest.approx(1.75 * (1 + np.tanh(time[late] - 4)), abs=2e-4)
    assert signals["px"][-1] == pytest.approx(90, abs=1e-3)
    assert signals["v"][0] == pytest.approx(10.0)


def test_options_that_do_not_go_with_it_are_named(car) -> None:
    law = ["--extend", "--controller-poles=-1,-2,-3,-1,-2,-3"]
    assert "--extend" in refused("simulate", car, *law, "--observer-poles=-1,-2,-3,-4")
    assert "there is no law to add it to" in refused("simulate", car, "--extend", "--observer-poles=-1,-2,-3,-4")
