"""`loop.step` against an independent reference in plain Python, part by part; no engine is involved."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from processor import Processor, hardware, static
from scipy.linalg import expm

from ulna.loop import (
    Amplifier,
    ConditionalIntegration,
    Discretisation,
    Euler,
    ExactHold,
    Guard,
    Loop,
    MissedSamples,
    Parts,
    Pwm,
    Quantiser,
    RungeKutta4,
    SafeOutput,
    Saturation,
    SlewLimit,
    joined,
)
from ulna.program import Plain, to_python
from ulna.system import LinearInjection, System, system_from_mapping

H = 0.01
PLANT = system_from_mapping(
    {"name": "plant", "states": {"x": "u - x"}, "inputs": {"u": {}}, "outputs": {"y": "x"}, "parameters": {}}
)
PASS = static("pass", ["r"], {"u": "r"})
FOLLOW = static("follow", ["y"], {"u": "y"})
NUMBERS = st.floats(-100, 100, allow_nan=False)


def processor(controller: Any, **parts: Any) -> Processor:
    return Processor(Loop(plant=PLANT, controller=controller, hardware=hardware(**parts)))


@given(st.lists(NUMBERS, min_size=1, max_size=8), st.floats(1e-3, 2.0), st.floats(1.0, 50.0))
@settings(deadline=None, max_examples=40)
def test_a_quantiser_rounds_to_its_nearest_step_within_its_ends(values: list[float], step: float, end: float) -> None:
    p = processor(FOLLOW, sensors=Quantiser(step=step, lower=-end, upper=end))
    for value in values:
        wanted = min(end, max(-end, step * math.floor(value * (1 / step) + 0.5)))
        assert p.sample(y0=value)["c0"] == wanted


@given(st.lists(NUMBERS, min_size=1, max_size=12), st.integers(0, 4), st.sampled_from([0.0, 0.25, 0.5]))
@settings(deadline=None, max_examples=30)
def test_a_delay_of_k_periods_is_a_shift_by_k(values: list[float], whole: int, part: float) -> None:
    p = processor(PASS, delay=(whole + part) * H)
    told = [0.0] * (whole + 1) + values
    for k, value in enumerate(values):
        s = p.sample(r0=value)
        late, early = told[k + 1], told[k] if part else told[k + 1]
        assert (s["late0"], s["early0"]) == (late, early)
        assert (s["ub0"], s.get("ua0", late)) == (late, early)
        assert s["believed0"] == pytest.approx(late + part * (early - late), abs=1e-12)


@given(st.lists(NUMBERS, min_size=1, max_size=10), st.floats(0.1, 50), st.floats(1.0, 1e4))
@settings(deadline=None, max_examples=40)
def test_slew_limit_and_saturation_cut_the_command(values: list[float], limit: float, rate: float) -> None:
    p = processor(PASS, slew=SlewLimit(rate=rate), saturation=Saturation(lower=-limit, upper=2 * limit))
    before = 0.0
    for value in values:
        wanted = min(before + rate * H, max(before - rate * H, value))
        wanted = min(2 * limit, max(-limit, wanted))
        assert p.sample(r0=value)["h0_0"] == pytest.approx(wanted, rel=1e-14, abs=1e-14)
        before = p.slots["h0_0"]


@given(NUMBERS, st.floats(0.1, 50))
@settings(deadline=None, max_examples=30)
def test_saturation_is_idempotent(value: float, limit: float) -> None:
    p = processor(PASS, saturation=Saturation(lower=-limit, upper=limit))
    once = p.sample(r0=value)["h0_0"]
    assert p.sample(r0=once)["h0_0"] == once
    assert abs(once) <= limit


# z' = −2 z + sin(y) + u and w' = z − w, read with y of two samples and the input that was applied between them.
FILTER = system_from_mapping(
    {
        "name": "filter",
        "states": {"z": "-2*z + sin(y) + u", "w": "z - w"},
        "inputs": {"y": {}, "u": {}},
        "outputs": {"z_hat": "z", "w_hat": "w"},
    }
)
LAW = static("law", ["z", "w"], {"u": "z - 3*w"})


def _parts(observer: System | LinearInjection) -> Parts:
    seen = observer.system if isinstance(observer, LinearInjection) else observer
    return Parts(system=joined(LAW, seen, name="whole"), law=LAW, observer=observer)


def _rates(z: np.ndarray, y: float, u: float) -> np.ndarray:
    return np.array([-2 * z[0] + math.sin(y) + u, z[0] - z[1]])


def _euler(z: np.ndarray, y: tuple[float, float], u: float, n: int, *, line: bool) -> np.ndarray:
    for j in range(n):
        at = y[0] + (j / n) * (y[1] - y[0]) if line else y[0]
        z = z + H / n * _rates(z, at, u)
    return z


def _runge_kutta(z: np.ndarray, y: tuple[float, float], u: float, n: int, *, line: bool) -> np.ndarray:
    h = H / n
    for j in range(n):
        a, b, c = (y[0] + (j + f) / n * (y[1] - y[0]) if line else y[0] for f in (0.0, 0.5, 1.0))
        k1 = _rates(z, a, u)
        k2 = _rates(z + h / 2 * k1, b, u)
        k3 = _rates(z + h / 2 * k2, b, u)
        z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + _rates(z + h * k3, c, u))
    return z


def _hold(z: np.ndarray, y: tuple[float, float], u: float, _: int, *, line: bool) -> np.ndarray:
    """The exact answer for w on a straight line, by a finely cut convolution."""
    F, n = np.array([[-2.0, 0.0], [1.0, -1.0]]), 400
    step, half = expm(F * H / n), expm(F * H / n / 2)
    for k in range(n):
        f = (k + 0.5) / n if line else 0.0
        sine = math.sin(y[0]) + f * (math.sin(y[1]) - math.sin(y[0]))
        z = step @ z + half @ np.array([sine + u, 0.0]) * H / n
    return z


def _injected() -> LinearInjection:
    import sympy as sp

    y, u = sp.symbols("y u", real=True)
    start = tuple(sp.symbols("z_hat w_hat", real=True))
    matrix = sp.ImmutableDenseMatrix([[-2, 0], [1, -1]])
    return LinearInjection(system=FILTER, matrix=matrix, injection=(sp.sin(y) + u, sp.Integer(0)), start=start)


@pytest.mark.parametrize(
    ("rule", "reference", "substeps", "line", "tolerance"),
    [
        (Euler(), _euler, 1, False, 1e-14),
        (Euler(substeps=3, interpolate=True), _euler, 3, True, 1e-14),
        (RungeKutta4(), _runge_kutta, 1, True, 1e-14),
        (RungeKutta4(substeps=2, interpolate=False), _runge_kutta, 2, False, 1e-14),
        (ExactHold(), _hold, 1, True, 1e-9),
        (ExactHold(interpolate=False), _hold, 1, False, 1e-9),
    ],
)
@pytest.mark.parametrize("delay", [0.0, H])
def test_an_observer_advances_as_its_rule_says(
    rule: Discretisation, reference: Any, substeps: int, line: bool, tolerance: float, delay: float
) -> None:
    observer = _injected() if isinstance(rule, ExactHold) else FILTER
    p = processor(_parts(observer), discretisation=rule, delay=delay, saturation=Saturation(lower=-1.0, upper=1.0))
    p.slots |= {"z0": 0.7, "z1": -0.4}
    z, older, believed, told = np.array([0.7, -0.4]), 0.0, 0.0, 0.0
    for k, y in enumerate([0.3, -1.2, 2.5, 2.4, -0.1]):
        if k:
            z = reference(z, (older, y), believed, substeps, line=line)
        s = p.sample(y0=y)
        np.testing.assert_allclose([s["z0"], s["z1"]], z, atol=tolerance)
        assert s["c0"] == pytest.approx(z[0] - 3 * z[1], abs=10 * tolerance)
        command = min(1.0, max(-1.0, z[0] - 3 * z[1]))
        believed, told, older = (told if delay else command), command, y
        assert s["believed0"] == pytest.approx(believed, abs=10 * tolerance)


PI = system_from_mapping(
    {
        "name": "pi",
        "states": {"e_int": "r - y"},
        "inputs": {"y": {}, "r": {}},
        "outputs": {"u": "3*(r - y) + 40*e_int"},
    }
)


def test_anti_windup_puts_back_the_integral_that_pushed_a_saturated_command_out() -> None:
    parts = {"discretisation": Euler(), "saturation": Saturation(lower=-1.0, upper=1.0)}
    p = processor(PI, anti_windup=ConditionalIntegration(states=("e_int",)), **parts)
    integral, error_before = 0.0, None
    for y, r in [(0.0, 0.2), (0.0, 2.0), (0.1, 2.0), (1.9, 2.0), (2.5, 2.0), (4.0, 2.0), (4.0, 2.0)]:
        error = r - y
        grown = integral if error_before is None else integral + H * error_before
        beyond = [max(0.0, abs(3 * error + 40 * value) - 1.0) for value in (grown, integral)]
        integral = integral if beyond[0] > beyond[1] else grown
        s = p.sample(y0=y, r0=r)
        assert s["z0"] == pytest.approx(integral, abs=1e-15)
        assert s["c0"] == pytest.approx(3 * error + 40 * integral, abs=1e-12)
        error_before = error
    wound = processor(PI, **parts)
    for _ in range(5):
        wound.sample(y0=0.0, r0=2.0)
    assert wound.slots["z0"] == pytest.approx(4 * H * 2.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_sample_that_is_not_finite_holds_command_and_memory(bad: float) -> None:
    p = processor(_parts(FILTER), saturation=Saturation(lower=-24.0, upper=24.0))
    for y in (0.1, 0.2, 0.3):
        good = p.sample(y0=y)
    assert good["fault"] == 0.0
    held = p.sample(y0=bad)
    assert math.isnan(held["fault"])
    for slot in ("z0", "z1", "yn0", "c0", "h0_0", "ub0"):
        assert held[slot] == good[slot], slot
    after = p.sample(y0=0.3)
    assert after["fault"] == 0.0
    assert all(math.isfinite(value) for value in after.values())
    assert abs(after["ub0"] - good["ub0"]) < 0.1
    # Without the guard one such sample spoils the memory for good.
    bare = processor(_parts(FILTER), saturation=Saturation(lower=-24.0, upper=24.0), guard=None)
    for y in (0.1, bad, 0.3, 0.3):
        spoiled = bare.sample(y0=y)
    assert not math.isfinite(spoiled["z0"])


def test_a_command_that_is_not_finite_is_held_or_replaced() -> None:
    root = static("root", ["y"], {"u": "sqrt(y)"})
    held = processor(root)
    assert [held.sample(y0=y)["ub0"] for y in (4.0, -1.0, 9.0)] == [2.0, 2.0, 3.0]
    safe = processor(root, guard=Guard(reaction=SafeOutput(-0.5), largest=2.5))
    assert [safe.sample(y0=y)["ub0"] for y in (4.0, -1.0, 9.0, 1.0)] == [2.0, -0.5, -0.5, 1.0]


def test_a_missed_sample_changes_nothing_but_the_delay_line() -> None:
    p = processor(_parts(FILTER), clock=MissedSamples(probability=0.5), delay=H)
    p.slots |= {"z0": 0.7}
    first, second = p.sample(y0=0.1, missed=0.0), p.sample(y0=0.2, missed=0.0)
    lost = p.sample(y0=9.0, missed=1.0)
    for slot in ("z0", "z1", "yn0", "c0"):
        assert lost[slot] == second[slot], slot
    assert (second["ub0"], lost["ub0"]) == (first["h0_0"], second["h0_0"])


@pytest.mark.parametrize("value", [0.1, 6.0, -20.0, 11.9])
def test_the_mean_of_a_bridge_is_height_times_duty(value: float) -> None:
    drive = Pwm(frequency=1000.0, supply=12.0, dead_time=2e-5, sag=0.1)
    duty = min(1.0, abs(value) / 12.0)
    mean = 12.0 * (1 - 0.1 * duty) * max(0.0, duty - 0.02)
    assert processor(PASS, drive=drive).sample(r0=value)["ub0"] == pytest.approx(math.copysign(mean, value), abs=1e-14)


def test_an_amplifier_gives_what_its_supply_allows_and_tells_the_controller() -> None:
    drive = Amplifier(lower="-cell - R*x", upper="min(9, cell - R*x)", numbers={"cell": 12.0, "R": 2.0})
    p = processor(PASS, drive=drive)
    for x, value in [(0.0, 20.0), (3.0, 20.0), (3.0, 5.0), (-1.0, -30.0)]:
        wanted = max(-12.0 - 2 * x, min(9.0, 12.0 - 2 * x, value))
        s = p.sample(r0=value, x0=x)
        assert (s["ub0"], s["believed0"], s["cut0"]) == (wanted, wanted, float(wanted != value))
    deaf = processor(PASS, drive=Amplifier(lower=drive.lower, upper=drive.upper, numbers=drive.numbers, measured=False))
    assert deaf.sample(r0=20.0, x0=0.0)["believed0"] == 20.0


def test_the_whole_step_is_its_stages_and_its_memory_all_it_keeps() -> None:
    loop = Loop(plant=PLANT, controller=_parts(FILTER), hardware=hardware(delay=1.5 * H, slew=SlewLimit(rate=50.0)))
    whole, parts = loop.step.kernel, Processor(loop)
    evaluate, memory = to_python(whole), dict.fromkeys(loop.step.memory, 0.0)
    for y in (0.3, -1.0, 2.0, 0.5):
        known = {**loop.step.numbers, **memory, "y0": y}
        found = dict(zip(whole.outputs, evaluate(*(known[name] for name in whole.inputs)), strict=True))
        stepped = parts.sample(y0=y)
        assert all(found[name] == stepped[name] for name in found)
        memory = {name: found[name] for name in memory}


def test_plain_arithmetic_agrees_with_fused_to_rounding_and_uses_no_fused_step() -> None:
    fused = processor(_parts(FILTER))
    plain = processor(_parts(FILTER), arithmetic=Plain())
    for stage, _ in plain.stages:
        assert not {"fma", "flip", "sin", "cos"} & {str(each.operation) for each in stage.instructions}
    for y in (0.3, -1.2, 2.5):
        one, other = fused.sample(y0=y), plain.sample(y0=y)
        assert one["c0"] == pytest.approx(other["c0"], abs=1e-14)
