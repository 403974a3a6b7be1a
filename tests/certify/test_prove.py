"""Proofs of loops within their limits: what is proved holds, what is false is refused, certificates are checked."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ulna
from ulna.base import Status, Verdict
from ulna.certify import Certificate, CertifyError, Region, StableWithin, check, level_set, prove, read_certificate
from ulna.loop import EndStop, Hardware, Loop, Saturation
from ulna.system import System, system_from_mapping

WALL = EndStop(position="theta", velocity="omega", upper=2)


def _arm(limit: float) -> Loop:
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    return Loop(plant=arm, controller=law, hardware=Hardware(saturation=Saturation(lower=-limit, upper=limit)))


def _scalar(text: str, limit: float = 1.0, rate: str = "x + u") -> Loop:
    """An unstable state, x' = x + u, under a controller without states."""
    plant = system_from_mapping({"name": "unstable", "states": {"x": rate}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    law = system_from_mapping({"name": "law", "states": {"idle": "-idle"}, "inputs": {"x": {}}, "outputs": {"u": text}})
    return Loop(plant=plant, controller=law, hardware=Hardware(saturation=Saturation(lower=-limit, upper=limit)))


def _swing(limit: float = 8.0) -> Loop:
    plant = system_from_mapping(
        {"name": "swing", "states": {"q": "p", "p": "-sin(q) + u"}, "inputs": {"u": {}}, "outputs": {"y": "q"}}
    )
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    return Loop(plant=plant, controller=law, hardware=Hardware(saturation=Saturation(lower=-limit, upper=limit)))


BOX = {"q": 0.5, "p": 0.5}


@pytest.fixture(scope="module")
def proved() -> Verdict:
    return prove(_swing(), StableWithin(box=BOX))


def test_a_swing_converges_from_a_box_and_the_second_program_agrees(proved: Verdict, tmp_path: Path) -> None:
    assert proved.status is Status.PROVED
    assert all(proved.evidence["half_axes"][name] > size for name, size in BOX.items())
    certificate = proved.evidence["certificate"]
    certificate.write(tmp_path / "proof.json")
    again = read_certificate(tmp_path / "proof.json")
    assert asdict(again) == asdict(certificate)
    assert check(again).status is Status.PROVED


def test_no_run_from_the_proved_box_contradicts_it(proved: Verdict) -> None:
    assert proved.holds
    random = np.random.default_rng(0)
    for q, p in random.uniform(-0.5, 0.5, (20, 2)):
        run = ulna.simulate(_swing(), {"q": q, "p": p}, [0.0, 20.0])
        assert np.abs(run.states[-1]).max() < 1e-4


@pytest.mark.slow
def test_the_arm_of_the_paper_converges_from_a_radian_off_within_24_volts() -> None:
    found = prove(_arm(24.0), StableWithin(box={"theta": 1.0}))
    assert found.status is Status.PROVED
    assert found.evidence["half_axes"]["theta"] > 1.0
    assert found.evidence["equilibrium"]["i"] == pytest.approx(-17.64)
    assert check(found.evidence["certificate"]).status is Status.PROVED


SPOILED: dict[str, Any] = {
    "level": lambda c: {"level": f"{c.level.split('/')[0]}00/{(c.level + '/1').split('/')[1]}"},
    "center": lambda c: {"center": ("1/10", *c.center[1:])},
    "P": lambda c: {"P": (tuple(f"-{v}" if k == 0 else v for k, v in enumerate(c.P[0])), *c.P[1:])},
    "P not symmetric": lambda c: {"P": ((c.P[0][0], "1/7"), c.P[1])},
    "tree": lambda c: {"tree": c.tree.rsplit(" ", 1)[0]},
    "longer tree": lambda c: {"tree": c.tree + " ."},
    "rate": lambda c: {"rates": (c.rates[0], f"{c.rates[1]} + q")},
    "wire": lambda c: {"wires": tuple((n, f"{e} - q/2" if n == "u" else e) for n, e in c.wires)},
    "wire without formula": lambda c: {"wires": (*c.wires, ("more",))},
    "limited signal": lambda _: {"limited": ("w",)},
    "closed": lambda c: {"closed": (*c.closed[:-1], f"{c.closed[-1]} - z1")},
    "command": lambda c: {"moved_commands": (f"{c.moved_commands[0]} - z1",)},
    "limit": lambda _: {"upper": ("3/2",), "lower": ("-3/2",)},
    "box": lambda _: {"box": {"q": "9"}},
    "theorem": lambda _: {"theorem": "another one"},
    "radius": lambda c: {"radii": ("0", *c.radii[1:])},
    "level below 0": lambda _: {"level": "-1"},
    "inverse": lambda c: {"inverse": (f"2*({c.inverse[0]})", *c.inverse[1:])},
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_certificate_with_one_thing_changed_is_refused(what: str, proved: Verdict) -> None:
    certificate = proved.evidence["certificate"]
    answer = check(replace(certificate, **SPOILED[what](certificate)))
    assert answer.fails
    assert answer.evidence["reason"]


def test_a_region_is_as_wide_as_it_can_be() -> None:
    """x' = x + u with |u| ≤ 1: from |x| < 1 the input can hold it, from beyond nothing can."""
    found = prove(_scalar("-3*x"), Region())
    assert found.status is Status.PROVED
    assert 0.7 < found.evidence["half_axes"]["x"] < 1.0
    assert check(found.evidence["certificate"]).status is Status.PROVED


PUBLISHED: dict[str, tuple[dict[str, str], str, float, float]] = {
    "cubic": ({"x": "-x + x**3"}, "x", 0.95, 1.0),
    "two machines": ({"x1": "x2", "x2": "-x2/2 - sin(x1 + pi/3) + sin(pi/3)"}, "x1", 0.9, np.pi / 3),
    "van der Pol, reversed": ({"x1": "-x2", "x2": "x1 - (1 - x1**2)*x2"}, "x1", 1.3, 2.01),
}
"""Rates, a state, the half-axis that is at least due, and where the region of attraction ends along this state.

x' = −x + x³ and van der Pol's equation are tests of Drake (level 1, and 2.3 of xᵀPx with AᵀP + PA = −1). The machines
are the two-machine system of power engineering, damping 1/2, rotor angle π/3: another equilibrium lies π/3 off.
"""


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_regions_are_reached(name: str) -> None:
    states, state, least, end = PUBLISHED[name]
    loop = Loop(plant=system_from_mapping({"name": name, "states": states, "outputs": {"y": state}}))
    found = prove(loop, Region())
    assert found.status is Status.PROVED
    assert least < found.evidence["half_axes"][state] < end
    certificate = found.evidence["certificate"]
    assert check(certificate).status is Status.PROVED
    if name == "van der Pol, reversed":
        region = level_set(certificate)
        area = np.pi * region.level / np.sqrt(np.linalg.det(region.P))
        # 2.3 of [[1.5, -0.5], [-0.5, 1]], less what the search leaves over.
        assert 0.94 < area / (np.pi * 2.3 / np.sqrt(1.25)) < 1.05
    # The search counts boxes, not seconds.
    assert asdict(prove(loop, Region()).evidence["certificate"]) == asdict(certificate)


def test_a_box_beyond_what_the_limit_can_hold_is_refuted_by_a_run() -> None:
    found = prove(_scalar("-3*x"), StableWithin(box={"x": 1.5}))
    assert found.fails
    assert abs(found.evidence["start"]["x"]) == 1.5
    assert abs(found.evidence["end"]["x"]) > 10


def test_a_run_that_is_only_slow_refutes_nothing() -> None:
    """x' = u with |u| ≤ 1 converges from everywhere, but from far off it takes long."""
    loop = _scalar("-3*x", rate="u")
    assert prove(loop, StableWithin(box={"x": 1000.0}), boxes=4000).status is not Status.REFUTED


def test_a_run_that_rests_elsewhere_refutes() -> None:
    """x' = −x + x³/4 + 0·u rests at ±2, too."""
    found = prove(_scalar("0*x", rate="-x + x**3/4 + u"), StableWithin(box={"x": 2.0}), boxes=4000)
    assert found.fails
    assert abs(found.evidence["end"]["x"]) == pytest.approx(2.0)


def test_a_box_within_is_proved() -> None:
    found = prove(_scalar("-3*x"), StableWithin(box={"x": 0.5}))
    assert found.status is Status.PROVED
    assert check(found.evidence["certificate"]).status is Status.PROVED


def _exact_loop(rates: dict[str, str]) -> Loop:
    """A plant under an exact law on its states, without limits."""
    plant = system_from_mapping(
        {"name": "plant", "states": rates, "inputs": {"u": {}}, "outputs": {"y": next(iter(rates))}}
    )
    return Loop(plant=plant, controller=ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3)))


SINGULAR = {
    "law": ({"a": "b", "b": "(1 + a)*u"}, "a", 1.0),
    "pole of the plant": ({"a": "b", "b": "u/(2 - a)"}, "a", 2.0),
    "range of the coordinates": ({"a": "sin(b)", "b": "u"}, "b", np.pi / 2),
    "root": ({"a": "b", "b": "sqrt(1 + a)*u"}, "a", 1.0),
}
"""Rates, the state and how far from 0 the loop stops being defined: an exact law cancels that out of the formulas."""


@pytest.mark.parametrize("kind", SINGULAR)
def test_no_region_reaches_where_the_loop_is_not_defined(kind: str) -> None:
    rates, state, edge = SINGULAR[kind]
    loop = _exact_loop(rates)
    found = prove(loop, Region())
    assert found.status is Status.PROVED
    assert 0.1 * edge < found.evidence["half_axes"][state] < edge
    assert check(found.evidence["certificate"]).status is Status.PROVED
    assert prove(loop, StableWithin(box={state: 1.1 * edge}), boxes=4000).status is not Status.PROVED


@pytest.mark.parametrize("kind", ["law", "pole of the plant"])
def test_the_second_program_refuses_a_level_beyond_where_the_loop_is_defined(kind: str) -> None:
    certificate = prove(_exact_loop(SINGULAR[kind][0]), Region()).evidence["certificate"]
    wider = replace(certificate, level=str(4 * Fraction(certificate.level)), tree=".")
    assert check(wider).fails
    # The rates alone are linear: with the wires substituted into them the same level passes.
    substituted = tuple(rate.replace("z1", "a").replace("z2", "b") for rate in wider.closed)
    assert check(replace(wider, wires=(), rates=substituted)).holds


def test_limits_belong_to_their_own_signals_and_one_side_may_be_open() -> None:
    plant = system_from_mapping(
        {
            "name": "two",
            "states": {"p": "p + u1", "q": "q + u2"},
            "inputs": {"u1": {}, "u2": {}},
            "outputs": {"y1": "p", "y2": "q"},
        }
    )
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -2))
    limits = {"u2": Saturation(lower=-5.0, upper=np.inf), "u1": Saturation(lower=-0.5, upper=0.5)}
    found = prove(Loop(plant=plant, controller=law, hardware=Hardware(saturation=limits)), Region())
    assert found.status is Status.PROVED
    assert 0.1 < found.evidence["half_axes"]["p"] < 0.5
    assert check(found.evidence["certificate"]).status is Status.PROVED


