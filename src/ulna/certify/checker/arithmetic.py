"""Arithmetic of the second program: exact fractions, balls, derivatives in forward mode."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp
from flint import arb

from ulna.base import Status
from ulna.symbolic.exact import is_zero


class NotRightError(Exception):
    """A step that fails."""


@dataclass(slots=True)
class Dual:
    """A ball and its derivatives by every state, balls; an empty row stands for zeros."""

    value: arb
    slope: list[arb]


Box = list[tuple[Fraction, Fraction]]
"""Middle and half-width of every side."""


def halves(box: Box, axis: int) -> list[Box]:
    """The upper half, then the lower one, which is taken from the end of a stack first."""
    middle, half = box[axis]
    found = []
    for sign in (1, -1):
        part = list(box)
        part[axis] = (middle + sign * half / 2, half / 2)
        found.append(part)
    return found


def vanishes(expression: sp.Expr) -> bool:
    """Whether an expression is 0 as a formula."""
    return sp.expand(expression) == 0 or is_zero(expression).status is Status.PROVED


def quadratic_of_inverse(S: list[list[arb]], c: list[arb]) -> arb:
    """cᵀS⁻¹c of a positive definite S, by elimination."""
    rows, total = [[*row, value] for row, value in zip(S, c, strict=True)], arb(0)
    for k in range(len(rows)):
        total += rows[k][-1] * rows[k][-1] / rows[k][k]
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return total


def dot(left: Iterable[arb], right: Iterable[arb]) -> arb:
    """Of two rows, as far as the shorter one goes."""
    return sum((a * b for a, b in zip(left, right, strict=False)), arb(0))


def times(matrix: Iterable[Sequence[arb]], vector: Sequence[arb]) -> list[arb]:
    """The rows times a vector, which may be the first part of them."""
    return [dot(vector, row) for row in matrix][: len(vector)]


# ------------------------------------------------------------------------------------------------------- arithmetic


def fraction(text: str) -> Fraction:
    """The exact number that a text writes."""
    return Fraction(text)


def exactly(value: Fraction) -> arb:
    """A ball around a fraction."""
    return arb(value.numerator) / value.denominator


def around(middle: Fraction, radius: Fraction) -> arb:
    """A ball around all numbers so near the middle."""
    return exactly(middle) + arb(0, 1) * exactly(radius)


def power_above(square: Fraction) -> Fraction:
    """A power of two not below the square root of a fraction."""
    power = Fraction(1)
    while power * power < square:
        power *= 2
    while power * power / 4 >= square:
        power /= 2
    return power


def inverse(matrix: list[list[Fraction]]) -> list[list[Fraction]]:
    """By Gauss and Jordan, exactly."""
    n = len(matrix)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(n))] for i, row in enumerate(matrix)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k] != 0), None)
        if pivot is None:
            raise NotRightError("P, or the Jacobian at the equilibrium, is singular")
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for i in range(n):
            if i != k and rows[i][k] != 0:
                factor = rows[i][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[n:] for row in rows]


def pivots(matrix: Sequence[Sequence[arb]]) -> list[arb]:
    """Of LDLᵀ of a symmetric matrix: all positive exactly where it is positive definite."""
    rows, found = [list(row) for row in matrix], []
    for k in range(len(rows)):
        pivot = rows[k][k]
        found.append(pivot)
        if not pivot > 0:
            break
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / pivot
            for j in range(k + 1, len(rows)):
                rows[i][j] -= factor * rows[k][j]
    return found


def definite(S: list[list[arb]]) -> bool:
    """Whether every symmetric matrix in S is positive definite: pivots after a scaling by a factor of its middle.

    XᵀSX is definite exactly where S is, for any invertible X; that of the Cholesky factor of the middle makes it nearly
    the unit matrix.
    """
    n = len(S)
    if not all(v.is_finite() for row in S for v in row):
        return False
    X = triangle([[float(v.mid()) for v in row] for row in S])
    if X is None:
        return False
    half = [[sum((S[i][k] * X[k][j] for k in range(n)), arb(0)) for j in range(n)] for i in range(n)]
    turned = [[sum((X[k][i] * half[k][j] for k in range(n)), arb(0)) for j in range(n)] for i in range(n)]
    return all(pivot > 0 for pivot in pivots(turned))


def triangle(P: list[list[float]]) -> list[list[arb]] | None:
    """L⁻ᵀ of P = LLᵀ in floating point, as exact numbers: upper triangular with a positive diagonal, so invertible.

    None where P is not positive definite.
    """
    n = len(P)
    L = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            value = P[i][j] - sum(L[i][k] * L[j][k] for k in range(j))
            if i == j and value <= 0:
                return None
            L[i][j] = value**0.5 if i == j else value / L[j][j]
    inverse = [[0.0] * n for _ in range(n)]
    for j in range(n):
        for i in range(j, n):
            value = (1.0 if i == j else 0.0) - sum(L[i][k] * inverse[k][j] for k in range(j, i))
            inverse[i][j] = value / L[i][i]
    return [[arb(inverse[j][i]) for j in range(n)] for i in range(n)]


def approximate_inverse(matrix: list[list[arb]]) -> list[list[arb]]:
    """Of the middle; any matrix makes Krawczyk's test valid."""
    middle = [[Fraction(float(v.mid())) for v in row] for row in matrix]
    return [[arb(float(v)) for v in row] for row in inverse(middle)]


