"""Expressions kept short along a chain of derivatives, by exact algebra and only while that is quick."""

from __future__ import annotations

from collections.abc import Sequence

from sympy import Abs, Expr, preorder_traversal, sign

from ulna.symbolic.exact.angles import with_plain_angles
from ulna.symbolic.exact.embed import attempt_exactly, embed

_SMALL = 80
"""Nodes below which expressions stay as they are written."""

_LARGE = 20_000
"""Nodes above which nothing is tried."""


def compact(expressions: Sequence[Expr], *, seconds: float = 0.5) -> tuple[Expr, ...]:
    """The expressions, each as one fraction in lowest terms and irreducible factors where that is shorter.

    Their values do not change where all their parts are real. Small ones stay as they are, large ones and those that
    take too long as well: a third bracket of a two-link arm is ten times shorter this way and found sooner.
    """
    sizes = [_nodes(e, _LARGE) for e in expressions]
    if not _SMALL < sum(sizes) < _LARGE:
        return tuple(expressions)
    found = attempt_exactly(seconds, "normal forms", _normal_forms, expressions)
    if found.value is None:
        return tuple(expressions)
    return tuple(
        new if _nodes(new, size) < size and not new.has(sign, Abs) else old
        for old, new, size in zip(expressions, found.value, sizes, strict=True)
    )


def _normal_forms(expressions: Sequence[Expr]) -> list[Expr]:
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
