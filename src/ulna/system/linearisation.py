"""Exact linearisation of a system at a point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.base import PlantError, html_table, number_text
from ulna.symbolic.formulas import formula, formula_html, value_html
from ulna.symbolic.solving import limit_at
from ulna.system.equilibrium_point import Equilibrium, PointLike, as_point
from ulna.system.equilibrium_search import equilibrium
from ulna.system.holder import SystemLike, as_system
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearisation:
    """dx' = A dx + B du, dy = C dx + D du about `point`; of a system in discrete time dx⁺ in place of dx'.

    Attributes:
        A: (n, n); B: (n, m); C: (p, n); D: (p, m), exact.
        point: the values put in for states and inputs.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> ulna.linearise(spring).A
        Matrix([
        [ 0,    1],
        [-4, -1/2]])
    """

    system: System
    point: Mapping[sp.Symbol, sp.Expr]
    A: sp.ImmutableDenseMatrix
    B: sp.ImmutableDenseMatrix
    C: sp.ImmutableDenseMatrix
    D: sp.ImmutableDenseMatrix

    @property
    def period(self) -> sp.Expr | None:
        """s, of a system in discrete time, else None."""
        return self.system.period

    @property
    def eigenvalues(self) -> tuple[complex, ...]:
        """(n,) eigenvalues of A, parameters at their values, slowest first: in 1/s; in discrete time pure numbers.

        Raises:
            PlantError: where A depends on a parameter without a value, or on a state or input that has none here.
        """
        found = np.linalg.eigvals(self.numbers("A"))
        size = np.abs if self.period is not None else np.real
        return tuple(complex(v) for v in sorted(found, key=lambda v: (-size(v), v.imag)))

    def numbers(self, name: str) -> np.ndarray:
        """The matrix of that name, `A`, `B`, `C` or `D`, as floats, parameters at their values.

        Raises:
            PlantError: where it depends on a parameter without a value, or on a state or input that has none here.
        """
        matrix = getattr(self, name).xreplace(self.system.values)
        asked = f"numbers of '{self.system.name}' at a point"
        if matrix.free_symbols:
            names = ", ".join(sorted(s.name for s in matrix.free_symbols))
            raise PlantError(asked, f"no value is given for {names}.", "Give one.")
        numbers = matrix.evalf()
        if jumps := [e for e in numbers if not e.is_number or e.has(sp.DiracDelta, sp.nan, sp.zoo)]:
            found = f"a slope has no value there: {formula(jumps[0])}."
            raise PlantError(asked, found, "The point lies on a jump or kink: take one beside it, or a smooth model.")
        return np.array(numbers, dtype=float).reshape(matrix.shape)

    @property
    def stable(self) -> bool:
        """Whether small deviations die out exponentially: every eigenvalue has Re λ < 0, in discrete time |λ| < 1."""
        if self.period is not None:
            return all(abs(v) < 1 for v in self.eigenvalues)
        return all(v.real < 0 for v in self.eigenvalues)

    def _repr_html_(self) -> str:
        """A table for notebooks: the four matrices, the point, the eigenvalues."""
        rows: list[tuple[object, object]] = [
            (name, formula_html(getattr(self, name))) for name in "ABCD" if all(getattr(self, name).shape)
        ]
        rows.append(("point", value_html(self.point)))
        try:
            unit = "" if self.period is not None else " [1/s]"
            rows.append((f"eigenvalues of A{unit}", ", ".join(number_text(value) for value in self.eigenvalues)))
        except PlantError as error:
            rows.append(("eigenvalues of A", error.found))
        return html_table(rows, title=f"Linearisation of '{self.system.name}'")


def linearise(system: SystemLike, point: PointLike | None = None) -> Linearisation:
    """The Jacobians of rates and readouts at a point.

    Args:
        system: what is linearised; an `Equilibrium` alone stands for its system at that point.
        point: values by symbol or name, or an equilibrium; what it leaves out stays a symbol. Left out altogether,
            the operating point.

    Raises:
        PlantError: for a name that the system does not have.

    Examples:
        >>> ulna.linearise(ulna.model("mass_spring_damper").with_values()).stable
        True
    """
    if point is None:
        point = system if isinstance(system, Equilibrium) else equilibrium(system)
    whole = as_system(system)
    at, x, u = as_point(whole, point), list(whole.state_symbols), list(whole.input_symbols)

    def at_point(expressions: tuple[sp.Expr, ...], by: list[sp.Symbol]) -> sp.ImmutableDenseMatrix:
        if not by or not expressions:
            return sp.ImmutableDenseMatrix(sp.zeros(len(expressions), len(by)))
        return sp.ImmutableDenseMatrix(sp.Matrix(expressions).jacobian(by).applyfunc(lambda e: limit_at(e, at)))

    rates, readouts = whole.inline(whole.rates), whole.inline(whole.readouts)
    return Linearisation(
        system=whole,
        point=at,
        A=at_point(rates, x),
        B=at_point(rates, u),
        C=at_point(readouts, x),
        D=at_point(readouts, u),
    )
