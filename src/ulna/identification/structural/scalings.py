"""Scalings of states and parameters that leave every output as it is: exact proofs that parameters cannot be known.

x_i → λ^{a_i} x_i, p_j → λ^{b_j} p_j carries solutions into solutions with the same outputs if every term of a rate has
the weight of its state and every readout the weight zero: linear equations for a and b, solved over the rationals.
What can be known of the parameters then are the monomials Π p_j^{e_j} with Σ e_j b_j = 0 for all scalings.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp
from flint import fmpz_mat

from ulna.system import NON_SMOOTH, System

Weight = dict[sp.Symbol, sp.Rational]
"""A linear form in the unknown exponents."""


class _NoScalingError(Exception):
    """A term whose weight cannot be told."""


def scalings(system: System, free: Sequence[str], known: Sequence[str] = ()) -> tuple[dict[str, int], ...]:
    """A basis of all scalings: exponents by name of state and parameter, whole numbers, zeros left out.

    Args:
        system: the plant, known parameters put in.
        free: names of the unknown parameters; known: states whose start is known, which no scaling may move.
    """
    names = {sp.Symbol(name, real=True) for name in (*(s.name for s in system.states), *free)}
    movable = sorted(names - {sp.Symbol(name, real=True) for name in known}, key=lambda s: s.name)
    zero: list[Weight] = []
    try:
        for state, rate in zip(system.state_symbols, system.inline(system.rates), strict=True):
            _match(_weight(rate, names, zero), {state: sp.S.One}, zero)
        for readout in system.inline(system.readouts):
            _match(_weight(readout, names, zero), {}, zero)
    except _NoScalingError:
        return ()
    rows = sp.Matrix([[row.get(s, 0) for s in movable] for row in zero]) if zero else sp.zeros(1, len(movable))
    return tuple(
        {s.name: e for s, e in zip(movable, exponents, strict=True) if e} for exponents in whole_null_space(rows)
    )


def whole_null_space(matrix: sp.MatrixBase) -> list[list[int]]:
    """Short whole vectors that span the null space of a rational matrix."""
    basis = [vector * sp.ilcm(*(e.q for e in vector)) for vector in matrix.nullspace()]
    if not basis:
        return []
    reduced = fmpz_mat([[int(e) for e in vector] for vector in basis]).lll()
    rows = [[int(reduced[i, j]) for j in range(reduced.ncols())] for i in range(reduced.nrows())]
    return [row if sum(row) >= 0 else [-e for e in row] for row in rows]


def _weight(e: sp.Basic, names: set[sp.Symbol], zero: list[Weight]) -> Weight | None:
    """The weight of an expression; None for 0, which has every weight. What must vanish goes into `zero`."""
    if e == 0:
        return None
    if not e.free_symbols & names:
        return {}
    if isinstance(e, sp.Symbol):
        return {e: sp.S.One}
    if isinstance(e, sp.Mul):
        total: Weight = {}
        for factor in e.args:
            for symbol, share in (_weight(factor, names, zero) or {}).items():
                total[symbol] = total.get(symbol, sp.S.Zero) + share
        return total
    if isinstance(e, sp.Pow) and e.exp.is_Rational:
        return {symbol: share * e.exp for symbol, share in (_weight(e.base, names, zero) or {}).items()}
    if isinstance(e, sp.Add | sp.Min | sp.Max):
        return _common([_weight(part, names, zero) for part in e.args], zero)
    if isinstance(e, sp.Abs):
        return _weight(e.args[0], names, zero)
    if isinstance(e, sp.sign):
        _weight(e.args[0], names, zero)  # a positive factor changes no sign
        return {}
    if isinstance(e, NON_SMOOTH):
        raise _NoScalingError
    for argument in e.args:
        _match(_weight(argument, names, zero), {}, zero)
    return {}


def _common(weights: Sequence[Weight | None], zero: list[Weight]) -> Weight | None:
    told = [weight for weight in weights if weight is not None]
    for weight in told[1:]:
        _match(weight, told[0], zero)
    return told[0] if told else None


def _match(weight: Weight | None, due: Weight, zero: list[Weight]) -> None:
    if weight is None:
        return
    difference = {s: weight.get(s, sp.S.Zero) - due.get(s, sp.S.Zero) for s in weight.keys() | due.keys()}
    difference = {s: share for s, share in difference.items() if share}
    if difference:
        zero.append(difference)
