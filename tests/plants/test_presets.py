"""Presets: every number with a source, what they hold by hand calculation, what they cannot lift."""

from __future__ import annotations

import copy
import math
import tomllib
from decimal import Decimal
from importlib.resources import files
from typing import Any

import numpy as np
import pytest

from ulna.base import PlantError
from ulna.plants import (
    TorqueMargin,
    arm_with_drive,
    hold,
    measured_forearm,
    no_load_speed,
    preset,
    preset_from_mapping,
    presets,
    range_of_motion,
    require_liftable,
    torque_margin,
    voltage_range,
)
from ulna.sim import simulate


def data(name: str) -> dict[str, Any]:
    """A copy of the data behind a preset."""
    text = (files("ulna.plants") / "hardware" / "presets.toml").read_text(encoding="utf-8")
    return copy.deepcopy(tomllib.loads(text, parse_float=Decimal)[name])


# Current, voltage, power: G/(eta N km), Ra i, u i by hand.
HANDS = {
    "paper": (17.64, 17.64, 311.17),
    "bench_servo": (0.78, 2.0, 1.58),
    "transhumeral_elbow": (1.25, 1.8, 2.2),
    "human_scale": (4.07, 1.3, 5.2),
}


def test_there_are_four_presets_and_every_number_has_a_source() -> None:
    assert {p.name for p in presets()} == set(HANDS)
    for p in presets():
        assert all(q.source and q.value is not None for q in p.parameters)
        assert all(p.sources.values())


@pytest.mark.parametrize("name", sorted(HANDS))
def test_holding_horizontally_takes_what_the_hand_calculation_says(name: str) -> None:
    held = hold(preset(name))
    current, voltage, power = HANDS[name]
    assert held.current == pytest.approx(current, abs=0.006)
    assert held.voltage == pytest.approx(voltage, abs=0.03)
    assert held.power == pytest.approx(power, rel=0.012)


@pytest.mark.parametrize("name", sorted(HANDS))
def test_with_the_holding_voltage_the_plant_rests(name: str) -> None:
    held = hold(preset(name), angle=0.5)
    run = simulate(arm_with_drive(preset(name)), [0.5, 0.0, -held.current], 0.05, inputs={"u": -held.voltage})
    assert run.final_state == pytest.approx([0.5, 0.0, -held.current], abs=1e-9)


@pytest.mark.parametrize("name", ["bench_servo", "transhumeral_elbow", "human_scale"])
def test_the_speed_without_load_is_the_closed_form(name: str) -> None:
    p = preset(name)
    floating = arm_with_drive(p, forearm=measured_forearm(inertia="0.005", moment="1e-12"))
    weightless = floating.with_parameters({"m2": 0})
    volts = float(p.limits.voltage or 0)
    run = simulate(weightless, [0.0, 0.0, 0.0], 5.0, inputs={"u": volts})
    assert run["omega"][-1] == pytest.approx(no_load_speed(p), rel=1e-6)
    ideal = volts / float(p.value("N") * p.value("kb"))
    assert no_load_speed(p) <= ideal
    assert no_load_speed(p) > 0.94 * ideal


def test_a_load_too_heavy_is_refused_with_the_torque_margin() -> None:
    heavy = data("bench_servo")
    heavy["parameters"]["m2"]["value"] = Decimal("0.5")
    with pytest.raises(PlantError, match=r"takes 1\.044 N m, the drive gives 0\.7692 N m \(-26%\)") as refusal:
        arm_with_drive(preset_from_mapping("heavy", heavy))
    assert "voltage over resistance" in str(refusal.value)
    margin = refusal.value.value
    assert isinstance(margin, TorqueMargin)
    assert not margin.lifts


def test_the_margin_names_what_limits_it() -> None:
    elbow = preset("transhumeral_elbow")
    assert require_liftable(elbow).reason == "the peak current"
    assert torque_margin(elbow, resistance=5.0).reason == "voltage over resistance"
    assert torque_margin(preset("paper"), load=5.0).available == math.inf
    bench = torque_margin(preset("bench_servo"), load=0.15)
    assert bench.lifts
    assert not bench.lasts  # 1.07 A against 1.0 A forever
    assert torque_margin(preset("bench_servo"), load=0.10).lasts


@pytest.mark.parametrize(
    ("name", "value", "what"), [("Ra", "0", "positive"), ("N", "-5", "positive"), ("eta", "1.2", "at most 1")]
)
def test_numbers_that_no_drive_has_are_refused(name: str, value: str, what: str) -> None:
    broken = data("human_scale")
    broken["parameters"][name]["value"] = Decimal(value)
    with pytest.raises(PlantError, match=what):
        preset_from_mapping("broken", broken)


def test_missing_unknown_and_textual_entries_are_refused() -> None:
    missing, unknown, text = data("paper"), data("paper"), data("paper")
    del missing["parameters"]["La"]
    with pytest.raises(PlantError, match="missing: La"):
        preset_from_mapping("missing", missing)
    unknown["limits"] = {"torque": {"value": 3}}
    with pytest.raises(PlantError, match="torque"):
        preset_from_mapping("unknown", unknown)
    text["parameters"]["m1"]["value"] = "two"
    with pytest.raises(PlantError, match="needs a finite number"):
        preset_from_mapping("text", text)
    with pytest.raises(PlantError, match="bench_servo"):
        preset("bench-serv")


def test_the_bus_sags_by_the_internal_resistance() -> None:
    battery = preset("transhumeral_elbow").battery
    assert battery is not None
    assert voltage_range(battery, 4.0) == pytest.approx((-15.2, 13.6))
    arm = arm_with_drive(preset("transhumeral_elbow"), with_battery=True)
    drawn = dict(zip((s.name for s in arm.states), arm.with_values().rates, strict=True))["charge"]
    at = {arm.states[2].symbol: 4, arm.inputs[0].symbol: 13.6}  # duty 1: the battery gives the motor's current
    assert float(drawn.subs(at)) == pytest.approx(4.0)


def test_the_range_of_motion_counts_from_the_horizontal() -> None:
    motion = range_of_motion("contemporary")
    assert np.degrees([motion.lower, motion.upper]) == pytest.approx([-52, 67])
    with pytest.raises(PlantError, match="functional"):
        range_of_motion("full")
