"""Bounds of loops on their processor: what is proved holds in simulation, what is false or too coarse is refused."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from flint import arb

import ulna
from ulna.base import Status, Verdict
from ulna.certify import (
    CertifyError,
    ChangedError,
    SampledCertificate,
    StableWithin,
    UltimateBound,
    check,
    prove,
    read_certificate,
)
from ulna.certify.processor.decay_sums import decay_sums
from ulna.certify.processor.period_map import period_map
from ulna.loop import EndStop, Hardware, Jitter, Loop, MeasurementNoise, Pwm, Quantiser, Saturation
from ulna.page.region import region_of
from ulna.program import tangents, to_numpy
from ulna.system import system_from_mapping

STEP = 2.0**-10
BOX = {"q": 0.1, "p": 0.1}


def _swing(**given: Any) -> Loop:
    """A pendulum held by its law on measured states, 10 ms and 4 ms late."""
    plant = system_from_mapping(
        {"name": "swing", "states": {"q": "p", "p": "-sin(q) + u"}, "inputs": {"u": {}}, "outputs": {"y": "q"}}
    )
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    whole: dict[str, Any] = {
        "period": 0.01,
        "delay": 0.004,
        "sensors": Quantiser(step=STEP),
        "saturation": Saturation(lower=-8.0, upper=8.0),
    }
    return Loop(plant=plant, controller=law, hardware=Hardware(**whole | given))


@pytest.fixture(scope="module")
def proved() -> Verdict:
    return prove(_swing(), UltimateBound(box=BOX))


def test_runs_end_within_what_the_encoder_leaves_open_and_the_second_program_agrees(
    proved: Verdict, tmp_path: Path
) -> None:
    assert proved.status is Status.PROVED
    assert proved.evidence["starts_within"] == BOX
    assert 0 < proved.evidence["ends_within"]["q"] < 5 * STEP
    certificate = proved.evidence["certificate"]
    certificate.write(tmp_path / "proof.json")
    again = read_certificate(tmp_path / "proof.json")
    assert asdict(again) == asdict(certificate)
    assert check(again).status is Status.PROVED


def test_a_page_draws_the_box_in_which_runs_start(proved: Verdict) -> None:
    drawn = region_of(proved.evidence["certificate"], _swing().plant)
    [outline] = drawn["outlines"]
    points = np.array(outline["points"])
    center = np.array([drawn["rest"][name] for name in (outline["x"], outline["y"])])
    assert np.abs(points - center).max(axis=0) == pytest.approx(list(BOX.values()))


def test_no_run_contradicts_it(proved: Verdict) -> None:
    """The processor's own program, beside a plant written here."""
    loop, found = _swing(), proved.evidence
    step, numbers = loop.step.kernel, loop.step.numbers
    program = to_numpy(step)
    q, p = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 300)) * np.array(list(BOX.values()))[:, None]
    slots: dict[str, Any] = dict.fromkeys(step.inputs, np.zeros(300)) | dict(numbers)
    for k in range(1200):
        slots |= {"y0": q, "y1": p, "begun": np.full(300, float(k > 0))}
        slots |= dict(zip(step.outputs, program(*(slots[name] for name in step.inputs)), strict=True))
        for length, slot in ((0.004, "early0"), (0.006, "late0")):
            for _ in range(2):
                q, p = _pendulum_moved(q, p, slots[slot], length / 2)
        far = k >= 1000
        for name, path in (("q", q), ("p", p)):
            assert np.abs(path).max() <= (found["ends_within"] if far else found["stays_within"])[name]
    # The bound is no empty one: an encoder makes a loop wander.
    assert np.abs(q).max() > 0.05 * found["ends_within"]["q"]


