"""Claims over parameters: what is proved holds at random values, what is unstable somewhere is refuted there."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

import ulna
from ulna.base import Status, Verdict
from ulna.certify import Certificate, CertifyError, Over, check, prove, read_certificate
from ulna.certify.certificate import OVER, Piece
from ulna.certify.checker.over import all_left
from ulna.certify.checker.over import characteristic as second_characteristic
from ulna.certify.over.part import all_decay, characteristic
from ulna.loop import Hardware, Loop, Saturation
from ulna.plants import arm_with_drive, preset
from ulna.studies.prosthesis.load_robust_designs import load_robust_design
from ulna.system import system_from_mapping


def _paper(limit: float | None = None) -> Loop:
    arm = ulna.model("one_link_arm")
    law = ulna.state_feedback(ulna.controller_form(arm.with_values()), ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    watched = ulna.exact_observer(ulna.observer_form(arm.with_values()), ulna.Poles(-20, "-10+10j", "-10-10j"))
    hardware = None if limit is None else Hardware(saturation=Saturation(lower=-limit, upper=limit))
    return Loop(plant=arm, controller=ulna.compensator(law, watched), hardware=hardware)


def _alone(rate: str, **bounds: Any) -> Verdict:
    """x' = rate with the parameter a."""
    plant = {"name": "alone", "states": {"x": rate}, "parameters": {"a": {"value": 1}}, "outputs": {"y": "x"}}
    return prove(Loop(plant=system_from_mapping(plant)), Over(parameters=bounds), boxes=4000)


def test_the_load_robust_loop_is_stable_at_every_load(tmp_path: Path) -> None:
    """From no load to 5 kg, a resistance 20 % off either side."""
    loop = Loop(plant=arm_with_drive(preset("paper")), controller=load_robust_design(preset("paper")).compensator)
    verdict = prove(loop, Over(parameters={"m2": (0, 5), "Ra": ("0.8", "1.2")}))
    assert verdict.status is Status.PROVED
    low, high = verdict.evidence["equilibrium"]["theta"]
    assert low <= 0 <= high < 1e-9
    certificate = verdict.evidence["certificate"]
    certificate.write(tmp_path / "over.json")
    again = read_certificate(tmp_path / "over.json")
    assert asdict(again) == asdict(certificate)
    assert check(again).status is Status.PROVED
    # At random loads every eigenvalue lies left, and rest lies in the range that is told.
    system = loop.system
    for load, resistance in np.random.default_rng(1).uniform((0, 0.8), (5, 1.2), (6, 2)):
        own = system.with_parameters({"m2": load, "Ra": resistance}).with_values()
        near, inputs = {s.name: 0 for s in own.states}, {s.name: 0 for s in own.inputs}
        rest = ulna.equilibrium(own, near=near, inputs=inputs)
        for name, (least, most) in verdict.evidence["equilibrium"].items():
            assert least - 1e-6 <= float(rest.numbers[name]) <= most + 1e-6
        slope = ulna.linearise(own, rest).A
        assert np.linalg.eigvals(np.array(slope.evalf().tolist(), dtype=float)).real.max() < 0


@pytest.fixture(scope="module")
def spring() -> Certificate:
    """A spring of unknown stiffness and load under a limited controller, from its position alone."""
    plant = system_from_mapping(
        {
            "name": "spring",
            "states": {"q": "p", "p": "load - stiffness*(q + q**3) - p + u"},
            "inputs": {"u": {}},
            "outputs": {"y": "q"},
            "parameters": {"stiffness": {"value": 2}, "load": {"value": 1}},
        }
    )
    law = system_from_mapping(
        {"name": "law", "states": {"mean": "q - 5*mean"}, "inputs": {"q": {}}, "outputs": {"u": "-q - mean"}}
    )
    loop = Loop(plant=plant, controller=law, hardware=Hardware(saturation=Saturation(lower=-2.0, upper=2.0)))
    verdict = prove(loop, Over(parameters={"stiffness": (1, 3), "load": (0, 1)}))
    assert verdict.status is Status.PROVED
    return verdict.evidence["certificate"]


def _changed(certificate: Certificate, **first: Any) -> Certificate:
    return replace(certificate, pieces=(replace(certificate.pieces[0], **first), *certificate.pieces[1:]))


