"""Fractions in lowest terms and irreducible factors, over sines, exponentials, logarithms and roots: exact algebra."""

from __future__ import annotations

from collections.abc import Sequence

from sympy import Abs, Expr, cancel, preorder_traversal, sign, together

from ulna.symbolic.exact.angles import with_plain_angles
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.embed import attempt_exactly, embed

_SECONDS_PER_ENTRY = 0.5

_SMALL = 80
"""Nodes below which expressions stay as they are written."""

_LARGE = 20_000
"""Nodes above which nothing is tried."""


def normal_form(expression: Expr) -> Expr:
    """One fraction in lowest terms and irreducible factors; equal expressions have equal ones.

    Raises:
        ExactAlgebraError: see `ulna.symbolic.exact.embed.embed`.
    """
    ring, [element] = embed([expression])
    return ring.factored(ring.make(*element))


def lowest_terms(expression: Expr, *, seconds: float = 0.3) -> Expr:
    """The normal form where it is found in time and brings in no sign function, else the expression as it is.

    A sign function that was not there before reads worse than the root or modulus it came from.
    """
    if expression.is_Atom:
        return expression
    found = attempt_exactly(seconds, "lowest terms", normal_form, expression).value
    return expression if found is None or (found.has(sign) and not expression.has(sign)) else found


def normal(expression: Expr) -> Expr:
    """The expression as one fraction, angles as they are written, where that is found quickly."""
    if expression.is_Atom:
        return expression
    exact = attempt_exactly(_SECONDS_PER_ENTRY, "normal form", _with_plain_angles, [expression])
    if exact.value is not None and not exact.value[0].has(sign, Abs):
        return exact.value[0]
    for what, function in (("cancel", cancel), ("together", together)):
        found = attempt(_SECONDS_PER_ENTRY, what, function, expression)
        if found.value is not None:
            return found.value
    return expression


def compact(expressions: Sequence[Expr], *, seconds: float = 0.5) -> tuple[Expr, ...]:
    """The expressions, each as one fraction, angles as they are written, where that is shorter: for long chains.

    Their values do not change where all their parts are real. Small ones stay as they are, large ones and those that
    take too long as well: a third bracket of a two-link arm is ten times shorter this way and found sooner.
    """
    sizes = [_nodes(e, _LARGE) for e in expressions]
    if not _SMALL < sum(sizes) < _LARGE:
        return tuple(expressions)
    found = attempt_exactly(seconds, "normal forms", _with_plain_angles, expressions)
    if found.value is None:
        return tuple(expressions)
    return tuple(
        new if _nodes(new, size) < size and not new.has(sign, Abs) else old
        for old, new, size in zip(expressions, found.value, sizes, strict=True)
    )


def _with_plain_angles(expressions: Sequence[Expr]) -> list[Expr]:
    plain, meaning = with_plain_angles(expressions)
    ring, elements = embed(plain)
    return [ring.factored(ring.make(*element)).xreplace(meaning) for element in elements]


def _nodes(expression: Expr, limit: int) -> int:
    count = 0
    for _ in preorder_traversal(expression):
        count += 1
        if count >= limit:
            break
    return count