# ---------------------------------------------------------------------------------------------------- differentiation


def dual(e: Any, known: dict[sp.Symbol, Dual], shared: dict[sp.Expr, Dual]) -> Dual:
    """Value and derivatives of an expression, by the chain rule."""
    if e in shared:
        return shared[e]
    if e.is_Symbol:
        return known[e]
    if e.is_Rational:
        found = Dual(arb(int(e.p)) / int(e.q), [])
    elif e is sp.pi or e is sp.E:
        found = Dual(arb.pi() if e is sp.pi else arb(1).exp(), [])
    elif e.is_Add:
        terms = [dual(a, known, shared) for a in e.args]
        found = Dual(sum((t.value for t in terms), arb(0)), sum_of_slopes([t.slope for t in terms]))
    elif e.is_Mul:
        found = dual_of_product([dual(a, known, shared) for a in e.args])
    elif e.is_Pow and e.exp.is_Rational:
        found = dual_of_power(dual(e.base, known, shared), e.exp)
    elif e.is_Pow and e.base is sp.E:
        inner = dual(e.exp, known, shared)
        found = chained(inner, inner.value.exp(), inner.value.exp())
    elif e.func in (sp.Min, sp.Max):
        found = dual_of_choice([dual(a, known, shared) for a in e.args], smaller=e.func is sp.Min)
    else:
        found = dual_of_function(e, known, shared)
    shared[e] = found
    return found


_FUNCTIONS: Mapping[str, Callable[[arb], tuple[arb, arb]]] = {
    "sin": lambda x: (x.sin(), x.cos()),
    "cos": lambda x: (x.cos(), -x.sin()),
    "tan": lambda x: (x.tan(), 1 + x.tan() * x.tan()),
    "exp": lambda x: (x.exp(), x.exp()),
    "log": lambda x: (x.log(), 1 / x),
    "sinh": lambda x: (x.sinh(), x.cosh()),
    "cosh": lambda x: (x.cosh(), x.sinh()),
    "tanh": lambda x: (x.tanh(), 1 - x.tanh() * x.tanh()),
    "asin": lambda x: (x.asin(), 1 / (1 - x * x).sqrt()),
    "acos": lambda x: (x.acos(), -1 / (1 - x * x).sqrt()),
    "atan": lambda x: (x.atan(), 1 / (1 + x * x)),
    "asinh": lambda x: (x.asinh(), 1 / (1 + x * x).sqrt()),
    "acosh": lambda x: (x.acosh(), 1 / (x * x - 1).sqrt()),
    "atanh": lambda x: (x.atanh(), 1 / (1 - x * x)),
}
"""Value and derivative."""


def dual_of_function(e: Any, known: dict[sp.Symbol, Dual], shared: dict[sp.Expr, Dual]) -> Dual:
    """A function of one argument."""
    name = e.func.__name__
    if name not in _FUNCTIONS or len(e.args) != 1:
        raise NotRightError(f"the function {name} is not supported")
    inner = dual(e.args[0], known, shared)
    return chained(inner, *_FUNCTIONS[name](inner.value))


def dual_of_choice(given: list[Dual], *, smaller: bool) -> Dual:
    """The smallest or largest of some values; where it is open which, its slope is any of theirs."""
    found = given[0]
    for each in given[1:]:
        if found.value < each.value or each.value < found.value:
            found = found if (found.value < each.value) == smaller else each
            continue
        value = found.value.min(each.value) if smaller else found.value.max(each.value)
        width = max(len(found.slope), len(each.slope))
        a, b = (row or [arb(0)] * width for row in (found.slope, each.slope))
        found = Dual(value, [x.union(y) for x, y in zip(a, b, strict=True)])
    return found


def chained(inner: Dual, value: arb, slope: arb) -> Dual:
    """A function of one argument, by the chain rule."""
    return Dual(value, [slope * each for each in inner.slope])


def dual_of_power(base: Dual, exponent: Any) -> Dual:
    """A rational power."""
    p, q = int(exponent.p), int(exponent.q)
    if q == 1:
        return chained(base, whole_power(base.value, p), arb(p) * whole_power(base.value, p - 1))
    # A root is real for a base above 0 only; arb answers NaN otherwise, which settles no box.
    power = arb(p) / q
    return chained(base, base.value**power, power * base.value ** (power - 1))


def whole_power(x: arb, p: int) -> arb:
    """x**p by products: python-flint's own power of a ball around 0 is NaN."""
    if p < 0:
        return 1 / whole_power(x, -p)
    found = arb(1)
    for digit in f"{p:b}":
        found = found * found * (x if digit == "1" else 1)
    return found


def dual_of_product(factors: list[Dual]) -> Dual:
    """A product, factor by factor."""
    value, slope = factors[0].value, factors[0].slope
    for each in factors[1:]:
        slope = sum_of_slopes([[s * each.value for s in slope], [value * s for s in each.slope]])
        value = value * each.value
    return Dual(value, slope)


def sum_of_slopes(rows: list[list[arb]]) -> list[arb]:
    """The sum of rows of derivatives; an empty row stands for zeros."""
    full = [row for row in rows if row]
    return [sum(column, arb(0)) for column in zip(*full, strict=True)] if full else []
