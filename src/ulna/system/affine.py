"""The control-affine view x' = f(x) + g(x) u, y = h(x) of a system, found by differentiation (paper eq. 18)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from ulna.base import NotAffineError, PlantError
from ulna.symbolic.exact import is_zero
from ulna.symbolic.formulas import formula, put_in
from ulna.system.holder import SystemLike, as_system
from ulna.system.input_substitution import substitute_input
from ulna.system.side import NON_SMOOTH
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlAffine:
    """x' = f(x) + g(x) u, y = h(x), with every definition put in and the parameters as symbols.

    Attributes:
        system: what this is the view of.
        x: (n,) state symbols; u: (m,) input symbols.
        f: (n, 1) drift; g: (n, m) input fields as columns; h: (p, 1) outputs.

    Examples:
        >>> view = ulna.control_affine(ulna.model("duffing"))
        >>> view.f.T, view.g.T
        (Matrix([[x2, -a*x1 - b*x1**3 - d*x2]]), Matrix([[0, 1]]))
    """

    system: System
    x: tuple[sp.Symbol, ...]
    u: tuple[sp.Symbol, ...]
    f: sp.ImmutableDenseMatrix
    g: sp.ImmutableDenseMatrix
    h: sp.ImmutableDenseMatrix

    @property
    def input_fields(self) -> tuple[sp.ImmutableDenseMatrix, ...]:
        """The m columns of g."""
        return tuple(self.g[:, j] for j in range(self.g.cols))


def require_continuous(system: System) -> None:
    """Refuse a system in discrete time.

    Raises:
        PlantError: it has no vector fields.
    """
    if system.discrete:
        raise PlantError(
            f"vector fields of '{system.name}'",
            f"it moves in {system.time_text} and has none.",
            "Ask for `equilibrium`, `linearise` or `analyse`, which know discrete time, or write the plant as x' = ….",
        )


def control_affine(system: SystemLike) -> ControlAffine:
    """The control-affine view of a system.

    Raises:
        NotAffineError: if a rate is not affine in the inputs or an output depends on them; shows the term.
        PlantError: for a system in discrete time, which has no vector fields.

    Examples:
        >>> ulna.control_affine(ulna.model("duffing")).g
        Matrix([
        [0],
        [1]])
    """
    return _control_affine(as_system(system))


@lru_cache(maxsize=64)
def _control_affine(system: System) -> ControlAffine:
    require_continuous(system)
    u = system.input_symbols
    rates = sp.Matrix(system.inline(system.rates))
    readouts = sp.Matrix(len(system.readouts), 1, system.inline(system.readouts))
    at_rest = dict.fromkeys(u, sp.Integer(0))
    columns = []
    for signal, rate in zip(system.states, rates, strict=True):
        _require_no_switch(system, signal.name, rate, u)
    for symbol in u:
        column = rates.diff(symbol)
        for signal, rate, slope in zip(system.states, rates, column, strict=True):
            _require_free_of_inputs(system, signal.name, rate, slope, u)
        columns.append(column.xreplace(at_rest))
    for output, readout in zip(system.outputs, readouts, strict=True):
        if readout.free_symbols & set(u) and not all(is_zero(readout.diff(s)).holds for s in u):
            raise NotAffineError(
                f"output '{output.name}' of '{system.name}'",
                f"{formula(readout)} depends on an input directly.",
                "Vector-field methods need outputs of the states alone: add a state for the actuator or sensor.",
            )
    try:
        drift = rates.applyfunc(lambda e: put_in(e, at_rest))
    except (TypeError, ZeroDivisionError):
        drift = sp.Matrix([sp.nan])
    if drift.has(sp.zoo, sp.nan, sp.oo):
        raise PlantError(f"drift of '{system.name}'", "a right-hand side is infinite when the inputs are zero.")
    g = sp.Matrix.hstack(*columns) if columns else sp.zeros(len(rates), 0)
    return ControlAffine(
        system=system,
        x=system.state_symbols,
        u=u,
        f=sp.ImmutableDenseMatrix(drift),
        g=sp.ImmutableDenseMatrix(g),
        h=sp.ImmutableDenseMatrix(readouts.applyfunc(lambda e: put_in(e, at_rest))),
    )


def _require_no_switch(system: System, state: str, rate: sp.Expr, inputs: tuple[sp.Symbol, ...]) -> None:
    """Refuse what an input switches: its slope is the same number on either side, and no input field."""
    for term in sorted(rate.atoms(*NON_SMOOTH) - rate.atoms(sp.Abs), key=lambda t: (-t.count_ops(), str(t))):
        switched = [c for _, c in term.args] if isinstance(term, sp.Piecewise) else term.args
        by = [u.name for u in inputs if any(part.has(u) for part in switched)]
        if by:
            raise NotAffineError(
                f"equation of state '{state}' in '{system.name}'",
                f"the term {formula(term)} is not affine in the input {', '.join(by)}.",
                f"{_offer(system)}ake the input of the design what comes out of that term and simulate with it, "
                "or give an [operating_point] at which the input acts, off the kink.",
            )


def _require_free_of_inputs(
    system: System, state: str, rate: sp.Expr, slope: sp.Expr, inputs: tuple[sp.Symbol, ...]
) -> None:
    if not slope.free_symbols & set(inputs):
        return
    if all(is_zero(slope.diff(s)).holds for s in inputs):
        return
    involved = [s for s in inputs if slope.has(s)]
    terms = [t for t in sp.Add.make_args(sp.expand(rate)) if any(t.has(s) and t.diff(s).has(*involved) for s in inputs)]
    shown = formula(terms[0] if terms else rate)
    raise NotAffineError(
        f"equation of state '{state}' in '{system.name}'",
        f"the term {shown} is not affine in the input {', '.join(s.name for s in involved)}.",
        f"{_offer(system)}ake that input a state and its derivative the new input (an integrator in front of it).",
    )


def _offer(system: System) -> str:
    """The substitution that would do, where there is one, and how the other way out begins."""
    try:
        found = substitute_input(system)
    except NotAffineError:
        return "M"
    told = ", ".join(f"{formula(phi)} the input" for phi in found.meaning.values())
    return f"`ulna.substitute_input(plant)` makes {told} and `undo` turns the law back; or m"
