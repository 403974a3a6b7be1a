"""A plant's structure in numbers, whatever it leaves open: parameters without a value stand at arbitrary ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import sympy as sp

from ulna.base import UlnaError, Verdict
from ulna.geometry.numeric import NumericStructure, numeric_structure
from ulna.symbolic.exact import attempt
from ulna.system import Equilibrium, System, equilibrium_in_numbers, stand_ins, system_kernel

_SECONDS = 4.0


def structure_in_numbers(system: System, here: Equilibrium | None = None) -> NumericStructure | None:
    """Ranks, relative degrees and involutivity by balls at points; None where numbers cannot tell in a few seconds.

    A relative degree is proved where the graph of the plant shows that no input acts earlier: a derivative that an
    input does move, at one point, is then enough.

    Args:
        system: the plant.
        here: the operating point; the equilibrium in numbers if left out.
    """
    return _structure(system, here or equilibrium_in_numbers(system))


@lru_cache(maxsize=32)
def _by_numbers(system: System, point: tuple[tuple[str, sp.Expr], ...]) -> NumericStructure | None:
    try:
        field = replace(system_kernel(system, parameters=stand_ins(system)), point=point)
        found = attempt(_SECONDS, "structure in numbers", numeric_structure, field).value
    except UlnaError:
        return None
    return None if found is None else _proved_by_the_graph(system, found)


def _structure(system: System, here: Equilibrium) -> NumericStructure | None:
    numbers = stand_ins(system)
    values = {**here.states, **here.inputs}
    return _by_numbers(system, tuple((s.name, value.xreplace(numbers)) for s, value in values.items()))


def _proved_by_the_graph(system: System, found: NumericStructure) -> NumericStructure:
    shortest = shortest_chains(system)
    if not found.degrees_known.holds or found.degrees != shortest:
        return found
    reason = "no input acts on fewer derivatives, and one does on these"
    return replace(found, degrees_known=Verdict.proved(found.degrees_known.claim, reason=reason, degrees=shortest))


def shortest_chains(system: System) -> tuple[int | None, ...]:
    """(p,) for each output the least number of derivatives in which an input can appear, None if in none.

    By who appears in whose equation only: relative degrees are at least these (P. Daoutidis and C. Kravaris, Chem. Eng.
    Sci. 47 (1992)). A plant whose output takes an input directly has 0 there.
    """
    inputs = set(system.input_symbols)
    # What one implicit set solves for depends on all that appears in it.
    together = {s for d in system.unknowns for s in d.expression.free_symbols}
    used = {d.symbol: together if d.implicit else d.expression.free_symbols for d in system.definitions}
    rate_of = dict(zip(system.state_symbols, system.rates, strict=True))
    chains: list[int | None] = []
    for readout in system.readouts:
        seen, newest, order = set(), _hangs_on(readout, used), 0
        while newest and not newest & inputs:
            seen |= newest
            order += 1
            newest = {s for x in newest if x in rate_of for s in _hangs_on(rate_of[x], used)} - seen
        chains.append(order if newest else None)
    return tuple(chains)


def _hangs_on(expression: sp.Expr, used: Mapping[sp.Symbol, set[sp.Basic]]) -> set[sp.Basic]:
    """All symbols behind an expression, definitions followed."""
    found: set[sp.Basic] = set()
    waiting = list(expression.free_symbols)
    while waiting:
        symbol = waiting.pop()
        if symbol not in found:
            found.add(symbol)
            waiting.extend(used.get(symbol, ()))
    return found
