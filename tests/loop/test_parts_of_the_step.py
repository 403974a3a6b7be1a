"""Parts of the step that changing its source by hand left untested: each of these fails for one such change."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp
from processor import Processor, hardware, static
from scipy.linalg import expm

from ulna.loop import (
    Amplifier,
    ConditionalIntegration,
    Euler,
    ExactHold,
    Loop,
    MissedSamples,
    Parts,
    Quantiser,
    RungeKutta4,
    Saturation,
    SlewLimit,
    joined,
)
from ulna.loop.advance import finite
from ulna.program import Assembly, to_python
from ulna.system import LinearInjection, System, system_from_mapping

H = 0.01
PLANT = system_from_mapping({"name": "plant", "states": {"x": "u - x"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
PASS = static("pass", ["r"], {"u": "r"})
FOLLOW = static("follow", ["y"], {"u": "y"})


def processor(controller: Any, plant: System = PLANT, **parts: Any) -> Processor:
    return Processor(Loop(plant=plant, controller=controller, hardware=hardware(**parts)))


@pytest.mark.parametrize(("steps", "code"), [(0.45, 0), (0.55, 1), (-0.45, 0), (-0.55, -1), (1.5, 2), (-1.5, -1)])
def test_half_a_step_and_more_is_rounded_up(steps: float, code: int) -> None:
    assert processor(FOLLOW, sensors=Quantiser(step=0.25)).sample(y0=0.25 * steps)["c0"] == 0.25 * code


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_every_value_that_is_not_finite_is_seen(count: int) -> None:
    w = Assembly("finite")
    evaluate = to_python(w.finished({"finite": finite(w.inputs("v", count))}))
    assert evaluate(*([1.0] * count)) == (1.0,)
    for place in range(count):
        for bad in (math.nan, math.inf, -math.inf):
            values = [1.0] * count
            values[place] = bad
            assert evaluate(*values) == (0.0,)


def _system(states: dict[str, str], inputs: list[str], outputs: dict[str, str]) -> System:
    table = {"name": "c", "states": states, "inputs": {each: {} for each in inputs}, "outputs": outputs}
    return system_from_mapping(table)


def test_memory_that_would_not_be_finite_stays_where_the_command_does_not_show_it() -> None:
    p = processor(_system({"z": "sqrt(y)"}, ["y"], {"u": "y"}), discretisation=Euler())
    p.slots["z0"] = 0.5
    for y in (-1.0, -2.0):
        s = p.sample(y0=y)
    # The root of the older sample is no number; the sample is a fault, and the command of the one before is held.
    assert (s["z0"], s["c0"]) == (0.5, -1.0)
    assert math.isnan(s["fault"])


def test_what_the_first_sample_does_not_use_is_no_fault_of_it() -> None:
    # Before the first sample there is no older reference: 1/0 is computed and dropped.
    p = processor(_system({"z": "1/r - y"}, ["y", "r"], {"u": "y"}), discretisation=Euler())
    assert p.sample(y0=0.0, r0=2.0)["fault"] == 0.0
    assert p.sample(y0=0.0, r0=2.0)["z0"] == pytest.approx(H / 2)


def test_a_command_that_is_not_finite_is_told_as_a_fault() -> None:
    p = processor(static("root", ["y"], {"u": "sqrt(y)"}))
    assert p.sample(y0=4.0)["fault"] == 0.0
    assert math.isnan(p.sample(y0=-1.0)["fault"])


def test_one_command_that_is_not_finite_holds_all_of_them() -> None:
    plant = _system({"x": "u + v"}, ["u", "v"], {"y": "x"})
    p = processor(static("two", ["y"], {"u": "y", "v": "sqrt(y)"}), plant)
    p.sample(y0=4.0)
    s = p.sample(y0=-1.0)
    assert (s["c0"], s["c1"]) == (4.0, 2.0)


INTEGRAL = _system({"e": "r - y"}, ["y", "r"], {"u": "e"})


@pytest.mark.parametrize(
    ("rule", "grown"),
    [
        (Euler(substeps=2, interpolate=True), lambda r, y: r[0] - (0.75 * y[0] + 0.25 * y[1])),
        (RungeKutta4(), lambda r, y: (r[0] + r[1]) / 2 - (y[0] + y[1]) / 2),
    ],
)
def test_the_reference_is_held_by_euler_and_a_line_for_runge_kutta(rule: Any, grown: Any) -> None:
    p, r, y = processor(INTEGRAL, discretisation=rule), (1.0, 3.0), (0.2, 0.6)
    p.sample(y0=y[0], r0=r[0])
    assert p.sample(y0=y[1], r0=r[1])["z0"] == pytest.approx(H * grown(r, y), rel=1e-13)


def test_beside_an_exact_hold_integrals_of_the_law_go_by_the_trapezoid() -> None:
    names = ("z_hat", "w_hat")
    filter_ = _system({"z": "-2*z + y + u", "w": "z - w"}, ["y", "u"], dict(zip(names, ("z", "w"), strict=True)))
    y, u = sp.symbols("y u", real=True)
    observer = LinearInjection(
        system=filter_,
        matrix=sp.ImmutableDenseMatrix([[-2, 0], [1, -1]]),
        injection=(y + u, sp.Integer(0)),
        start=tuple(sp.symbols("z_hat w_hat", real=True)),
    )
    law = _system({"e": "r - z"}, ["z", "w", "r"], {"u": "0*z + 0*w + 0*e"})
    p = processor(
        Parts(system=joined(law, filter_, name="whole"), law=law, observer=observer), discretisation=ExactHold()
    )
    p.slots |= {"z0": 0.7, "z1": -0.4}
    p.sample(y0=0.0, r0=1.0)
    s = p.sample(y0=0.0, r0=5.0)
    moved = (expm(np.array([[-2.0, 0.0], [1.0, -1.0]]) * H) @ [0.7, -0.4])[0]
    assert s["z0"] == pytest.approx(moved, rel=1e-13)
    assert s["z2"] == pytest.approx(H / 2 * ((1.0 - 0.7) + (5.0 - moved)), rel=1e-12)


def test_saturation_has_the_last_word_over_the_slew_limit() -> None:
    p = processor(PASS, slew=SlewLimit(rate=100.0), saturation=Saturation(lower=-2.0, upper=2.0))
    # The drive begins with more than the processor may command.
    p.slots["h0_0"] = 10.0
    assert p.sample(r0=10.0)["h0_0"] == 2.0


def test_anti_windup_counts_every_input_that_is_beyond_its_limits() -> None:
    plant = _system({"x": "u + v"}, ["u", "v"], {"y": "x"})
    both = _system({"e": "r - y"}, ["y", "r"], {"u": "50*e", "v": "0.001*e"})
    parts = {"saturation": Saturation(lower=-1.0, upper=1.0), "discretisation": Euler()}
    p = processor(both, plant, anti_windup=ConditionalIntegration(states=("e",)), **parts)
    values = [p.sample(y0=0.0, r0=1.0)["z0"] for _ in range(6)]
    assert values == pytest.approx([0.0, H, 2 * H, 2 * H, 2 * H, 2 * H])


def test_a_missed_sample_holds_the_command_although_the_reference_moves() -> None:
    p = processor(PASS, clock=MissedSamples(probability=0.5))
    assert p.sample(r0=1.0, missed=0.0)["c0"] == 1.0
    assert p.sample(r0=5.0, missed=1.0)["c0"] == 1.0


def test_behind_a_late_amplifier_the_controller_believes_the_mean_of_what_it_gave() -> None:
    drive = Amplifier(lower="-9", upper="3")
    p = processor(PASS, drive=drive, delay=0.25 * H)
    p.sample(r0=1.0)
    s = p.sample(r0=20.0)
    assert (s["ua0"], s["ub0"]) == (1.0, 3.0)
    assert s["believed0"] == pytest.approx(0.25 * 1.0 + 0.75 * 3.0)
