"""Gain rules: what makes chains of integrators (paper eq. 30-31 and the gains of 51), or a linearisation, stable."""

from __future__ import annotations

import math
import re
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate
from typing import Any, TypeAlias, TypeVar

import numpy as np
import sympy as sp
from mpmath.libmp.libhyper import NoConvergence

from ulna.base import DesignError, FormulaError, UlnaWarning
from ulna.design.linear import least_cost, least_effort, placed
from ulna.symbolic.formulas import exact, formula, parse_formula

PoleLike: TypeAlias = int | float | complex | str | Fraction | sp.Expr
_T = TypeVar("_T")


class AbstractGainRule(ABC):
    """A way to choose the characteristic polynomial of each chain of integrators, or gains on a linearisation.

    Examples:
        >>> isinstance(ulna.Poles([-1, -2]), ulna.AbstractGainRule)
        True
    """

    @abstractmethod
    def polynomials(self, orders: Sequence[int]) -> tuple[tuple[sp.Expr, ...], ...]:
        """For every chain, the coefficients a₀ … a_{r−1} of sʳ + a_{r−1}sʳ⁻¹ + … + a₀, exact and real.

        Raises:
            DesignError: if the rule does not fit the chains.
        """

    @abstractmethod
    def feedback(
        self, A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, names: Sequence[str], asked: str
    ) -> sp.ImmutableDenseMatrix:
        """(m, n) K, rational, for which A − B K is stable (or as the rule says).

        Args:
            A: (n, n); B: (n, m), rational. names: of the n coordinates. asked: what for, in an error.

        Raises:
            DesignError: for a mode that grows or stays and that no input moves, or a rule that does not fit.
        """

    def coefficients(self, order: int) -> tuple[sp.Expr, ...]:
        """The coefficients a₀ … a_{r−1} for a single chain."""
        return self.polynomials((order,))[0]


@dataclass(frozen=True, slots=True, init=False)
class Poles(AbstractGainRule):
    """Poles to place, exact: `Poles(-2+3.46j, -2-3.46j, -8)`, `Poles([-9, -10, -11])` or `Poles("-9, -10, -11")`.

    Numbers are taken by their decimal text; text such as `"-2+2*sqrt(3)*j"` is read as a formula. With several
    chains the poles are dealt out in order, so list each chain's poles together.

    Raises:
        DesignError: for text that is not a number or a complex pole without its conjugate.

    Examples:
        >>> ulna.state_feedback("duffing", ulna.Poles(-1, -2)).poles
        ((-2+0j), (-1+0j))
    """

    values: tuple[sp.Expr, ...]

    def __init__(self, *poles: PoleLike | Iterable[PoleLike]) -> None:
        values = tuple(_pole(single) for given in poles for single in _listed(given))
        object.__setattr__(self, "values", values)
        _require_conjugates(values)

    def polynomials(self, orders: Sequence[int]) -> tuple[tuple[sp.Expr, ...], ...]:
        """The polynomials with these poles as roots, dealt out chain by chain; warns of unstable ones."""
        dealt = _dealt(self.values, orders, "poles", str(self))
        self._warn_if_unstable()
        for group in dealt if len(orders) > 1 else ():
            _require_conjugates(group)
        return tuple(_polynomial(group) for group in dealt)

    def feedback(
        self, A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, names: Sequence[str], asked: str
    ) -> sp.ImmutableDenseMatrix:
        """The gains that place these poles, one for each mode that an input moves; warns of unstable ones."""
        self._warn_if_unstable()
        return placed(A, B, self.values, names, asked)

    def _warn_if_unstable(self) -> None:
        unstable = [formula(p) for p in self.values if float(sp.re(p)) >= 0]
        if unstable:
            warnings.warn(
                f"poles {', '.join(unstable)} are not in the open left half-plane: the design is unstable.",
                UlnaWarning,
                stacklevel=3,
            )

    def __str__(self) -> str:
        return ", ".join(formula(p).replace("I", "j") for p in self.values)