def test_limits_without_a_controller_are_refused() -> None:
    loop = Loop(plant=_swing().plant, hardware=Hardware(saturation=Saturation(lower=-1.0, upper=1.0)))
    with pytest.raises(CertifyError, match="no controller commands what they limit"):
        prove(loop, Region())


def test_an_unstable_loop_is_refuted_with_its_eigenvalue() -> None:
    found = prove(_scalar("3*x"), Region())
    assert found.fails
    assert found.evidence["eigenvalue"] == pytest.approx(4.0)


def test_a_limit_below_what_holding_needs_is_refuted_with_that_number() -> None:
    found = prove(_arm(17.0), Region())
    assert found.fails
    assert found.evidence["needed"]["u"] == pytest.approx(-17.64)


def test_a_compensator_is_proved_with_its_estimates() -> None:
    swing = _swing()
    observer = ulna.exact_observer(ulna.observer_form(swing.plant), ulna.Poles(-8, -9))
    whole = Loop(plant=swing.plant, controller=ulna.compensator(swing.controller, observer), hardware=swing.hardware)
    found = prove(whole, Region())
    assert found.status is Status.PROVED
    assert set(found.evidence["half_axes"]) == {"q", "p", "q_hat", "p_hat"}
    assert check(found.evidence["certificate"]).status is Status.PROVED


