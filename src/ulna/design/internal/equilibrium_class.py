"""The stability class of an equilibrium of a system without inputs, with the reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp
from sympy.utilities.iterables import strongly_connected_components

from ulna.base.errors import PlantError
from ulna.base.verdict import Verdict
from ulna.design.internal.base_point import base_point
from ulna.design.internal.critical_class import BlockClass, StabilityClass, block_class
from ulna.symbolic.exact.budget import attempt, time_budget
from ulna.symbolic.exact.zero import SampledZero, is_zero
from ulna.symbolic.solving.level_set import ball_at
from ulna.symbolic.solving.root_location import eigenvalue_location
from ulna.symbolic.solving.roots import solutions
from ulna.system.affine import NON_SMOOTH
from ulna.system.system import System

_QUICK = SampledZero(seconds=0.3)
_SOLVE_SECONDS = 1.0
_DIGITS = 40
_CLAIM = "the stability class of the equilibrium is known"


@dataclass(frozen=True, slots=True, kw_only=True)
class EquilibriumClass:
    """How an equilibrium is stable, and why.

    Attributes:
        system: the system without inputs.
        equilibrium: value by state symbol; empty if there is none (or no state).
        stability: the class.
        eigenvalues: of the linearisation, as text.
        verdict: on "the equilibrium is …", or undecided; its evidence tells what decided, block by block.
    """

    system: System
    equilibrium: Mapping[sp.Symbol, sp.Expr]
    stability: StabilityClass
    eigenvalues: tuple[str, ...]
    verdict: Verdict


class _NoEquilibriumError(Exception):
    """Says in words why."""


def equilibrium_class(
    system: System, *, near: Mapping[sp.Symbol, sp.Expr] | None = None, seconds: float = 5.0
) -> EquilibriumClass:
    """The class of the equilibrium at a point, or of the one nearest to it; parameters at their values.

    Strongly connected blocks of equations are judged one by one, each with the blocks before it at rest (a cascade
    of asymptotically stable blocks is asymptotically stable: Vidyasagar, IEEE TAC 25 (1980)); critical blocks by
    centre manifold, focal values, conserved energy or a manifold of equilibria.

    Args:
        system: without inputs; parameters without a value stay symbols, positive if their lower bound is.
        near: value by state symbol; the operating point if left out.
        seconds: s, for everything together.

    Raises:
        PlantError: if the system has inputs.
    """
    if system.inputs:
        raise PlantError(
            f"stability class of '{system.name}'", "it has inputs.", "Close the loop first, or take its zero dynamics."
        )
    if not system.states:
        verdict = Verdict.proved("the equilibrium is exponentially stable", reason="there are no states")
        return _answer(system, {}, StabilityClass.EXPONENTIAL, (), verdict)
    with time_budget(seconds):
        return _classified(system, base_point(system).states if near is None else near)
    verdict = Verdict.undecided(_CLAIM, tried=f"out of time after {seconds:g} s")
    return _answer(system, {}, StabilityClass.UNDECIDED, (), verdict)


def _classified(system: System, near: Mapping[sp.Symbol, sp.Expr]) -> EquilibriumClass:
    valued = system.with_values()
    rates, signs = _with_known_signs(system, valued.inline(valued.rates))
    x = list(system.state_symbols)
    rough = [r for r in rates if r.has(*NON_SMOOTH)]
    if rough:
        verdict = Verdict.undecided(_CLAIM, tried=f"{rough[0]} is not smooth")
        return _answer(system, {}, StabilityClass.UNDECIDED, (), verdict)
    start = {z: near.get(z, sp.Integer(0)).xreplace({**system.values, **signs}) for z in x}
    try:
        point, exact = _equilibrium(rates, x, start)
    except _NoEquilibriumError as reason:
        verdict = Verdict.undecided(_CLAIM, reason=str(reason))
        return _answer(system, {}, StabilityClass.UNDECIDED, (), verdict)
    back = {d: s for s, d in signs.items()}
    shown = {z: v.xreplace(back) for z, v in point.items()}
    if not exact:
        return _approximate(system, rates, x, shown)
    moved = {z: z + v for z, v in point.items()}
    shifted = [r.xreplace(moved) if any(v != 0 for v in point.values()) else r for r in rates]
    blocks = _blocks(shifted, x)
    judged = [_judged(block, shifted, x) for block in blocks]
    stability, evidence = _combined(blocks, judged, shifted, x)
    eigenvalues = tuple(root for one in judged for root in one.location.roots)
    evidence = {"eigenvalues": eigenvalues, "equilibrium": shown, **evidence}
    return _answer(system, shown, stability, eigenvalues, _verdict(stability, evidence))


def _answer(
    system: System,
    equilibrium: Mapping[sp.Symbol, sp.Expr],
    stability: StabilityClass,
    eigenvalues: tuple[str, ...],
    verdict: Verdict,
) -> EquilibriumClass:
    return EquilibriumClass(
        system=system,
        equilibrium=dict(equilibrium),
        stability=stability,
        eigenvalues=eigenvalues,
        verdict=verdict,
    )


_SAID = {
    StabilityClass.EXPONENTIAL: "the equilibrium is exponentially stable",
    StabilityClass.ASYMPTOTIC: "the equilibrium is asymptotically, not exponentially, stable",
    StabilityClass.MARGINAL: "the equilibrium is stable, not asymptotically",
    StabilityClass.UNSTABLE: "the equilibrium is unstable",
}


def _verdict(stability: StabilityClass, evidence: Mapping[str, Any]) -> Verdict:
    if stability is StabilityClass.UNDECIDED:
        return Verdict.undecided(_CLAIM, **evidence)
    return Verdict.proved(_SAID[stability], **evidence)


def _with_known_signs(system: System, rates: Sequence[sp.Expr]) -> tuple[list[sp.Expr], dict[sp.Symbol, sp.Symbol]]:
    """Parameters without a value but with a bound of one sign become symbols that know it."""
    signs = {}
    for parameter in system.parameters:
        if parameter.value is None and parameter.lower is not None and parameter.lower >= 0:
            signs[parameter.symbol] = sp.Symbol(parameter.name, positive=True)
        elif parameter.value is None and parameter.upper is not None and parameter.upper <= 0:
            signs[parameter.symbol] = sp.Symbol(parameter.name, negative=True)
    return [r.xreplace(signs) for r in rates], signs


def _equilibrium(
    rates: Sequence[sp.Expr], x: Sequence[sp.Symbol], start: Mapping[sp.Symbol, sp.Expr]
) -> tuple[dict[sp.Symbol, sp.Expr], bool]:
    """The point itself if the system rests there, else the nearest equilibrium; False with it if it is a decimal."""
    here = [r.xreplace(dict(start)) for r in rates]
    if not any(e.has(sp.nan, sp.zoo, sp.oo) for e in here) and all(is_zero(e, test=_QUICK).holds for e in here):
        return dict(start), True
    for z, rate in zip(x, rates, strict=True):
        if not rate.has(*x) and not is_zero(rate, test=_QUICK).holds:
            raise _NoEquilibriumError(f"there is no equilibrium: {z}' = {rate} everywhere")
    best: tuple[Any, dict[sp.Symbol, sp.Expr]] | None = None
    for solution in solutions(rates, x, seconds=_SOLVE_SECONDS):
        point = {z: solution.get(z, z).xreplace(dict(start)) for z in x}
        distance = _distance(point, start)
        if distance is not None and (best is None or distance < best[0]):
            best = distance, point
    if best is not None:
        return best[1], True
    if any(r.free_symbols - set(x) for r in rates):
        raise _NoEquilibriumError("no equilibrium was found for parameters without values")
    guess = [sp.Float(start[z], _DIGITS) for z in x]
    found = attempt(_SOLVE_SECONDS, "Newton", sp.nsolve, list(rates), list(x), guess, prec=_DIGITS)
    if found.value is None:
        raise _NoEquilibriumError("no equilibrium was found near the point")
    return {z: sp.Rational(str(v)) for z, v in zip(x, found.value, strict=True)}, False


def _distance(point: Mapping[sp.Symbol, sp.Expr], start: Mapping[sp.Symbol, sp.Expr]) -> Any:
    """Distance squared as a ball; None where the point is not real."""
    if any(v.has(sp.I, sp.nan, sp.zoo, sp.oo) for v in point.values()):
        return None
    gap = sp.Add(*((v - start[z]) ** 2 for z, v in point.items()))
    stand_in = {s: sp.Rational(7, 5) if s.is_positive else sp.Rational(-7, 5) for s in gap.free_symbols}
    ball = ball_at(gap, stand_in)
    return ball if ball.is_finite() else None


def _approximate(
    system: System, rates: Sequence[sp.Expr], x: Sequence[sp.Symbol], point: Mapping[sp.Symbol, sp.Expr]
) -> EquilibriumClass:
    """Eigenvalues at an equilibrium known to 40 digits only: clear of the axis they decide, as support."""
    A = sp.Matrix(list(rates)).jacobian(list(x)).xreplace(dict(point)).evalf(_DIGITS)
    location = eigenvalue_location(A.applyfunc(lambda e: sp.Rational(str(e))))
    real = [abs(float(sp.re(sp.sympify(r.replace("i", "*I"))))) for r in location.roots]  # noqa: TID251
    if not location.verdict.holds or not real or min(real) < 1e-9:
        verdict = Verdict.undecided(_CLAIM, tried="an equilibrium in decimals with eigenvalues next to the axis")
        return _answer(system, point, StabilityClass.UNDECIDED, location.roots, verdict)
    stability = StabilityClass.UNSTABLE if location.unstable else StabilityClass.EXPONENTIAL
    verdict = Verdict.supported(_SAID[stability], eigenvalues=location.roots, equilibrium=dict(point), digits=_DIGITS)
    return _answer(system, point, stability, location.roots, verdict)


def _blocks(rates: Sequence[sp.Expr], x: Sequence[sp.Symbol]) -> list[list[sp.Symbol]]:
    """Strongly connected blocks, a block after those it depends on."""
    edges = [(z, other) for z, r in zip(x, rates, strict=True) for other in x if r.has(other)]
    found = strongly_connected_components((list(x), edges))
    return [[z for z in x if z in block] for block in found]


def _judged(block: Sequence[sp.Symbol], rates: Sequence[sp.Expr], x: Sequence[sp.Symbol]) -> BlockClass:
    at_rest = {z: sp.Integer(0) for z in x if z not in block}
    own = [r.xreplace(at_rest) for z, r in zip(x, rates, strict=True) if z in block]
    return block_class(own, list(block))


def _combined(
    blocks: Sequence[Sequence[sp.Symbol]],
    judged: Sequence[BlockClass],
    rates: Sequence[sp.Expr],
    x: Sequence[sp.Symbol],
) -> tuple[StabilityClass, dict[str, Any]]:
    """The class of the whole from those of the blocks, each judged with the blocks before it at rest."""
    classes = [one.stability for one in judged]
    for decisive in (StabilityClass.UNSTABLE, StabilityClass.UNDECIDED):
        if decisive in classes:
            return decisive, _shown(blocks, judged, classes.index(decisive))
    slow = [k for k, c in enumerate(classes) if c is not StabilityClass.EXPONENTIAL]
    if not slow:
        return StabilityClass.EXPONENTIAL, {"by": "eigenvalues"}
    if len(slow) == 1 or all(classes[k] is StabilityClass.ASYMPTOTIC for k in slow):
        return classes[slow[0]], _shown(blocks, judged, slow[0])
    if _independent([blocks[k] for k in slow], rates, x):
        marginal = next(k for k in slow if classes[k] is StabilityClass.MARGINAL)
        return StabilityClass.MARGINAL, _shown(blocks, judged, marginal)
    whole = block_class(rates, x)
    return whole.stability, whole.evidence


def _shown(blocks: Sequence[Sequence[sp.Symbol]], judged: Sequence[BlockClass], index: int) -> dict[str, Any]:
    block = {"block": tuple(str(z) for z in blocks[index])} if len(blocks) > 1 else {}
    return {**judged[index].evidence, **block}


def _independent(blocks: Sequence[Sequence[sp.Symbol]], rates: Sequence[sp.Expr], x: Sequence[sp.Symbol]) -> bool:
    """Whether none of the blocks acts on another one, directly or through other states."""
    rate = dict(zip(x, rates, strict=True))
    for block in blocks:
        causes: set[sp.Symbol] = set()
        waiting = list(block)
        while waiting:
            new = (rate[waiting.pop()].free_symbols & set(x)) - causes
            causes |= new
            waiting.extend(new)
        if any(causes & set(other) for other in blocks if other is not block):
            return False
    return True
