"""Global stability by cascade: errors that decay by themselves disturb states at most in proportion to their size."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import scipy.linalg as la
import sympy as sp
from flint import arb
from sympy.polys.rings import PolyElement, ring

from ulna.certify.cascade.growth import Growth, Range, UnboundedError
from ulna.certify.region import Form, Slopes, rational
from ulna.symbolic.exact import exact_ball

_LEAST = 0.98
"""Part of a matrix's own decay rate that its quadratic form is asked to show."""


class NotByThisTheoremError(Exception):
    """A hypothesis that does not hold, or is not shown to."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cascade:
    """w' = A w + b + h(w, e), e' = E e with h(w, 0) = 0, and what shows that every run converges.

    Attributes:
        P: of the quadratic form, block diagonal, one block for w and one for e. rates: (λ, μ) with V' ≤ −2λV in the
            first where e = 0, V' ≤ −2μV in the second; μ is 0 where there are no errors.
        growth: for every rate of w and every error a polynomial that bounds |∂h/∂e|, in the sizes |w| and |e|.
    """

    P: sp.Matrix
    rates: tuple[sp.Rational, ...]
    growth: tuple[tuple[PolyElement, ...], ...]

    def reach(self, slopes: Slopes, center: np.ndarray) -> dict[str, str]:
        """What bounds every run, in words of v = √(dwᵀP dw), ε = √(eᵀR e) at its start; empty without errors.

        By Gronwall: v' ≤ −λv + a(ε) + b(ε)v with polynomials a, b, and ε ≤ ε₀ e^(−μt).
        """
        k, n = slopes.form.outer, len(slopes.form.symbols)
        if k == n:
            return {}
        P = np.array(self.P.tolist(), dtype=float)
        own, errors = np.sqrt(np.diag(la.inv(P[:k, :k]))), np.sqrt(np.diag(la.inv(P[k:, k:])))
        mu = float(self.rates[1])
        a: dict[int, float] = {}
        b: dict[int, float] = {}
        for i, row in enumerate(self.growth):
            for j, polynomial in enumerate(row):
                for powers, coefficient in polynomial.terms():
                    size = float(coefficient) * np.sqrt(P[i, i]) * errors[j]
                    order = 1 + sum(powers[k:])
                    size *= float(np.prod(errors ** np.array(powers[k:])))
                    if not sum(powers[:k]):
                        a[order] = a.get(order, 0.0) + size
                        continue
                    place = powers[:k].index(1)
                    a[order] = a.get(order, 0.0) + size * abs(center[place])
                    b[order] = b.get(order, 0.0) + size * own[place]
        grown, pushed = (
            " + ".join(f"{value / (p * mu):.4g}·ε₀" + (f"^{p}" if p > 1 else "") for p, value in sorted(part.items()))
            for part in (b, a)
        )
        return {"bound": f"v(t) ≤ exp({grown or '0'})·(v₀ + {pushed or '0'})"}


def cascade(slopes: Slopes) -> Cascade:
    """What shows that every run of a loop without limits converges.

    With h bounded by |e| times a polynomial of degree at most 1 in |w|, the errors cannot drive w to infinity before
    they are gone: E. Panteley and A. Loria, "Growth rate conditions for uniform asymptotic stability of cascaded
    time-varying systems", Automatica 37 (2001).

    Raises:
        NotByThisTheoremError: a hypothesis that is not shown.
    """
    form = slopes.form
    if form.commands:
        raise NotByThisTheoremError("its inputs are limited: leave the limits out, or ask for a region")
    try:
        defined_everywhere(form)
    except UnboundedError as error:
        raise NotByThisTheoremError(str(error)) from None
    still = form if slopes.still is None else slopes.still.form
    own = _matrix(still.closed, still.symbols)
    errors = _matrix(form.closed[form.outer :], form.symbols[form.outer :])
    blocks = [_decaying(own, "the states without errors"), *([_decaying(errors, "the errors")] if errors.rows else [])]
    return Cascade(
        P=sp.diag(*(P for P, _ in blocks)), rates=tuple(rate for _, rate in blocks), growth=_growth_of_errors(form)
    )


def defined_everywhere(form: Form) -> None:
    """Nothing, if T, T⁻¹, every wire and every rate are smooth at every state, as the formulas stand.

    Raises:
        UnboundedError: the formula that is not.
    """
    look = Growth(known={}, sizes={})
    for formula in (*form.forward, *form.inverse):
        look.range(formula)
    known: dict[sp.Expr, Range] = {}
    for symbol, formula in form.limited.wires:
        known[symbol] = Growth(known=dict(known), sizes={}).range(formula)
    for formula in form.limited.raw:
        Growth(known=dict(known), sizes={}).range(formula)


def _matrix(rates: tuple[sp.Expr, ...], symbols: tuple[sp.Symbol, ...]) -> sp.Matrix:
    """The matrix of rates that are affine."""
    slopes = sp.Matrix(list(rates)).jacobian(list(symbols)) if rates else sp.zeros(0, 0)
    curved = next((rate for rate, row in zip(rates, slopes.tolist(), strict=True) if sp.Matrix(row).free_symbols), None)
    if curved is not None:
        raise NotByThisTheoremError(f"no coordinates were found in which the loop is linear: a rate is {curved}")
    return slopes


def _decaying(matrix: sp.Matrix, what: str) -> tuple[sp.Matrix, sp.Rational]:
    """(P, λ) with P > 0 and AᵀP + PA + 2λP < 0, proved."""
    numbers = np.array(matrix.evalf(30).tolist(), dtype=float)
    decay = -float(la.eigvals(numbers).real.max())
    if decay <= 0:
        raise NotByThisTheoremError(f"{what} do not decay")
    for part in (_LEAST, 0.9, 0.5, 0.0):
        rate = sp.Rational(part * decay).limit_denominator(10**6)
        shifted = numbers + (float(rate) + 1e-3 * decay) * np.eye(len(numbers))
        P = rational(la.solve_continuous_lyapunov(shifted.T, -np.eye(len(numbers))))
        S = -(matrix.T * P + P * matrix + 2 * rate * P)
        if _definite(P) and _definite(S):
            return P, rate
    raise NotByThisTheoremError(f"no quadratic form was found that shows that {what} decay")


def _definite(S: sp.Matrix) -> bool:
    """Whether a symmetric matrix is positive definite: every pivot of LDLᵀ is."""
    rows, n = [[exact_ball(v) for v in row] for row in S.tolist()], S.rows
    for k in range(n):
        if not rows[k][k] > 0:
            return False
        for i in range(k + 1, n):
            factor: arb = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return True


def _growth_of_errors(form: Form) -> tuple[tuple[PolyElement, ...], ...]:
    """Bounds of ∂(rate of w)/∂e; degree at most 1 in |w|."""
    k = form.outer
    if k == len(form.symbols):
        return ()
    _, *sizes = ring([f"|{s.name}|" for s in form.symbols], sp.QQ)
    look = Growth(known={}, sizes=dict(zip(form.symbols, sizes, strict=True)))
    rows = []
    for symbol, rate in zip(form.symbols, form.closed[:k], strict=False):
        row = []
        for error in form.symbols[k:]:
            try:
                bound = look.bound(sp.expand(sp.diff(rate, error)))
            except UnboundedError as problem:
                raise NotByThisTheoremError(f"{symbol}' by {error}: {problem}") from None
            degree = max((sum(powers[:k]) for powers in bound.monoms()), default=0)
            if degree > 1:
                raise NotByThisTheoremError(
                    f"{symbol}' by {error} may grow with degree {degree} in the states: errors may drive them to "
                    "infinity in finite time (peaking)"
                )
            row.append(bound)
        rows.append(tuple(row))
    return tuple(rows)


def worded(polynomial: PolyElement) -> str:
    """A bound as people read it, rounded up to four digits."""
    terms = []
    for powers, coefficient in polynomial.terms():
        value = Fraction(int(coefficient.numerator), int(coefficient.denominator))
        names = [f"{g}" + (f"^{p}" if p > 1 else "") for g, p in zip(polynomial.ring.symbols, powers, strict=True) if p]
        terms.append(" ".join([f"{float(value):.4g}", *names]))
    return " + ".join(terms) or "0"
