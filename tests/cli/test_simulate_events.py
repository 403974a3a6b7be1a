"""Limits, end stops and events of `ulna simulate`."""

from __future__ import annotations

import math

import pytest
from terminal import answered, refused, ulna

LOOP = ["--controller-poles", "-2+3.46j,-2-3.46j,-8", "--observer-poles", "-9,-10,-11"]
ARM = ["simulate", "one_link_arm", "--initial", "1,0,0"]


def test_limits_stops_and_events_are_reported_as_json():
    asked = ["--limit", "u=-15:15", "--stop", "theta=-1:1:0.5", "--event", "top: omega", "--settle", "theta=0.549"]
    data = answered(*ARM, *LOOP, *asked)
    assert max(map(abs, data["signals"]["u"])) == 15.0
    assert max(data["signals"]["theta"]) == 1.0
    kinds = {event["kind"] for event in data["events"]}
    assert {"saturation_entered", "saturation_left", "end_stop_entered", "end_stop_left", "crossed"} <= kinds
    crossed = [event for event in data["events"] if event["kind"] == "crossed"]
    assert all(event["signal"] == "top" and abs(event["state"][1]) < 1e-12 for event in crossed)


def test_a_run_ends_where_it_is_told_to():
    data = answered(*ARM, "--until", "theta-pi/2")
    assert data["outcome"] == "stopped"
    assert data["signals"]["theta"][-1] == pytest.approx(math.pi / 2, abs=1e-12)
    assert data["time"][-1] == data["events"][-1]["time"]


def test_events_are_shown_in_a_table():
    done = ulna(*ARM, "--event", "theta - 1.2")
    assert "theta - 1.2" in done.stdout
    assert "the expression passed through zero" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--limit", "u=2:1"], "not below"),
        (["--limit", "u=1:2:3"], "3 numbers, expected 1 or 2"),
        (["--limit", "w=1"], "there is no input 'w'. Known: u."),
        (["--limit", "1", "--limit", "u=2"], "Name them"),
        (["--stop", "phi=0:1"], "there is no state 'phi'"),
        (["--stop", "i=0:1"], "the rate of i is not a state"),
        (["--stop", "theta=2:1"], "--stop theta=2.0:1.0: the lower limit 2.0 is not below"),
        (["--stop", "theta=-2:2:3"], "--stop, the rebound 3.0: expected a number between 0 and 1"),
        (["--stop", "theta=-2:2", "--stop", "theta=-3:3"], "--stop: one position has two"),
        (["--stop", "theta=0:0.5"], "Start within the stops"),
        (["--event", "thet - 1"], "Did you mean 'theta'"),
        (["--settle", "z"], "there is no output or state 'z'. Known: y, theta, omega, i."),
        (["--settle", "y=a"], "unknown symbol 'a'"),
    ],
)
def test_wrong_rules_end_in_one_line(arguments: list[str], reason: str):
    assert reason in refused(*ARM, *arguments)


TWO = """
name = "two masses"
[parameters]
rest = 2
[states]
a = "v"
v = "F"
b = "u - (b - rest)"
[inputs]
F = {}
u = {}
[outputs]
y = "a"
z = "b"
[operating_point]
b = 2
"""


@pytest.fixture
def two(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(TWO)
    return str(path)


POLES = ["--controller-poles=-1+2j,-1-2j,-5"]


@pytest.mark.parametrize("more", [[], ["--period", "1e-3"]])
def test_an_output_settles_at_its_reference(two, more):
    asked = [*POLES, "--set-point", "--reference", "y=pi/6", "--reference", "z=1", "--settle", "y", "--settle", "z"]
    data = answered("simulate", two, *asked, "--initial", "0,0,0", *more)
    found = {each["output"]: each for each in data["settling"]}
    assert found["y"]["target"] == pytest.approx(math.pi / 6)
    # s^2 + 2 s + 5 stays within 2 % from 3.7352 s on, s + 5 from ln(50)/5.
    assert found["y"]["time"] == pytest.approx(3.7352, abs=1e-2)
    assert found["z"]["time"] == pytest.approx(math.log(50) / 5, abs=1e-2)
    assert found["z"]["target"] == 1.0


def test_without_a_reference_an_output_settles_where_the_plant_is_held(two):
    data = answered("simulate", two, *POLES, "--initial", "1,0,0", "--settle", "z", "--settle", "v")
    z, v = data["settling"]
    assert z == {"output": "z", "target": 2.0, "time": pytest.approx(math.log(50) / 5, abs=1e-6)}
    assert v == {"output": "v", "target": 0.0, "time": None}


def test_what_became_of_an_output_is_always_said(two):
    said = ulna(
        "simulate", two, *POLES, "--initial", "1,0,0", "--settle", "z", "--settle", "v", "--settle", "y=3"
    ).stdout
    assert "z stays in its 2 % band around 2 from t = 0.7824" in said
    assert "v starts at its target 0" in said
    assert "y does not settle: it is" in said


def test_a_reference_that_moves_has_no_target(two):
    asked = [*POLES, "--track", "--reference", "y=sin(t)", "--reference", "z=1", "--settle", "y"]
    assert "--settle y=0.5" in refused("simulate", two, *asked)