def test_references_are_held_where_they_are_told() -> None:
    plant = system_from_mapping(
        {"name": "tank", "states": {"h": "u - h**3"}, "inputs": {"u": {}}, "outputs": {"y": "h"}}
    )
    law = system_from_mapping(
        {
            "name": "law",
            "states": {"total": "h_ref - h"},
            "inputs": {"h": {}, "h_ref": {}},
            "outputs": {"u": "2*(h_ref - h) + total"},
        }
    )
    found = prove(Loop(plant=plant, controller=law), Region(), inputs={"h_ref": 1})
    assert found.status is Status.PROVED
    assert found.evidence["equilibrium"] == pytest.approx({"h": 1.0, "total": 1.0})


@pytest.mark.parametrize(
    ("loop", "claim", "reason"),
    [
        (lambda: replace_hardware(_arm(24.0), Hardware(period=1e-3)), Region(), "it runs on a processor"),
        (lambda: _scalar("-3*abs(x)"), Region(), "Abs is not smooth"),
        (lambda: _arm(24.0), StableWithin(box={"phi": 1.0}), "the loop has no such state. Known: theta, omega, i"),
        (
            lambda: replace_hardware(
                _arm(24.0), Hardware(end_stops=(EndStop(position="theta", velocity="omega", upper=2),))
            ),
            Region(),
            "it has end stops",
        ),
    ],
)
def test_what_no_theorem_speaks_of_is_refused(loop: Any, claim: Any, reason: str) -> None:
    with pytest.raises(CertifyError, match=reason.replace(".", r"\.")):
        prove(loop(), claim)


