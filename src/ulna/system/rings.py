"""Algebraic loops, rings of wires without a state: one signal of each is cut, and solves the equation round it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import sympy as sp

from ulna.base import PlantError
from ulna.system.signal import Definition


def in_order(
    formulas: Mapping[sp.Symbol, sp.Expr],
    wires: Mapping[sp.Symbol, str],
    units: Mapping[sp.Symbol, str],
    values: Mapping[sp.Symbol, sp.Expr],
) -> tuple[Definition, ...]:
    """Definitions in an order in which each uses only earlier ones; the cut signals of rings are implicit, and last.

    Args:
        formulas: what each symbol stands for. wires: inputs of parts, by what messages call them; every ring has one.
        units: of the wires. values: exact SI values of parameters.

    Raises:
        PlantError: a ring that is not linear in its signals, or that has no solution or many: a gain of 1. It is named.
    """
    pending, ordered, cut = dict(formulas), list[Definition](), dict[sp.Symbol, tuple[sp.Expr, str]]()
    while pending:
        ready = [s for s, e in pending.items() if not (e.free_symbols & pending.keys())]
        ordered += [Definition(name=s.name, expression=pending.pop(s)) for s in ready]
        if not ready:
            ring = _ring(pending)
            symbol = next(s for s in ring if s in wires)
            cut[symbol] = (pending.pop(symbol), " → ".join(wires[s] for s in (*ring, symbol) if s in wires))
    if cut:
        _check(ordered, cut, values)
    implicit = (
        Definition(name=s.name, expression=s - e, implicit=True, unit=units.get(s, "")) for s, (e, _) in cut.items()
    )
    return (*ordered, *implicit)


def _ring(pending: Mapping[sp.Symbol, sp.Expr]) -> list[sp.Symbol]:
    """Symbols each of which the next one uses, round a ring; every symbol uses a pending one."""
    path = [next(iter(pending))]
    while (following := min(pending[path[-1]].free_symbols & pending.keys(), key=str)) not in path:
        path.append(following)
    return path[path.index(following) :][::-1]


def _check(
    ordered: Sequence[Definition], cut: Mapping[sp.Symbol, tuple[sp.Expr, str]], values: Mapping[sp.Symbol, sp.Expr]
) -> None:
    """Refuse rings that are not linear in their cut signals, or singular at the parameters' values."""
    meaning: dict[sp.Symbol, sp.Expr] = {}
    for definition in ordered:
        meaning[definition.symbol] = definition.expression.xreplace(meaning)
    rows = []
    for symbol, (expression, ring) in cut.items():
        residual = symbol - expression.xreplace(meaning)
        row = [sp.cancel(sp.diff(residual, each)) for each in cut]
        if any(entry.free_symbols & cut.keys() or _bends(residual, cut) for entry in row):
            raise PlantError(
                "connection",
                f"the algebraic loop {ring} is not linear in {symbol.name}.",
                "Break it with a state (a filter or a delay), or make it linear.",
            )
        rows.append(row)
    if sp.cancel(sp.Matrix(rows).xreplace(dict(values)).det()) == 0:
        raise PlantError(
            "connection",
            f"the algebraic loop {'; '.join(ring for _, ring in cut.values())} has a gain of exactly 1: "
            "no values of its signals, or any, satisfy it.",
            "Change a gain in it, or break it with a state (a filter or a delay).",
        )


_BENDS = (sp.Abs, sp.sign, sp.Min, sp.Max, sp.floor, sp.ceiling, sp.Heaviside, sp.Piecewise)


def _bends(residual: sp.Expr, symbols: Collection[sp.Symbol]) -> bool:
    """Whether a cut signal stands within a function with kinks or jumps."""
    return any(each.free_symbols & set(symbols) for each in residual.atoms(*_BENDS))