def _pendulum_moved(q: np.ndarray, p: np.ndarray, u: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """One Runge-Kutta step."""

    def rate(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return b, u - np.sin(a)

    k1 = rate(q, p)
    k2 = rate(q + h / 2 * k1[0], p + h / 2 * k1[1])
    k3 = rate(q + h / 2 * k2[0], p + h / 2 * k2[1])
    k4 = rate(q + h * k3[0], p + h * k3[1])
    q, p = (x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip((q, p), k1, k2, k3, k4, strict=True))
    return q, p


def test_the_bound_follows_the_step_of_the_encoder(proved: Verdict) -> None:
    finer = prove(_swing(sensors=Quantiser(step=STEP / 4)), UltimateBound(box=BOX))
    ratio = proved.evidence["ends_within"]["q"] / finer.evidence["ends_within"]["q"]
    assert ratio == pytest.approx(4.0, rel=0.02)


def test_without_a_box_the_largest_is_found() -> None:
    found = prove(_swing(), UltimateBound())
    assert found.status is Status.PROVED
    assert 0.1 < found.evidence["starts_within"]["q"] < 1.0


def test_the_arm_of_the_paper_on_its_processor_ends_within_a_tenth_of_a_degree() -> None:
    """1 kHz, ±24 V, an encoder of 12 bits, estimator by Runge-Kutta steps."""
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    observer = ulna.exact_observer(ulna.observer_form(arm), ulna.Poles(-20, "-10+10j", "-10-10j"))
    hardware = Hardware(period=1e-3, sensors=Quantiser.encoder(bits=12), saturation=Saturation(lower=-24.0, upper=24.0))
    loop = Loop(plant=arm, controller=ulna.compensator(law, observer), hardware=hardware)
    found = prove(loop, UltimateBound(box={"theta": 0.01}))
    assert found.status is Status.PROVED
    assert found.evidence["equilibrium"]["i"] == pytest.approx(-17.64)
    assert math.degrees(found.evidence["ends_within"]["theta"]) < 0.1
    assert check(found.evidence["certificate"]).status is Status.PROVED
    weak = replace(loop, hardware=replace(hardware, saturation=Saturation(lower=-17.0, upper=17.0)))
    refused = prove(weak, UltimateBound())
    assert refused.fails
    assert refused.evidence["needed"]["u"] == pytest.approx(-17.64)


def test_what_is_not_so_is_not_proved() -> None:
    slow = prove(_swing(period=1.2, delay=0.0), UltimateBound(box=BOX))
    assert slow.status is Status.UNDECIDED
    assert slow.evidence["largest_eigenvalue"] > 1
    coarse = prove(_swing(sensors=Quantiser(step=2.0)), UltimateBound())
    assert coarse.status is Status.UNDECIDED
    assert coarse.evidence["half_steps"]["q"] == 1.0
    assert "steps of the sensors" in coarse.evidence["reason"]
    wide = prove(_swing(), UltimateBound(box={"q": 20.0}))
    assert wide.status is Status.UNDECIDED
    assert 0.1 < wide.evidence["proved_box"]["q"] < 20.0
    # Beyond ±1 the converter shows its end.
    narrow = Quantiser(step=STEP, lower=-0.05, upper=0.05)
    assert prove(_swing(sensors=narrow), UltimateBound(box=BOX)).status is Status.UNDECIDED


def _digit(table: tuple[tuple[str, ...], ...], factor: float) -> tuple[tuple[str, ...], ...]:
    return ((str(int(int(table[0][0]) * factor)), *table[0][1:]), *table[1:])


def _smaller(box: tuple[str, ...]) -> tuple[str, ...]:
    return (str(Fraction(box[0]) * Fraction(4, 5)), *box[1:])


SPOILED: dict[str, Any] = {
    "matrix": lambda c: {"matrix": _digit(c.matrix, 1.01)},
    "injection": lambda c: {"injection": tuple(tuple(f"{int(v) + 2**55}" for v in row) for row in c.injection)},
    "powers": lambda _: {"powers": "3"},
    "powers beyond": lambda _: {"powers": "9999999"},
    "center": lambda c: {"center": ("1/10", *c.center[1:])},
    "scale": lambda c: {"scale": ("-1", *c.scale[1:])},
    "start": lambda c: {"start": ("1", *c.start[1:])},
    "first box": lambda c: {"boxes": (_smaller(c.boxes[0]), *c.boxes[1:])},
    "last box": lambda c: {"boxes": (*c.boxes[:-1], _smaller(c.boxes[-1]))},
    "no box": lambda _: {"boxes": ()},
    "box of zero": lambda c: {"boxes": (*c.boxes, tuple("0" for _ in c.boxes[0]))},
    "rate": lambda c: {"rates": (c.rates[0], f"{c.rates[1]} + 5*q")},
    "reading": lambda c: {"readings": (f"2*{c.readings[0]}", *c.readings[1:])},
    "half step": lambda c: {"half_steps": ("1/100", *c.half_steps[1:])},
    "sensor's end": lambda c: {"upper": ("1/100", *c.upper[1:])},
    "program": lambda c: {"program": tuple((n, "0" if n == "late0_new" else t) for n, t in c.program)},
    "first sample": lambda c: {"first": tuple((n, "50" if n == "late0_new" else t) for n, t in c.first)},
    "open slot": lambda c: {"program": c.program[:-1]},
    "stretch": lambda c: {"stretches": (("1/2", *c.stretches[0][1:]), *c.stretches[1:])},
    "stretch before": lambda c: {"stretches": (("-1/200", *c.stretches[0][1:]), *c.stretches[1:])},
    "theorem's rows": lambda c: {"matrix": c.matrix[1:]},
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_certificate_with_one_thing_changed_is_refused(what: str, proved: Verdict) -> None:
    certificate: SampledCertificate = proved.evidence["certificate"]
    answer = check(replace(certificate, **SPOILED[what](certificate)))
    assert answer.fails
    assert answer.evidence["reason"]


def test_a_file_with_one_digit_changed_is_refused(proved: Verdict, tmp_path: Path) -> None:
    path = tmp_path / "proof.json"
    proved.evidence["certificate"].write(path)
    text = path.read_text()
    places = [k for k, character in enumerate(text) if character.isdigit()]
    for place in np.random.default_rng(0).choice(places, 20):
        path.write_text(text[:place] + ("1" if text[place] != "1" else "2") + text[place + 1 :])
        with pytest.raises(ChangedError if '"format"' not in text[:place].rsplit("\n", 1)[-1] else CertifyError):
            read_certificate(path)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"noise": MeasurementNoise(std=0.01)}, "noise, which has no largest value"),
        ({"drive": Pwm(supply=24.0, frequency=1000.0)}, "a drive other than the voltage itself"),
        ({"clock": Jitter(width=1e-3)}, "a clock that jitters"),
        ({"end_stops": (EndStop(position="q", velocity="p", upper=1.0),)}, "end stops"),
    ],
)
def test_hardware_that_the_theorem_does_not_speak_of_is_refused(given: dict[str, Any], reason: str) -> None:
    with pytest.raises(CertifyError, match=reason):
        prove(_swing(**given), UltimateBound())