@dataclass(frozen=True, slots=True, init=False)
class LinearQuadratic(AbstractGainRule):
    """Linear-quadratic weights: minimises ∫ zᵀ diag(state_weights) z + vᵀ diag(input_weight) v dt.

    On chains v are the new inputs and every chain is minimised by itself; on a linearisation z are the states, v the
    inputs, both counted from the operating point, as in `lqr` of other tools.

    Attributes:
        state_weights: a single weight for every coordinate, or one for each, dealt out chain after chain as poles are
            (with integral action, the integral in front of its chain, of a linearisation all integrals in front).
            Nonnegative; that of each chain's first coordinate positive.
        input_weight: a single positive weight for every input, or one for each.

    The gains are the nearest short rationals of the Riccati solution (SciPy), so that designs stay exact after it.

    Raises:
        DesignError: for weights that are not numbers or of the wrong sign.

    Examples:
        >>> law = ulna.state_feedback("duffing", ulna.LinearQuadratic(state_weights=[10, 1], input_weight=0.1))
        >>> np.round(law.poles, 2)
        array([-2.74-1.58j, -2.74+1.58j])
    """

    state_weights: tuple[float, ...]
    input_weight: tuple[float, ...]

    def __init__(
        self, *, state_weights: float | Iterable[float] = 1.0, input_weight: float | Iterable[float] = 1.0
    ) -> None:
        for name, given in (("state_weights", state_weights), ("input_weight", input_weight)):
            row = given if isinstance(given, Iterable) else (given,)
            object.__setattr__(self, name, tuple(float(weight) for weight in row))
        weights = (*self.state_weights, *self.input_weight)
        if not (all(0 <= w < math.inf for w in weights) and any(self.state_weights) and self.input_weight):
            raise self._unusable()
        if not all(self.input_weight):
            raise self._unusable()

    def polynomials(self, orders: Sequence[int]) -> tuple[tuple[sp.Expr, ...], ...]:
        """The optimal closed-loop polynomial of every chain."""
        dealt = _dealt(self._each(sum(orders)), orders, "weights", self._shown)
        if not all(chain[0] for chain in dealt):
            raise self._unusable()
        return tuple(self._chain(chain, weight) for chain, weight in zip(dealt, self._inputs(len(orders)), strict=True))

    def feedback(
        self, A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, names: Sequence[str], asked: str
    ) -> sp.ImmutableDenseMatrix:
        """The gains of least cost."""
        states = _dealt(self._each(A.rows), (A.rows,), "weights", self._shown)[0]
        return least_cost(A, B, (np.array(states), np.array(self._inputs(B.cols))), names, asked)

    @property
    def _shown(self) -> str:
        return ", ".join(f"{weight:g}" for weight in self.state_weights)

    def _each(self, number: int) -> tuple[float, ...]:
        return self.state_weights * (number if len(self.state_weights) == 1 else 1)

    def _inputs(self, number: int) -> tuple[float, ...]:
        """The weight of each input."""
        given = self.input_weight
        if len(given) not in (1, number):
            shown = ", ".join(f"{weight:g}" for weight in given)
            found = f"{len(given)} weights of the inputs given ({shown}), {number} needed."
            raise DesignError("linear-quadratic weights", found, "Give one for each input, or one for all.")
        return given * (number if len(given) == 1 else 1)

    def _unusable(self) -> DesignError:
        return DesignError(
            "linear-quadratic weights",
            f"state_weights={self.state_weights}, input_weight={self.input_weight}.",
            "The weights of the inputs and of each chain's first coordinate must be positive, the others zero or "
            "more, all finite.",
        )

    def _chain(self, weights: Sequence[float], input_weight: float) -> tuple[sp.Expr, ...]:
        from scipy.linalg import solve_continuous_are

        order = len(weights)
        last = np.zeros((order, 1))
        last[-1, 0] = 1.0
        try:
            riccati = solve_continuous_are(np.eye(order, k=1), last, np.diag(weights), np.array([[input_weight]]))
        except (np.linalg.LinAlgError, ValueError) as error:
            hint = "Choose weights within some ten decades of each other."
            raise DesignError(
                "linear-quadratic weights", f"the Riccati equation has no solution in numbers ({error}).", hint
            ) from None
        gains = (last.T @ riccati / input_weight).ravel()
        return tuple(exact(float(f"{gain:.12g}")) for gain in gains)


@dataclass(frozen=True, slots=True)
class Bandwidth(AbstractGainRule):
    """The bandwidth of the loop, ω in rad/s: for every plant, whatever its number of states and its units.

    A chain of r integrators gets the Butterworth polynomial of order r with radius ω. A linearisation gets the gains of
    least effort with which every mode slower than ω/2 is mirrored there: modes at 0 go to −ω, fast ones stay.

    Raises:
        DesignError: for what is not a positive number.

    Examples:
        >>> law = ulna.state_feedback("duffing", ulna.Bandwidth(3))
        >>> [round(abs(pole), 6) for pole in law.poles]
        [3.0, 3.0]
    """

    omega: float

    def __post_init__(self) -> None:
        if not 0 < self.omega < math.inf:
            raise DesignError(f"Bandwidth({self.omega})", "it is not a positive number.", "Give ω in rad/s.")

    def polynomials(self, orders: Sequence[int]) -> tuple[tuple[sp.Expr, ...], ...]:
        """The Butterworth polynomial of every chain."""
        rows = []
        for order in orders:
            angles = [math.pi * (2 * k + order + 1) / (2 * order) for k in range(order)]
            row = np.poly([self.omega * complex(math.cos(a), math.sin(a)) for a in angles]).real
            rows.append(tuple(exact(float(f"{value:.6g}")) for value in row[:0:-1]))
        return tuple(rows)

    def feedback(
        self, A: sp.ImmutableDenseMatrix, B: sp.ImmutableDenseMatrix, names: Sequence[str], asked: str
    ) -> sp.ImmutableDenseMatrix:
        """The gains of least effort for this pace."""
        return least_effort(A, B, self.omega, names, asked)


Gains: TypeAlias = AbstractGainRule | PoleLike | Iterable[PoleLike]
"""What every verb takes for gains: a rule, or poles in a list, an array or a text."""


