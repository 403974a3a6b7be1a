"""The second program on certificates made by hand, whose truth is plain on paper."""

from __future__ import annotations

from typing import Any

import mpmath
import pytest
import sympy as sp
from flint import arb

from ulna.base import Status
from ulna.certify import Certificate, check
from ulna.certify.certificate import THEOREM
from ulna.certify.checker.arithmetic import Dual, dual
from ulna.certify.region.limited import SMOOTH


def _certificate(**given: Any) -> Certificate:
    """x' = −x with V = x² ≤ 1, in its own states unless told otherwise."""
    names = given.get("states", ("x",))
    n = len(names)
    whole: dict[str, Any] = {
        "name": "by hand",
        "design": "",
        "theorem": THEOREM,
        "states": names,
        "wires": (),
        "rates": ("-x",),
        "limited": (),
        "lower": (),
        "upper": (),
        "coordinates": names,
        "forward": names,
        "inverse": names,
        "closed": given.get("rates", ("-x",)),
        "gains": ((),) * n,
        "moved_commands": (),
        "outer": n,
        "still_closed": (),
        "still_gains": (),
        "still_commands": (),
        "center": ("0",) * n,
        "radii": ("1/1000000000",) * n,
        "P": tuple(tuple("1" if i == j else "0" for j in range(n)) for i in range(n)),
        "level": "1",
        "tree": ".",
        "box": {},
        "decay": (),
    }
    return Certificate(**{**whole, **given})


def _refused(reason: str, **given: Any) -> None:
    answer = check(_certificate(**given))
    assert answer.status is Status.REFUTED
    assert reason in answer.evidence["reason"]


def test_a_decaying_state_is_right() -> None:
    assert check(_certificate()).status is Status.PROVED
    assert check(_certificate(box={"x": "99/100"})).status is Status.PROVED


def test_a_growing_state_is_not() -> None:
    _refused("V is not proved to decrease", rates=("x",))


@pytest.mark.parametrize(("level", "right"), [("95/100", True), ("105/100", False)])
def test_a_level_just_beyond_an_unstable_rest_is_refused(level: str, right: bool) -> None:
    """x' = −x + x³ rests at ±1, too."""
    assert check(_certificate(rates=("-x + x**3",), level=level)).holds is right


def test_a_box_just_wider_than_the_level_is_refused() -> None:
    _refused("the claimed box is not in the level set", box={"x": "101/100"})


def test_coordinates_must_come_back() -> None:
    """z = 2x and x = z are not each other's inverse, though every rate agrees."""
    _refused(
        "T(T⁻¹(ζ)) is not ζ", coordinates=("z",), forward=("2*x",), inverse=("z",), closed=("-2*z",), level="1/100"
    )


def test_an_equilibrium_must_be_there_and_alone() -> None:
    _refused("the Jacobian at the equilibrium, is singular", rates=("-x**3",))
    _refused("no equilibrium is proved", rates=("-x - 1/1000",))


@pytest.mark.parametrize(("limit", "right"), [("3", True), ("1", False)])
def test_no_limit_is_met_at_the_equilibrium(limit: str, right: bool) -> None:
    """x' = s − 2 with s = 2 − x: holding takes 2."""
    given: dict[str, Any] = {"wires": (("s", "2 - x"),), "rates": ("s - 2",), "closed": ("-x",), "gains": (("1",),)}
    given |= {"limited": ("s",), "lower": (f"-{limit}",), "upper": (limit,), "moved_commands": ("2 - x",)}
    answer = check(_certificate(**given, level="1/4"))
    assert answer.holds is right
    if not right:
        assert "a limit is met there" in answer.evidence["reason"]


def _with_error(**given: Any) -> dict[str, Any]:
    """w' = −w + e, e' = −e with V = w² + e² ≤ 1."""
    whole: dict[str, Any] = {"states": ("w", "e"), "rates": ("-w + e", "-e"), "outer": 1}
    return {**whole, "still_closed": ("-w",), "still_gains": ((),), **given}


def test_a_state_driven_by_a_decaying_error_is_right() -> None:
    assert check(_certificate(**_with_error())).status is Status.PROVED


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"rates": ("-w + 3*e", "-e")}, "V is not proved to decrease"),
        ({"rates": ("-w + e", "e")}, "the errors' part of V does not decrease"),
        ({"rates": ("-w + e", "-e - e**3")}, "the errors are not linear"),
        ({"rates": ("-w + e", "-e - w/9")}, "the errors are not linear"),
        ({"still_closed": ("-2*w",)}, "the loop without errors differs"),
        ({"P": (("1", "1/9"), ("1/9", "1"))}, "P is not block diagonal"),
        ({"center": ("0", "1/9")}, "no equilibrium is proved"),
    ],
)
def test_errors_that_are_none_are_refused(given: dict[str, Any], reason: str) -> None:
    _refused(reason, **_with_error(**given))


def test_an_error_of_the_largest_coupling_that_falls_is_right() -> None:
    """−w² + 2·c·w·e/2 − e² is negative definite for c < 2."""
    assert check(_certificate(**_with_error(rates=("-w + 19/10*e", "-e")))).holds
    _refused("V is not proved to decrease", **_with_error(rates=("-w + 21/10*e", "-e")))


@pytest.mark.parametrize(("level", "right"), [("1/100", True), ("1", False)])
def test_a_coupling_that_grows_with_the_state_counts_away_from_the_equilibrium(level: str, right: bool) -> None:
    """w' = −w + 8 w² e: at w = e = 0.7 half of V' is 0.9."""
    assert check(_certificate(**_with_error(rates=("-w + 8*w**2*e", "-e"), level=level))).holds is right


@pytest.mark.parametrize("function", SMOOTH)
def test_values_and_derivatives_are_those_of_the_functions(function: Any) -> None:
    x = sp.Symbol("x", real=True)
    at = sp.Rational(17, 10) if function is sp.acosh else sp.Rational(3, 10)
    found = dual(function(x), {x: Dual(arb(int(at.p)) / int(at.q), [arb(1)])}, {})
    with mpmath.workdps(15):
        value, slope = (sp.N(e.subs(x, at), 15) for e in (function(x), sp.diff(function(x), x)))
    assert float(found.value.mid()) == pytest.approx(float(value), rel=1e-13)
    assert float(found.slope[0].mid()) == pytest.approx(float(slope), rel=1e-13)


@pytest.mark.parametrize("power", [-2, -1, 2, 3, 5, sp.Rational(1, 2), sp.Rational(-3, 2)])
def test_powers_have_their_derivatives(power: Any) -> None:
    x = sp.Symbol("x", real=True)
    found = dual(x**power, {x: Dual(arb(7) / 10, [arb(1)])}, {})
    assert float(found.value.mid()) == pytest.approx(0.7 ** float(power), rel=1e-13)
    assert float(found.slope[0].mid()) == pytest.approx(float(power) * 0.7 ** (float(power) - 1), rel=1e-13)