def replace_hardware(loop: Loop, hardware: Hardware) -> Loop:
    return Loop(plant=loop.plant, controller=loop.controller, hardware=hardware)


def test_symbols_without_a_value_are_refused() -> None:
    arm: System = ulna.model("one_link_arm")
    bare = replace(arm, parameters=tuple(replace(p, value=None) for p in arm.parameters))
    with pytest.raises(CertifyError, match="parameters without a value"):
        prove(Loop(plant=bare, controller=_arm(24.0).controller), Region())


def test_claims_that_say_nothing_are_refused() -> None:
    with pytest.raises(CertifyError, match="the box is empty"):
        StableWithin(box={})
    with pytest.raises(CertifyError, match="expected a finite number of at least 0"):
        StableWithin(box={"x": float("nan")})
    with pytest.raises(CertifyError, match="is not a positive number"):
        Region(scale={"x": 0.0})


def test_files_that_are_no_certificates_are_refused(proved: Verdict, tmp_path: Path) -> None:
    path = tmp_path / "proof.json"
    proved.evidence["certificate"].write(path)
    whole = path.read_text()
    for text, reason in (
        (whole[: len(whole) // 2], "not JSON"),
        ("[]", "not of format"),
        (whole.replace('"format": 4', '"format": 3'), "not of format 4"),
        (json.dumps({**json.loads(whole), "P": 3}), "changed since it was written"),
    ):
        path.write_text(text)
        with pytest.raises(CertifyError, match=reason):
            read_certificate(path)
    with pytest.raises(CertifyError, match="cannot be read"):
        read_certificate(tmp_path / "nowhere")


def test_text_in_a_certificate_is_data(proved: Verdict, tmp_path: Path) -> None:
    certificate: Certificate = proved.evidence["certificate"]
    evil = f"__import__('pathlib').Path('{tmp_path}/owned').touch()"
    answer = check(replace(certificate, rates=(evil, *certificate.rates[1:])))
    assert answer.fails
    assert not (tmp_path / "owned").exists()


def test_a_loop_of_difference_equations_is_refused() -> None:
    given = {"name": "filter", "time": "discrete", "period": 0.1, "states": {"x": "x/2"}, "outputs": {"y": "x"}}
    with pytest.raises(CertifyError, match="difference equations"):
        prove(Loop(plant=system_from_mapping(given), controller=None), Region())
