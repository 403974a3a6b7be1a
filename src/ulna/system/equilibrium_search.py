"""`equilibrium`: where a system rests, at the point its file asks for or near another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ulna.base import PlantError, Verdict
from ulna.symbolic.exact import SampledZero, is_zero
from ulna.symbolic.formulas import put_in
from ulna.system.equilibrium_point import Equilibrium, PointLike, as_point
from ulna.system.holder import SystemLike, as_system
from ulna.system.operating_point import (
    AS_GIVEN,
    NEWTON,
    SOLVED,
    TooHardError,
    given_values,
    known_signs,
    nearest_solution,
    operating_point,
    rests,
    stand_ins,
)
from ulna.system.system import System
from ulna.system.zeros import decimal_root

_QUICK = SampledZero(seconds=0.3)


def equilibrium(
    system: SystemLike,
    *,
    near: PointLike | None = None,
    inputs: Mapping[str, Any] | None = None,
    exact: bool = False,
    digits: int = 12,
) -> Equilibrium:
    """The equilibrium that the system's file asks for, or the one that is reached from a point.

    Without `near` and `inputs` it is the operating point: what [operating_point] gives, the rest solved for, exact
    where that can be, with symbols for parameters; where the system does not rest there the verdict says so.

    Args:
        system: what rests; with `near` or `inputs` its parameters need values, unless `exact`.
        near: SI values by state to start from; left out, what [operating_point] gives, else zero.
        inputs: constant SI values by input; left out, what [operating_point] gives, else zero.
        exact: with `near` or `inputs`, whether the point itself and the nearest exact solution come before Newton's
            method; may take a second.
        digits: decimal digits of a point in decimals.

    Raises:
        PlantError: with `near` or `inputs`: for parameters without value, unknown names, or if none is reached.

    Examples:
        >>> ulna.equilibrium(ulna.model("one_link_arm"))["u"]
        -17.64
    """
    given = as_system(system)
    if near is None and inputs is None:
        return operating_point(given)
    valued = given.with_values()
    asked = {**as_point(valued, near or {}), **as_point(valued, inputs or {})}
    start = {**dict.fromkeys((*given.state_symbols, *given.input_symbols), sp.Integer(0)), **given_values(given)}
    start = {symbol: asked.get(symbol, value).xreplace(given.values) for symbol, value in start.items()}
    held = {u: start[u] for u in given.input_symbols}
    rates = [put_in(r, held) for r in valued.balances]
    point, verdict = _reached(valued, rates, {x: start[x] for x in given.state_symbols}, exact=exact, digits=digits)
    return Equilibrium(system=given, states=point, inputs=held, verdict=verdict, parameters=given.values)


def _reached(
    system: System, rates: Sequence[sp.Expr], start: Mapping[sp.Symbol, sp.Expr], *, exact: bool, digits: int
) -> tuple[dict[sp.Symbol, sp.Expr], Verdict]:
    """The states at rest, and how they were found."""
    claim, states = f"'{system.name}' rests near the point given", list(start)
    for state, rate in zip(states, rates, strict=True):
        if not rate.has(*states) and not is_zero(rate, test=_QUICK).holds:
            moves = "changes by" if system.discrete else "has the rate"
            found = f"there is no equilibrium: {state} {moves} {rate} everywhere."
            raise _none(system, found, "Change that equation.")
    if exact and (found := _exactly(system, rates, start, claim)) is not None:
        return found
    if missing := sorted(p.name for p in system.parameters):
        found = "no equilibrium was found" if exact else "they are needed"
        raise _none(system, f"{found} for parameters without a value: {', '.join(missing)}.", "Give them values.")
    root = decimal_root(rates, states, start, digits=digits) if states else ({}, digits)
    if root is None:
        raise _none(system, "no equilibrium was found near the point: Newton's method found none.", "Start it nearer.")
    return root[0], Verdict.supported(claim, method=NEWTON, digits=root[1])


def _exactly(
    system: System, rates: Sequence[sp.Expr], start: Mapping[sp.Symbol, sp.Expr], claim: str
) -> tuple[dict[sp.Symbol, sp.Expr], Verdict] | None:
    """The point itself if the system rests there, else the nearest exact equilibrium."""
    signs = known_signs(system)
    back = {signed: plain for plain, signed in signs.items()}
    rates = [r.xreplace(signs) for r in rates]
    point = {x: v.xreplace(signs) for x, v in start.items()}
    verdict = rests(system, rates, point, claim, method=AS_GIVEN, test=_QUICK)
    if not verdict.holds:
        try:
            numbers = {signs.get(p, p): value for p, value in stand_ins(system).items()}
            point = nearest_solution(rates, list(point), point, numbers) or point
        except TooHardError:
            return None
        verdict = rests(system, rates, point, claim, method=SOLVED, test=_QUICK)
    return ({x: v.xreplace(back) for x, v in point.items()}, verdict) if verdict.holds else None


def _none(system: System, found: str, hint: str) -> PlantError:
    return PlantError(f"equilibrium of '{system.name}'", found, hint)
