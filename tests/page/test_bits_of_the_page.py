"""A loop in the page is the loop of `simulate`, to the last bit: catalogue plants under all kinds of hardware."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from compilers import GCC, node
from pages import run_page

import ulna
from ulna.loop import (
    Amplifier,
    ConditionalIntegration,
    ExactHold,
    Hardware,
    Jitter,
    Loop,
    MeasurementNoise,
    MissedSamples,
    Pwm,
    Quantiser,
    Saturation,
    SlewLimit,
)
from ulna.page import LoopScript, loop_script
from ulna.program import Plain, Precision

pytestmark = pytest.mark.skipif(node() is None, reason="there is no node")

LIMIT = Saturation(lower=-24.0, upper=24.0)
ENCODER = Quantiser.encoder(bits=12)


def _law(name: str) -> tuple[Any, Any]:
    plant = ulna.model(name).with_values()
    poles = ulna.Poles(*(-2 - k for k in range(len(plant.states))))
    return plant, ulna.state_feedback(ulna.controller_form(plant), poles)


def _arm(**options: Any) -> Loop:
    plant, law = _law("one_link_arm")
    observer = ulna.exact_observer(ulna.observer_form(plant), ulna.Poles(-9, -10, -11))
    return Loop(plant=plant, controller=ulna.compensator(law, observer), hardware=Hardware(**options))


def _hold() -> Loop:
    plant, law = _law("zak_one_link_arm")
    observer = ulna.injected_observer(ulna.observer_form(plant), ulna.Poles(-9, -10, -11))
    hardware = Hardware(period=5e-3, discretisation=ExactHold(), saturation=LIMIT)
    return Loop(plant=plant, controller=ulna.compensator(law, observer), hardware=hardware)


def _eager() -> Loop:
    plant = ulna.model("one_link_arm").with_values()
    form = ulna.controller_form(plant)
    law = ulna.state_feedback(form, ulna.Poles(-2, -3, -4, -5), reference=ulna.SetPoint(), integral=True)
    hardware = Hardware(
        period=1e-3,
        saturation=LIMIT,
        slew=SlewLimit(rate=500.0),
        delay=1.4e-3,
        drive=Pwm(frequency=2e4, supply=24.0, sag=0.1),
        anti_windup=ConditionalIntegration(states=("e1_int",)),
    )
    return Loop(plant=plant, controller=law, hardware=hardware)


def _on_states(name: str, **options: Any) -> Loop:
    plant, law = _law(name)
    return Loop(plant=plant, controller=law, hardware=Hardware(**{"period": 5e-3, **options}))


LOOPS = {
    "one_link_arm": lambda: _arm(period=1e-3, sensors=ENCODER, saturation=LIMIT, delay=1e-3),
    "one_link_arm, integral": _eager,
    "one_link_arm, battery": lambda: _arm(
        period=1e-3, delay=3.3e-3, drive=Amplifier(lower="-10 - 0.1*i", upper="10 - 0.1*i")
    ),
    "zak_one_link_arm": _hold,
    "mass_spring_damper": lambda: _on_states("mass_spring_damper", noise=MeasurementNoise(std=1e-3)),
    "duffing": lambda: _on_states("duffing", clock=(Jitter(width=2e-3), MissedSamples(probability=0.1))),
    "magnetic_levitation": lambda: _on_states("magnetic_levitation", period=1e-3),
    "strict_feedback": lambda: _on_states("strict_feedback", saturation=Saturation(lower=-2.0, upper=2.0)),
    "khalil_sine_chain": lambda: _on_states("khalil_sine_chain", sensors=Quantiser(step=0.01), delay=5e-3),
    "slotine_li_input_state": lambda: _on_states("slotine_li_input_state", slew=SlewLimit(rate=5.0)),
    "series_dc_motor": lambda: _on_states("series_dc_motor", period=1e-3, delay=4e-4),
    "two_tanks": lambda: _on_states("two_tanks"),
}


@cache
def _script(name: str) -> LoopScript:
    return loop_script(LOOPS[name](), check=10.0)


def test_ten_loops_of_the_catalogue_run_for_ten_seconds_to_the_same_bits(tmp_path: Path) -> None:
    scripts = [_script(name) for name in LOOPS]
    found = run_page(scripts, "return loops.map((loop) => loop.check());", tmp_path)
    assert [each["same"] for each in found] == [True] * len(LOOPS), dict(zip(LOOPS, found, strict=True))
    assert all(made.facts["vector"]["samples"] * made.facts["period"] > 9.99 for made in scripts)


def test_one_coefficient_that_differs_in_its_last_digit_is_noticed(tmp_path: Path) -> None:
    made = _script("zak_one_link_arm")
    head, body = made.script.split("function sense(m)")
    assert "=98.0*" in body
    changed = replace(made, script=head + "function sense(m)" + body.replace("=98.0*", " = 98.00000000000001 * ", 1))
    found = run_page(changed, "return loop.check();", tmp_path)
    assert not found["same"]
    assert found["signal"] in made.facts["vector"]["slots"]


def test_a_recorded_run_that_was_changed_is_noticed(tmp_path: Path) -> None:
    made = _script("zak_one_link_arm")
    changed = replace(made, facts=made.facts | {"vector": made.facts["vector"] | {"sum": 1}})
    assert run_page(changed, "return loop.check().same;", tmp_path) is False


@pytest.mark.skipif(GCC is None, reason="there is no gcc")
def test_a_loop_of_floats_is_the_compiled_firmware_to_the_same_bits(tmp_path: Path) -> None:
    loop = _arm(period=1e-3, sensors=ENCODER, saturation=LIMIT, arithmetic=Plain(precision=Precision.SINGLE))
    made = loop_script(loop, check=1.0)
    assert "Math.fround" in made.script
    assert run_page(made, "return loop.check();", tmp_path)["same"]


def test_a_push_of_zero_changes_no_bit(tmp_path: Path) -> None:
    loop = LOOPS["zak_one_link_arm"]()
    made = loop_script(loop, pushes=[s.name for s in loop.plant.states], check=10.0)
    assert run_page(made, "return loop.check().same;", tmp_path)