def test_mistakes_are_told() -> None:
    with pytest.raises(CertifyError, match="it has no processor"):
        prove(Loop(plant=_swing().plant, controller=_swing().controller), UltimateBound())
    with pytest.raises(CertifyError, match=r"no such state. Known: q, p"):
        prove(_swing(), UltimateBound(box={"angle": 1.0}))
    with pytest.raises(CertifyError, match=r"Claim UltimateBound\(\)"):
        prove(_swing(), StableWithin(box=BOX))
    with pytest.raises(CertifyError, match="expected a finite number of at least 0"):
        UltimateBound(box={"q": math.nan})


# ------------------------------------------------------------------------------------------------------ the parts


def test_sums_of_powers_are_bounds() -> None:
    one = decay_sums(np.array([[0.75]]), np.array([[-2.0]]))
    assert one is not None
    assert 4.0 <= one.total[0, 0] < 4.01
    assert 8.0 <= one.pushed[0, 0] < 8.02
    assert decay_sums(np.array([[1.0]]), np.zeros((1, 0))) is None
    A, B = la.expm(np.array([[0.0, 0.1], [-0.3, -0.2]])), np.ones((2, 1))
    found, powers = decay_sums(A, B), [np.linalg.matrix_power(A, k) for k in range(2000)]
    assert found is not None
    for bound, truth in (
        (found.total, sum(np.abs(P) for P in powers)),
        (found.largest, np.max(np.abs(powers), axis=0)),
        (found.pushed, sum(np.abs(P @ B) for P in powers)),
    ):
        assert (truth <= bound).all()
        assert (bound <= 1.01 * truth).all()


def test_a_period_encloses_what_its_plant_and_its_program_do() -> None:
    """A linear plant against the matrix exponential, the program's slopes against those of the kernel."""
    plant = system_from_mapping(
        {"name": "lag", "states": {"a": "b", "b": "-4*a - b + 3*u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}}
    )
    law = system_from_mapping(
        {"name": "law", "states": {"s": "y - s"}, "inputs": {"y": {}}, "outputs": {"u": "-y - s"}}
    )
    found = period_map(Loop(plant=plant, controller=law, hardware=Hardware(period=0.1)), {})
    point = [0.3, -0.2, *(0.1 * k for k in range(len(found.memory)))]
    values, slopes = found.moved([arb(v) for v in point], [arb(0)])
    slots = dict(zip(found.memory, point[2:], strict=True)) | {"y0": point[0]}
    done = dict(zip(found.step.outputs, to_numpy(found.step)(*(slots[n] for n in found.step.inputs)), strict=True))
    u, F = float(done["late0"]), la.expm(0.1 * np.array([[0.0, 1.0, 0.0], [-4.0, -1.0, 3.0], [0.0, 0.0, 0.0]]))
    for value, truth in zip(values[:2], F[:2] @ [*point[:2], u], strict=True):
        assert value.contains(arb(truth, 1e-12))
    turned = tangents(found.step, ["y0"], piecewise=True)
    by_y = dict(zip(turned.outputs, to_numpy(turned)(*(slots[n] for n in turned.inputs)), strict=True))
    for i in range(2):
        expected = F[i, 0] + F[i, 2] * float(by_y["late0/y0"])
        assert abs(float(slopes[i][0].mid()) - expected) < 1e-9
        assert float(slopes[i][0].rad()) < 1e-7
