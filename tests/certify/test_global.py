"""Claims about all runs: cascades whose errors grow too fast are refused, by the prover and by the second program."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

import ulna
from ulna.base import Status, Verdict
from ulna.certify import Certificate, GloballyStable, check, prove
from ulna.certify.cascade.growth import Growth, UnboundedError
from ulna.certify.certificate import CASCADE
from ulna.loop import Hardware, Loop, Saturation
from ulna.system import system_from_mapping


def _second_order(force: str, *, observer: bool = True, limit: float | None = None) -> Loop:
    """q'' = force(q, p) + u under an exact law, on an exact observer of q if asked for."""
    plant = system_from_mapping(
        {"name": "plant", "states": {"q": "p", "p": f"{force} + u"}, "inputs": {"u": {}}, "outputs": {"y": "q"}}
    )
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    watched = ulna.exact_observer(ulna.observer_form(plant), ulna.Poles(-8, -9))
    hardware = None if limit is None else Hardware(saturation=Saturation(lower=-limit, upper=limit))
    return Loop(plant=plant, controller=ulna.compensator(law, watched) if observer else law, hardware=hardware)


@pytest.fixture(scope="module")
def arm() -> Verdict:
    plant = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    observer = ulna.exact_observer(ulna.observer_form(plant), ulna.Poles(-20, "-10+10j", "-10-10j"))
    return prove(Loop(plant=plant, controller=ulna.compensator(law, observer)), GloballyStable())


def test_the_loop_of_the_paper_is_globally_stable(arm: Verdict) -> None:
    assert arm.status is Status.PROVED
    certificate = arm.evidence["certificate"]
    assert certificate.outer == 3
    assert check(certificate).status is Status.PROVED
    # As is right for poles at −2 ± 3.46j, −8 and −10 ± 10j, −20.
    assert 1.5 < arm.evidence["decay_rates"][0] < 2.0
    assert 8.0 < arm.evidence["decay_rates"][1] < 10.0


def test_the_bounds_of_the_slopes_hold_at_random_states(arm: Verdict) -> None:
    certificate = arm.evidence["certificate"]
    names = certificate.coordinates
    symbols = sp.symbols(names, real=True)
    read = dict(zip(names, symbols, strict=True))
    rate = sp.sympify(certificate.closed[2], locals=read)
    random = np.random.default_rng(3)
    for error in names[3:]:
        told = arm.evidence["growth"][f"∂(z3')/∂{error}"]
        text = told.replace("|", "").replace(" + ", "+").replace(" ", "*").replace("^", "**")
        slope, bound = (sp.lambdify(symbols, e) for e in (sp.diff(rate, read[error]), sp.sympify(text, locals=read)))
        for point in random.normal(size=(300, 6)) * 10.0 ** random.uniform(-2, 2, size=(300, 6)):
            # The words are rounded to four digits.
            assert abs(slope(*point)) <= 1.001 * bound(*np.abs(point))


@pytest.mark.parametrize("word", ["decay", "closed", "P", "outer"])
def test_a_changed_certificate_is_refused(arm: Verdict, word: str) -> None:
    certificate: Certificate = arm.evidence["certificate"]
    P = [list(row) for row in certificate.P]
    P[0][0] = "-" + P[0][0]
    changed: dict[str, Any] = {
        "decay": ("5", "9"),
        "closed": (*certificate.closed[:2], certificate.closed[2] + " + z1", *certificate.closed[3:]),
        "P": tuple(map(tuple, P)),
        "outer": 2,
    }
    assert check(replace(certificate, **{word: changed[word]})).status is Status.REFUTED


def test_a_law_on_the_state_needs_no_errors() -> None:
    verdict = prove(_second_order("-sin(q)", observer=False), GloballyStable())
    assert verdict.status is Status.PROVED
    assert check(verdict.evidence["certificate"]).status is Status.PROVED


@pytest.mark.parametrize(("force", "reason"), [("-q**3", "degree 2"), ("exp(q)", "grows faster"), ("q**4", "degree 3")])
def test_errors_that_may_peak_are_not_decided(force: str, reason: str) -> None:
    verdict = prove(_second_order(force), GloballyStable())
    assert verdict.status is Status.UNDECIDED
    assert reason in verdict.evidence["reason"]


def test_a_limited_loop_and_one_that_is_not_linear_are_not_decided() -> None:
    assert "limited" in prove(_second_order("-sin(q)", limit=5.0), GloballyStable()).evidence["reason"]
    plant = system_from_mapping({"name": "cubic", "states": {"x": "-x - x**3"}, "outputs": {"y": "x"}})
    verdict = prove(Loop(plant=plant, controller=None), GloballyStable())
    assert verdict.status is Status.UNDECIDED
    assert "linear" in verdict.evidence["reason"]


def test_an_unstable_loop_is_refuted() -> None:
    plant = system_from_mapping({"name": "away", "states": {"x": "x"}, "outputs": {"y": "x"}})
    assert prove(Loop(plant=plant, controller=None), GloballyStable()).status is Status.REFUTED


def _by_hand(coupling: str, **given: Any) -> Certificate:
    """w' = −w + coupling(w, e), e' = −2 e."""
    rates = (f"-w + {coupling}", "-2*e")
    whole: dict[str, Any] = {
        "name": "by hand",
        "design": "",
        "theorem": CASCADE,
        "states": ("w", "e"),
        "wires": (),
        "rates": rates,
        "limited": (),
        "lower": (),
        "upper": (),
        "coordinates": ("w", "e"),
        "forward": ("w", "e"),
        "inverse": ("w", "e"),
        "closed": rates,
        "gains": ((), ()),
        "moved_commands": (),
        "outer": 1,
        "still_closed": ("-w",),
        "still_gains": ((),),
        "still_commands": (),
        "center": ("0", "0"),
        "radii": ("1/1000000000",) * 2,
        "P": (("1", "0"), ("0", "1")),
        "level": "",
        "tree": "",
        "box": {},
        "decay": ("1/2", "1"),
    }
    return Certificate(**{**whole, **given})


@pytest.mark.parametrize(
    "coupling",
    ["w*e", "e**3*w", "sin(w)*e", "e/(1 + w**2)", "tanh(w)*w*e", "w*sin(e)", "e*sqrt(1 + w**2)", "e*w/(2 + cos(e))"],
)
def test_the_second_program_accepts_growth_in_proportion(coupling: str) -> None:
    assert check(_by_hand(coupling)).status is Status.PROVED


@pytest.mark.parametrize(
    ("coupling", "reason"),
    [
        ("w**2*e", "faster than its states"),
        ("w**3*sin(w)*e", "faster than its states"),
        ("exp(w)*e", "faster than its states"),
        ("w*sinh(w)*e", "smooth everywhere"),
        ("e/w", "divides by what is not shown to differ from 0"),
        ("e/(1 + w)", "divides by what is not shown to differ from 0"),
        ("e*sqrt(w)", "root"),
        ("e*tan(w)", "smooth everywhere"),
        ("e*log(1 + w**2)*w", "faster than its states"),
    ],
)
def test_the_second_program_refuses_growth_beyond(coupling: str, reason: str) -> None:
    answer = check(_by_hand(coupling))
    assert answer.status is Status.REFUTED
    assert reason in answer.evidence["reason"]


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"decay": ("3/2", "1")}, "decrease at the rate"),
        ({"decay": ("1/2", "5/2")}, "decrease at the rate"),
        ({"decay": ("0", "1")}, "decrease at the rate"),
        ({"decay": ("1/2",)}, "one rate for each block"),
        ({"P": (("1", "1/2"), ("1/2", "1"))}, "one rate for each block"),
        ({"wires": (("s", "1/w"),)}, "divides by what is not shown to differ from 0"),
        ({"forward": ("w**3", "e")}, "T(T"),
        ({"box": {"w": "1"}}, "limits, or a box"),
        ({"still_closed": ("-2*w",)}, "without errors differs"),
    ],
)
def test_the_second_program_refuses_every_broken_hypothesis(given: dict[str, Any], reason: str) -> None:
    answer = check(_by_hand("w*e", **given))
    assert answer.status is Status.REFUTED
    assert reason in answer.evidence["reason"]


def test_errors_that_grow_are_refused_by_the_second_program() -> None:
    growing = ("-w + w*e", "2*e")
    assert check(_by_hand("w*e", rates=growing, closed=growing)).status is Status.REFUTED


_x, _y = sp.symbols("x y", real=True)
_leaves = st.sampled_from([_x, _y, sp.Rational(1, 3), sp.Integer(2), sp.pi])
_formulas = st.recursive(
    _leaves,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] * p[1]),
        inner.map(sp.sin),
        inner.map(sp.tanh),
        inner.map(sp.asinh),
        inner.map(lambda e: e**2),
        inner.map(lambda e: 1 / (1 + e**2)),
        inner.map(lambda e: sp.sqrt(2 + e**2)),
    ),
    max_leaves=8,
)


@given(formula=_formulas, point=st.tuples(st.floats(-50, 50), st.floats(-50, 50)))
def test_ranges_and_bounds_hold(formula: sp.Expr, point: tuple[float, float]) -> None:
    _, X, Y = sp.ring("X, Y", sp.QQ)
    look = Growth(known={}, sizes={_x: X, _y: Y})
    try:
        low, high = look.range(formula)
        bound = look.bound(formula)
    except UnboundedError:
        return
    value = float(formula.evalf(30, subs=dict(zip((_x, _y), point, strict=True))))
    most = float(bound.as_expr().subs({"X": abs(point[0]), "Y": abs(point[1])}))
    assert float(low) - 1e-9 <= value <= float(high) + 1e-9
    assert abs(value) <= most * (1 + 1e-12) + 1e-12


@pytest.mark.parametrize(
    "text", ["1/x", "1/(1 + x)", "1/(x**2 - 1)", "sqrt(x)", "sqrt(x**2)", "log(x)", "log(1 + x)", "tan(x)", "acosh(x)"]
)
def test_a_formula_that_is_not_smooth_everywhere_has_no_range(text: str) -> None:
    with pytest.raises(UnboundedError):
        Growth(known={}, sizes={}).range(sp.sympify(text, locals={"x": _x}, evaluate=False))


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("1/(2 + cos(x))", Fraction(1, 3), 1),
        ("1/(-2 - x**2)", Fraction(-1, 2), 0),
        ("sin(x)*cos(x) - 1/3", Fraction(-4, 3), Fraction(2, 3)),
        ("x**2 - 1", -1, math.inf),
        ("1/(1 + exp(x))", 0, 1),
        ("log(2 + x**2)", -math.inf, math.inf),
    ],
)
def test_ranges_are_those_on_paper(text: str, low: float, high: float) -> None:
    assert Growth(known={}, sizes={}).range(sp.sympify(text, locals={"x": _x})) == (low, high)


def test_a_singular_wire_is_not_proved() -> None:
    """A law that divides by what the plant multiplies with: substituted, both are gone."""
    plant = system_from_mapping({"states": {"x": "-x + x*u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    law = system_from_mapping({"name": "law", "inputs": {"x": {}}, "outputs": {"u": "-1/x"}})
    verdict = prove(Loop(plant=plant, controller=law), GloballyStable())
    assert verdict.status is Status.UNDECIDED