def gain_rule(given: Gains) -> AbstractGainRule:
    """A gain rule as it is; poles in a list, an array or a text as `Poles`.

    Raises:
        DesignError: for what is not a pole.
    """
    return given if isinstance(given, AbstractGainRule) else Poles(given)


def _dealt(values: Sequence[_T], orders: Sequence[int], what: str, shown: str) -> list[Sequence[_T]]:
    """The values chain by chain."""
    if len(values) != sum(orders):
        chains = f" in chains of {', '.join(map(str, orders))}" if len(orders) > 1 else ""
        raise DesignError(
            what,
            f"{len(values)} given ({shown}), {sum(orders)} needed{chains}.",
            f"Give one of the {what} for each coordinate of each chain.",
        )
    ends = list(accumulate(orders))
    return [values[end - order : end] for end, order in zip(ends, orders, strict=True)]


def gain_matrix(indices: Sequence[int], polynomials: Sequence[Sequence[sp.Expr]]) -> sp.ImmutableDenseMatrix:
    """(n, p) the coefficients of each chain of r coordinates in r rows of a column of its own, a₀ first.

    It is L for which A − L C of an observer form has these characteristic polynomials, and Kᵀ of a law's chains.
    """
    matrix = sp.zeros(sum(indices), len(indices))
    start = 0
    for i, (size, polynomial) in enumerate(zip(indices, polynomials, strict=True)):
        matrix[start : start + size, i] = sp.Matrix(size, 1, list(polynomial))
        start += size
    return sp.ImmutableDenseMatrix(matrix)


def roots_of(polynomials: Sequence[Sequence[sp.Expr]]) -> tuple[complex, ...]:
    """The poles, in 1/s, of monic polynomials given by their coefficients a₀ … a_{r−1} (parameters need values)."""
    poles: list[complex] = []
    for coefficients in polynomials:
        exact_polynomial = sp.Poly([sp.Integer(1), *reversed(coefficients)], sp.Dummy("s"))
        try:
            poles += [complex(root) for root in exact_polynomial.nroots(n=30, maxsteps=200)]
        except NoConvergence:  # roots that are equal but for the last digits
            poles += [complex(root) for root in np.roots([1.0, *(float(c) for c in reversed(coefficients))])]
    return tuple(poles)


def characteristic(matrix: sp.MatrixBase) -> tuple[sp.Expr, ...]:
    """The coefficients a₀ … a_{n−1} of det(s − M), exact; M rational."""
    from sympy.polys.matrices import DomainMatrix

    found = DomainMatrix.from_Matrix(matrix).convert_to(sp.QQ).charpoly()
    return tuple(sp.QQ.to_sympy(c) for c in reversed(found[1:]))


def _polynomial(poles: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    coefficients: list[sp.Expr] = [sp.Integer(1)]  # high power first
    for pole in poles:
        shifted = [*coefficients, sp.Integer(0)]
        for k, value in enumerate(coefficients):
            shifted[k + 1] = sp.expand(shifted[k + 1] - pole * value)
        coefficients = shifted
    return tuple(sp.nsimplify(sp.re(c)) if c.has(sp.I) else c for c in reversed(coefficients[1:]))


def _require_conjugates(poles: Sequence[sp.Expr]) -> None:
    rest = list(poles)
    while rest:
        pole = rest.pop()
        if sp.im(pole) == 0:
            continue
        partner = next((p for p in rest if sp.expand(p - sp.conjugate(pole)) == 0), None)
        if partner is None:
            shown = formula(pole).replace("I", "j")
            wanted = formula(sp.conjugate(pole)).replace("I", "j")
            raise DesignError(f"pole {shown}", "its complex conjugate is missing.", f"Add {wanted} beside it.")
        rest.remove(partner)


def _listed(given: PoleLike | Iterable[PoleLike]) -> Iterable[PoleLike]:
    """Single poles: an array or list entry by entry, a text divided at its commas."""
    if isinstance(given, str):
        return given.split(",")
    return given if isinstance(given, Iterable) else (given,)


def _pole(value: Any) -> sp.Expr:
    try:
        if isinstance(value, str):
            return _pole_text(value)
        if isinstance(value, complex):
            return exact(value.real) + sp.I * exact(value.imag)
        if isinstance(value, sp.Expr):
            if not value.is_number or value.has(sp.zoo, sp.nan, sp.oo):
                raise ValueError
            return value
        return exact(value)
    except (ValueError, TypeError, FormulaError):
        raise DesignError(f"pole {value!r}", "it is not a finite number.", "Write -3, -2+3.46j or -2-3.46j.") from None


def _pole_text(text: str) -> sp.Expr:
    unit = sp.Symbol("j", real=True)
    spaced = re.sub(r"(?<=[\d.)])\s*[ji]\b", "*j", text.strip())
    spaced = re.sub(r"(?<![\w.])i\b", "j", spaced)
    return sp.expand(parse_formula(spaced, {"j": unit}, where=f"pole '{text}'").subs(unit, sp.I))
