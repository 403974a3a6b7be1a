"""Values outside a declared range are refused at every door; a motion may leave it."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from terminal import ulna as terminal

import ulna
from ulna.base import UlnaError
from ulna.campaign import Random, Uniform
from ulna.system import out_of_range

HEATER = """
format = 1
name = "heater"
[parameters]
R = { value = 100, range = [50, 200], unit = "mohm" }
[states]
T = { equation = "u - T*R", range = [250, 500], unit = "K" }
[inputs]
u = { range = [0, 10], unit = "A" }
[outputs]
y = { equation = "T", unit = "K" }
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("ranges") / "heater.toml"
    path.write_text('dimensions = "unchecked"\n' + HEATER)
    return path


@pytest.mark.parametrize(
    ("initial", "given", "message"),
    [
        ((1000.0,), {}, r"initial=.*T = 1000 K, its range is \[250, 500\] K"),
        ({"T": 249.0}, {}, "T = 249 K"),
        ((300.0,), {"inputs": {"u": 50}}, r"inputs=.*u = 50 A, its range is \[0, 10\] A"),
        ((300.0,), {"inputs": {"u": ulna.Held(times=np.array([0.0, 1]), values=np.array([1.0, -1]))}}, "u = -1 A"),
        ((300.0,), {"parameters": {"R": 1.0}}, r"parameters=.*R = 1000 mohm, its range is \[50, 200\] mohm"),
        (np.array([[300.0], [200.0], [100.0]]), {}, "T = 100 K"),
        ((300.0,), {"parameters": {"R": np.array([0.1, 0.01])}}, "R = 10 mohm"),
        ((300.0,), {"inputs": {"u": np.array([1.0, 11.0])}}, "u = 11 A"),
    ],
)
def test_a_value_outside_is_refused_by_name_value_and_range(file, initial, given, message):
    with pytest.raises(UlnaError, match=message):
        ulna.simulate(ulna.read_system(file), initial, (0.0, 0.1), **given)


def test_the_ends_belong_to_the_range_and_a_motion_may_leave_it(file):
    plant = ulna.read_system(file)
    run = ulna.simulate(plant, (250.0,), (0.0, 1.0), inputs={"u": 10}, parameters={"R": 0.05})
    assert run["T"][-1] < 250
    # A formula of time is a motion, too.
    ulna.simulate(plant, (500.0,), (0.0, 1.0), inputs={"u": 20 * ulna.TIME})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--initial", "T=1000"], "--initial 'T=1000': T = 1000 K, its range is [250, 500] K."),
        ([], "no --initial T=…: T = 0 K, its range is [250, 500] K."),
        (["--initial", "300", "--input", "u=50"], "--input 'u=50': u = 50 A, its range is [0, 10] A."),
        (["--initial", "300", "--set", "R=1"], "--set 'R=1': R = 1000 mohm, its range is [50, 200] mohm."),
    ],
)
def test_at_the_terminal_the_option_is_named(file, options, message):
    done = terminal("simulate", str(file), *options)
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())


@pytest.mark.parametrize("name", ["T", "R", "u"])
def test_what_a_sweep_varies_stays_inside(file, name):
    plan = Random(vary={name: Uniform(low=-1, high=1000)}, runs=4, seed=1)
    with pytest.raises(UlnaError, match=f"'{name}' of 'heater'.*they reach from -1 to 1000"):
        ulna.sweep(ulna.Loop(plant=ulna.read_system(file)), plan, horizon=0.1, initial={"T": 300})
    inside = Random(vary={"T": Uniform(low=250, high=300)}, runs=4, seed=1)
    with pytest.raises(UlnaError, match="constant input 'u'.*u = 11 A"):
        ulna.sweep(ulna.Loop(plant=ulna.read_system(file)), inside, horizon=0.1, inputs={"u": 11})


def test_an_angle_in_another_form_is_not_outside_by_a_rounding():
    angle = ulna.Parameter(name="a", lower=sp.Integer(0), upper=sp.Integer(30), unit="deg")
    assert out_of_range(angle, [np.nextafter(np.pi / 6, 1), 0.0]) == ""
    assert out_of_range(angle, np.pi / 3) == "a = 60 deg, its range is [0, 30] deg."
    signal = ulna.Signal(name="x", upper=sp.Integer(1))
    assert out_of_range(signal, [0.0, 2.0]) == "x = 2, its range is [-inf, 1]."
    assert out_of_range(ulna.Signal(name="x"), 1e9) == ""