SPOILED: dict[str, Any] = {
    "wider": lambda c: replace(c, parameters=(("stiffness", "0", "500"), *c.parameters[1:])),
    "upside down": lambda c: replace(c, parameters=(("stiffness", "3", "1"), *c.parameters[1:])),
    "no bounds": lambda c: replace(c, parameters=()),
    "name of a state": lambda c: replace(c, parameters=(("q", "1", "3"), *c.parameters[1:])),
    "center": lambda c: _changed(c, center=("1", *c.pieces[0].center[1:])),
    "radii": lambda c: _changed(c, radii=("1/1000000000000000", *c.pieces[0].radii[1:])),
    "radii below 0": lambda c: _changed(c, radii=tuple(f"-{r}" for r in c.pieces[0].radii)),
    "a piece less": lambda c: replace(c, pieces=c.pieces[:-1]),
    "a piece more": lambda c: replace(c, pieces=(*c.pieces, c.pieces[0])),
    "split": lambda c: replace(c, splits=c.splits.rsplit(" ", 1)[0]),
    "rate": lambda c: replace(c, rates=(c.rates[0], f"{c.rates[1]} + q", *c.rates[2:])),
    "closed": lambda c: replace(c, closed=(*c.closed[:1], f"{c.closed[1]} - 9*q", *c.closed[2:])),
    "limit": lambda c: replace(c, lower=("-1/2",), upper=("1/2",)),
    "box": lambda c: replace(c, box={"q": "1"}),
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_certificate_with_one_thing_changed_is_refused(what: str, spring: Certificate) -> None:
    assert check(spring).holds
    answer = check(SPOILED[what](spring))
    assert answer.status is Status.REFUTED
    assert answer.evidence["reason"]


def test_the_loop_of_the_paper_is_refuted_without_a_load() -> None:
    """With no load it is unstable; what is proved about the design load is told, too."""
    loop = _paper()
    verdict = prove(loop, Over(parameters={"m2": (0, 5)}))
    assert verdict.status is Status.REFUTED
    assert verdict.evidence["parameters"] == {"m2": 0.0}
    assert verdict.evidence["eigenvalue"].real > 0
    low, high = verdict.evidence["proved_within"]["m2"]
    assert high == 5
    assert 2 < low < 3
    assert prove(loop, Over(parameters={"m2": (low - 0.2, low)}), boxes=4000).status is not Status.PROVED


def test_a_load_that_no_limit_holds_is_refuted_with_what_it_takes() -> None:
    """The loop holds 5 kg with 17.64 V; a weaker limit does not reach."""
    verdict = prove(_paper(17.0), Over(parameters={"m2": (4, 5)}))
    assert verdict.status is Status.REFUTED
    (needed,) = verdict.evidence["needed"].values()
    assert abs(needed) > 17.0
    assert prove(_paper(24.0), Over(parameters={"m2": (4, 5)})).status is Status.PROVED


@pytest.mark.parametrize(
    ("rate", "bounds", "status"),
    [
        ("-x + a", (1, 2), Status.PROVED),
        ("-a*x", ("0.01", 2), Status.PROVED),
        ("-a*x", (0, 2), Status.UNDECIDED),
        ("-a*x", ("-0.1", 2), Status.REFUTED),
        ("a - x - x**3", ("-0.1", 2), Status.PROVED),
        ("a - exp(x)", (0, 2), Status.UNDECIDED),
        ("x - x/a", ("0.5", "0.9"), Status.PROVED),
        ("-x/(2 - a)", (1, 3), Status.REFUTED),
        ("-x", (1, 1), Status.PROVED),
    ],
)
def test_answers_whose_truth_is_plain_on_paper(rate: str, bounds: Any, status: Status) -> None:
    found = _alone(rate, a=bounds)
    assert found.status is status
    if status is Status.PROVED:
        assert check(found.evidence["certificate"]).status is Status.PROVED


def test_an_equilibrium_that_moves_is_enclosed() -> None:
    """a = x + x³ rests at 1 for a = 2, at 2 for a = 10."""
    low, high = _alone("a - x - x**3", a=(2, 10)).evidence["equilibrium"]["x"]
    assert 0.9 < low <= 1.0
    assert 2.0 <= high < 2.1


def _by_hand(rate: str, **changed: Any) -> Certificate:
    """One piece: x' = rate for a from 1 to 2, rest at 0."""
    whole: dict[str, Any] = {
        "name": "by hand",
        "design": "",
        "theorem": OVER,
        "states": ("x",),
        "wires": (),
        "rates": (rate,),
        "limited": (),
        "lower": (),
        "upper": (),
        "coordinates": ("x",),
        "forward": ("x",),
        "inverse": ("x",),
        "closed": (rate,),
        "gains": ((),),
        "moved_commands": (),
        "outer": 1,
        "still_closed": (),
        "still_gains": (),
        "still_commands": (),
        "center": (),
        "radii": (),
        "P": (),
        "level": "",
        "tree": "",
        "box": {},
        "decay": (),
        "parameters": (("a", "1", "2"),),
        "splits": ".",
        "pieces": (Piece(center=("0",), radii=("1/1000",)),),
    }
    return Certificate(**{**whole, **changed})


@pytest.mark.parametrize(
    ("rate", "reason"),
    [
        ("a*x", "roots on the left"),
        ("x*(a - 1/2)", "roots on the left"),
        ("x*(a - 2)", "no equilibrium"),
        ("(3/2 - a)*x", "singular"),
        ("a/5 - x", "no equilibrium"),
        ("-x**3*a", "singular"),
        ("-a*x + 1/(a - 3/2)", "NaN"),
    ],
)
def test_the_second_program_refuses_what_is_false(rate: str, reason: str) -> None:
    answer = check(_by_hand(rate))
    assert answer.status is Status.REFUTED
    assert reason in answer.evidence["reason"]


def test_the_second_program_accepts_what_is_true() -> None:
    assert check(_by_hand("-a*x")).status is Status.PROVED
    assert (
        check(_by_hand("-x + a/100000", pieces=(Piece(center=("15/1000000",), radii=("1/1000",)),))).status
        is Status.PROVED
    )
    wires = (("s", "1/a"), ("v", "-s*x"))
    assert check(_by_hand("-x/a", wires=wires, rates=("v",), parameters=(("a", "1", "3/2"),))).status is Status.PROVED
    # Over the wires the pole at 5/4 cancels; the loop is not defined there.
    hidden = (("s", "(a - 5/4)*x"), ("r", "1/(a - 5/4)"), ("v", "-s*r"))
    given: Any = {"rates": ("v",), "parameters": (("a", "1", "3/2"),)}
    assert check(_by_hand("-x", **given, wires=(("v", "-x"),))).status is Status.PROVED
    assert "has no value" in check(_by_hand("-x", **given, wires=hidden)).evidence["reason"]


@settings(max_examples=20)
@given(st.lists(st.integers(-4, 4), min_size=9, max_size=9))
def test_two_ways_to_a_characteristic_polynomial_agree(entries: list[int]) -> None:
    x = sp.Symbol("x", real=True)
    matrix = sp.Matrix(3, 3, entries) + sp.diag(sp.sin(x), x, 0)
    own = [sp.expand(c) for c in characteristic(matrix)]
    assert own == [sp.expand(c) for c in second_characteristic(matrix.tolist())]
    lam = sp.Symbol("lam")
    determinant = (lam * sp.eye(3) - matrix).det(method="berkowitz")
    assert sp.expand(determinant - lam**3 - own[0] * lam**2 - own[1] * lam - own[2]) == 0


@given(st.lists(st.floats(-3, 3), min_size=1, max_size=6), st.floats(0, 0.2))
def test_roots_on_the_left_are_seen_by_both_programs(coefficients: list[float], width: float) -> None:
    balls = [arb(c, width) for c in coefficients]
    answers = all_decay(balls), all_left(balls)
    random = np.random.default_rng(0)
    corners = [
        [c + s * width for c, s in zip(coefficients, random.choice([-1, 1], 6), strict=False)] for _ in range(40)
    ]
    worst = max(float(np.roots([1.0, *each]).real.max()) for each in corners)
    assert answers[0] == answers[1]
    if answers[0]:
        assert worst < 1e-9


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({}, "no parameter is named"),
        ({"m2": 4}, "4 is not a pair of a lower and an upper bound"),
        ({"m2": (4,)}, "is not a pair of a lower and an upper bound"),
        ({"m2": "4..5"}, "is not a pair of a lower and an upper bound"),
        ({"m2": (5, 4)}, "5 to 4 is not a range"),
        ({"m2": (0, float("inf"))}, "is not a range of finite numbers"),
    ],
)
def test_parameters_without_bounds_are_refused(parameters: Any, reason: str) -> None:
    with pytest.raises(CertifyError, match=reason):
        Over(parameters=parameters)


def test_unknown_parameters_are_refused() -> None:
    with pytest.raises(CertifyError, match="no such parameter. Known: m1, m2"):
        prove(_paper(), Over(parameters={"m3": (4, 5)}))
    bare = Loop(plant=ulna.model("one_link_arm").with_values(), controller=_paper().controller)
    with pytest.raises(CertifyError, match="none, all are numbers.*before `with_values"):
        prove(bare, Over(parameters={"m2": (4, 5)}))
