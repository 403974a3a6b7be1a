"""On which side of the imaginary axis the roots of a polynomial lie, decided exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import flint
import sympy as sp

from ulna.base import Verdict
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.ball import exact_ball
from ulna.symbolic.exact.zero import is_zero

_PRECISIONS = (64, 256, 1024)


@dataclass(frozen=True, slots=True, kw_only=True)
class RootLocation:
    """How many roots (with multiplicity) lie left of, on and right of the imaginary axis.

    Attributes:
        left, right: numbers of roots with negative and positive real part.
        zero: multiplicity of the root 0.
        squares: ω² of the pairs ±iω on the axis, one entry per pair.
        unstable: True if some root is certainly on the right; set also where the counts are not known.
        roots: decimal values for reading.
        verdict: on "the roots are located"; the counts are meaningless unless it holds.
    """

    left: int
    right: int
    zero: int
    squares: tuple[sp.Expr, ...]
    unstable: bool
    roots: tuple[str, ...]
    verdict: Verdict

    @property
    def on_axis(self) -> int:
        """The number of roots with real part zero."""
        return self.zero + 2 * len(self.squares)


@dataclass(slots=True, kw_only=True)
class _Count:
    left: int = 0
    right: int = 0
    zero: int = 0
    squares: list[sp.Expr] = field(default_factory=list)
    roots: list[str] = field(default_factory=list)

    def result(self, method: str) -> RootLocation:
        return RootLocation(
            left=self.left,
            right=self.right,
            zero=self.zero,
            squares=tuple(self.squares),
            unstable=self.right > 0,
            roots=tuple(self.roots),
            verdict=Verdict.proved("the roots are located", method=method),
        )


class _UndecidedError(Exception):
    """Says in words what could not be decided."""


def eigenvalue_location(matrix: sp.MatrixBase, *, seconds: float = 2.0) -> RootLocation:
    """Where the eigenvalues of a real (k, k) matrix lie.

    Rational entries: factors over ℚ; even factors by Sturm's theorem, others by isolating balls, which end because a
    factor that is irreducible and not even has no root on the axis. Other numbers: balls. Symbols: signs of the
    coefficients and Hurwitz determinants of the factors, as far as the assumptions on the symbols tell them.
    """
    attempted = attempt(seconds, "eigenvalues", _located, sp.Matrix(matrix))
    if attempted.value is not None:
        return attempted.value
    verdict = Verdict.undecided("the roots are located", tried=attempted.reason)
    return RootLocation(left=0, right=0, zero=0, squares=(), unstable=False, roots=(), verdict=verdict)


def _located(matrix: sp.MatrixBase) -> RootLocation:
    variable = sp.Dummy("lambda")
    polynomial = matrix.charpoly(variable)
    coefficients = polynomial.all_coeffs()
    try:
        if all(c.is_Rational for c in coefficients):
            return _rational(coefficients, variable)
        if all(c.is_number for c in coefficients):
            return _numeric(coefficients)
        return _symbolic(coefficients, variable)
    except _UndecidedError as reason:
        verdict = Verdict.undecided("the roots are located", tried=str(reason))
        return RootLocation(left=0, right=0, zero=0, squares=(), unstable=False, roots=(), verdict=verdict)


def _rational(coefficients: Sequence[sp.Expr], variable: sp.Symbol) -> RootLocation:
    count = _Count()
    _, factors = sp.Poly(coefficients, variable, domain="QQ").factor_list()
    for factor, multiplicity in factors:
        _count_factor(factor, multiplicity, count)
    return count.result("factors over the rationals, isolating balls")


def _count_factor(factor: sp.Poly, multiplicity: int, count: _Count) -> None:
    variable, degree = factor.gen, factor.degree()
    texts, sides = _balls(factor.all_coeffs())
    count.roots.extend(texts * multiplicity)
    if factor.all_coeffs() == [factor.LC(), 0]:
        count.zero += multiplicity
        return
    even = all(exponent % 2 == 0 for (exponent,), _ in factor.terms())
    if not even:
        if sides is None:
            raise _UndecidedError(f"roots of {factor.as_expr()} next to the imaginary axis")
        count.left += multiplicity * sum(s < 0 for s in sides)
        count.right += multiplicity * sum(s > 0 for s in sides)
        return
    halved = sp.Poly({(e // 2,): c for (e,), c in factor.terms()}, variable, domain="QQ")
    pairs = int(halved.count_roots(None, 0))
    squares = [-r for r in halved.real_roots() if r.is_negative]
    count.squares.extend(squares * multiplicity)
    count.left += multiplicity * (degree - 2 * pairs) // 2
    count.right += multiplicity * (degree - 2 * pairs) // 2


def _balls(coefficients: Sequence[sp.Expr]) -> tuple[list[str], list[int] | None]:
    """Roots as text, and the sign of each real part (None if a ball touches the axis), for simple roots."""
    texts: list[str] = []
    for precision in _PRECISIONS:
        with flint.ctx.workprec(precision):
            polynomial = flint.acb_poly([exact_ball(c) for c in reversed(coefficients)])
            try:
                roots = polynomial.roots(tol=flint.arb(2) ** (-precision // 2), maxprec=4 * precision)
            except ValueError:
                continue
            texts = [_text(r) for r in roots]
            if all(not r.real.contains(0) for r in roots):
                return texts, [1 if r.real > 0 else -1 for r in roots]
    return texts, None


def _text(root: flint.acb) -> str:
    real, imaginary = float(root.real.mid()), float(root.imag.mid())
    real = 0.0 if abs(real) < 1e-15 * max(1.0, abs(imaginary)) else real
    if abs(imaginary) < 1e-15 * max(1.0, abs(real)):
        return f"{real:.6g}"
    return f"{imaginary:+.6g}i" if real == 0 else f"{real:.6g}{imaginary:+.6g}i"


def _numeric(coefficients: Sequence[sp.Expr]) -> RootLocation:
    """Real numbers that are not rational: zero coefficients are proved, the rest is counted with balls."""
    exact = [sp.Integer(0) if is_zero(c).holds else c for c in coefficients]
    count = _Count()
    while exact[-1] == 0:
        exact.pop()
        count.zero += 1
    if len(exact) > 1 and all(c == 0 for c in exact[1::2]):
        return _even_numeric(exact, count)
    count.roots = ["0"] * count.zero
    for part, multiplicity in _square_free(exact):
        texts, sides = _balls(part)
        if sides is None:
            raise _UndecidedError(f"roots next to the imaginary axis: {', '.join(texts)}")
        count.left += multiplicity * sum(s < 0 for s in sides)
        count.right += multiplicity * sum(s > 0 for s in sides)
        count.roots += texts * multiplicity
    return count.result("isolating balls")


def _square_free(coefficients: Sequence[sp.Expr]) -> list[tuple[list[sp.Expr], int]]:
    """Factors with simple roots only, where the coefficients are algebraic; else the polynomial as it is."""
    if len(coefficients) <= 1:
        return []
    whole = [(list(coefficients), 1)]
    if _balls(coefficients)[1] is not None:
        return whole
    variable = sp.Dummy("lambda")
    found = attempt(
        0.5, "square-free factors", lambda: sp.Poly(list(coefficients), variable, extension=True).sqf_list()[1]
    )
    return whole if not found.value else [(part.all_coeffs(), multiplicity) for part, multiplicity in found.value]


def _even_numeric(exact: Sequence[sp.Expr], count: _Count) -> RootLocation:
    """p(λ) = s(λ²): the roots w of s that are negative are pairs on the axis."""
    halved = list(exact[::2])
    if len(halved) == 2:
        squares: list[sp.Expr] = [halved[1] / halved[0]]
    elif len(halved) == 3:
        a, b, c = halved
        root = sp.sqrt(b**2 - 4 * a * c)
        squares = [(b - root) / (2 * a), (b + root) / (2 * a)]
    else:
        raise _UndecidedError("an even characteristic polynomial of degree six or more")
    for square in squares:
        sign = _sign(square)
        if sign is None or not square.is_real:
            if square.is_real is False:
                count.left += 1
                count.right += 1
                continue
            raise _UndecidedError(f"the sign of {square}")
        if sign > 0:
            count.squares.append(square)
        else:
            count.left += 1
            count.right += 1
    return count.result("even characteristic polynomial")


def _sign(expression: sp.Expr) -> int | None:
    """−1, 0 or 1, or None where it is not known."""
    if expression.is_zero:
        return 0
    if expression.is_number:
        ball = exact_ball(expression)
        if ball.is_finite() and not ball.contains(0):
            return 1 if ball > 0 else -1
        return 0 if is_zero(expression).holds else None
    for form in (expression, sp.factor(expression), sp.expand(expression)):
        if form.is_positive:
            return 1
        if form.is_negative:
            return -1
        if form.is_zero:
            return 0
    return None


def _symbolic(coefficients: Sequence[sp.Expr], variable: sp.Symbol) -> RootLocation:
    count = _Count()
    _, factors = sp.factor_list(sp.Poly(coefficients, variable).as_expr(), variable)
    unknown = ""
    for factor, multiplicity in factors:
        polynomial = sp.Poly(factor, variable)
        leading = _sign(polynomial.LC())
        own = [sp.cancel(c / polynomial.LC()) for c in polynomial.all_coeffs()]
        signs = [_sign(c) for c in own]
        if leading == 0 or polynomial.degree() == 0:
            continue
        if any(s == -1 for s in signs):
            # All roots in the closed left half plane would make all coefficients nonnegative.
            verdict = Verdict.undecided("the roots are located", unstable_factor=factor)
            return RootLocation(left=0, right=1, zero=0, squares=(), unstable=True, roots=(), verdict=verdict)
        try:
            _count_symbolic(own, signs, multiplicity, count)
        except _UndecidedError as reason:
            unknown = str(reason)
    if unknown:
        raise _UndecidedError(unknown)
    return count.result("signs of coefficients and Hurwitz determinants")


def _count_symbolic(own: Sequence[sp.Expr], signs: Sequence[int | None], multiplicity: int, count: _Count) -> None:
    degree = len(own) - 1
    if degree == 1 and signs[1] == 0:
        count.zero += multiplicity
    elif degree == 2 and signs[1] == 0 and signs[2] == 1:
        count.squares.extend([own[2]] * multiplicity)
    elif None not in signs and 0 not in signs and _hurwitz(own):
        count.left += degree * multiplicity
    else:
        raise _UndecidedError(f"signs of the coefficients {list(own)}")


def _hurwitz(own: Sequence[sp.Expr]) -> bool:
    """Whether all Hurwitz determinants are positive; False where a sign is not known."""
    n = len(own) - 1
    if n <= 2:
        return True
    if n > 5:
        return False

    def entry(i: int, j: int) -> sp.Expr:
        k = 2 * (j + 1) - (i + 1)
        return own[k] if 0 <= k <= n else sp.Integer(0)

    matrix = sp.Matrix(n, n, lambda i, j: entry(int(i), int(j)))
    return all(_sign(sp.factor(matrix[:k, :k].det())) == 1 for k in range(2, n))
