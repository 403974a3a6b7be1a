"""The stability class of an equilibrium of a system without inputs, with the reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp
from sympy.utilities.iterables import strongly_connected_components

from ulna.base import PlantError, Verdict
from ulna.design.internal.critical_class import BlockClass, StabilityClass, block_class
from ulna.symbolic.exact import time_budget
from ulna.symbolic.solving import eigenvalue_location
from ulna.system import NON_SMOOTH, Equilibrium, System, equilibrium, equilibrium_in_numbers, known_signs

_DIGITS = 40
_CLAIM = "the stability class of the equilibrium is known"


@dataclass(frozen=True, slots=True, kw_only=True)
class EquilibriumStability:
    """How an equilibrium is stable, and why.

    Attributes:
        system: the system without inputs.
        stability: the class.
        verdict: on "the equilibrium is …", or undecided; its evidence tells what decided, block by block.
        equilibrium: value by state symbol; empty if there is none (or no state).
        eigenvalues: of the linearisation, as text.
    """

    system: System
    stability: StabilityClass
    verdict: Verdict
    equilibrium: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)
    eigenvalues: tuple[str, ...] = ()


def equilibrium_stability(
    system: System, *, near: Mapping[sp.Symbol, sp.Expr] | None = None, seconds: float = 5.0
) -> EquilibriumStability:
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
        return EquilibriumStability(system=system, stability=StabilityClass.EXPONENTIAL, verdict=verdict)
    with time_budget(seconds):
        return _classified(system, equilibrium_in_numbers(system).states if near is None else near)
    verdict = Verdict.undecided(_CLAIM, tried=f"out of time after {seconds:g} s")
    return EquilibriumStability(system=system, stability=StabilityClass.UNDECIDED, verdict=verdict)


def _classified(system: System, near: Mapping[sp.Symbol, sp.Expr]) -> EquilibriumStability:
    valued = system.with_values()
    signs = known_signs(valued)
    rates = [r.xreplace(signs) for r in valued.inline(valued.rates)]
    x = list(system.state_symbols)
    rough = [r for r in rates if r.has(*NON_SMOOTH)]
    if rough:
        verdict = Verdict.undecided(_CLAIM, tried=f"{rough[0]} is not smooth")
        return EquilibriumStability(system=system, stability=StabilityClass.UNDECIDED, verdict=verdict)
    try:
        found = equilibrium(system, near=near, exact=True, digits=_DIGITS)
    except PlantError as error:
        verdict = Verdict.undecided(_CLAIM, reason=error.found)
        return EquilibriumStability(system=system, stability=StabilityClass.UNDECIDED, verdict=verdict)
    shown = dict(found.states)
    if not found.exact:
        return _approximate(system, rates, x, found)
    point = {z: v.xreplace(signs) for z, v in shown.items()}
    moved = {z: z + v for z, v in point.items()}
    shifted = [r.xreplace(moved) if any(v != 0 for v in point.values()) else r for r in rates]
    blocks = _blocks(shifted, x)
    judged = [_judged(block, shifted, x) for block in blocks]
    stability, evidence = _combined(blocks, judged, shifted, x)
    eigenvalues = tuple(root for one in judged for root in one.location.roots)
    evidence = {"eigenvalues": eigenvalues, "equilibrium": shown, **evidence}
    verdict = _verdict(stability, evidence)
    return EquilibriumStability(
        system=system, stability=stability, verdict=verdict, equilibrium=shown, eigenvalues=eigenvalues
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


def _approximate(
    system: System, rates: Sequence[sp.Expr], x: Sequence[sp.Symbol], found: Equilibrium
) -> EquilibriumStability:
    """Eigenvalues at an equilibrium known in decimals only: clear of the axis they decide, as support."""
    point, digits = dict(found.states), found.verdict.evidence["digits"]
    A = sp.Matrix(list(rates)).jacobian(list(x)).xreplace(point).evalf(digits)
    location = eigenvalue_location(A.applyfunc(lambda e: sp.Rational(str(e))))
    real = [abs(float(sp.re(sp.sympify(r.replace("i", "*I"))))) for r in location.roots]  # noqa: TID251
    # So far a fourfold root moves with the last digit.
    if location.verdict.holds and real and min(real) >= max(1e-9, 10 ** (-digits / 4)):
        stability = StabilityClass.UNSTABLE if location.unstable else StabilityClass.EXPONENTIAL
        verdict = Verdict.supported(_SAID[stability], eigenvalues=location.roots, equilibrium=point, digits=digits)
    else:
        stability = StabilityClass.UNDECIDED
        verdict = Verdict.undecided(_CLAIM, tried="an equilibrium in decimals with eigenvalues next to the axis")
    return EquilibriumStability(
        system=system, stability=stability, verdict=verdict, equilibrium=point, eigenvalues=location.roots
    )


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
