"""Changes of coordinates: every one in the library is a `Diffeomorphism`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import NoFormError, Verdict
from ulna.symbolic.exact import tidy
from ulna.symbolic.solving import invert_map


@dataclass(frozen=True, slots=True, kw_only=True)
class Diffeomorphism:
    """z = T(x) with, where it can be found, x = T⁻¹(z) on the branch through the base point.

    Attributes:
        old: (n,) coordinates x; new: (n,) coordinates z.
        forward: (n, 1) T(x).
        inverse: (n, 1) T⁻¹(z), or None; `inverted` says how sure, or what was tried.
        singular: expression whose zeros bound the domain (the Jacobian's determinant), in x.

    Examples:
        >>> change = ulna.controller_form("duffing").map
        >>> change.forward, change.inverse
        (Matrix([
        [x1],
        [x2]]), Matrix([
        [z1],
        [z2]]))
    """

    old: tuple[sp.Symbol, ...]
    new: tuple[sp.Symbol, ...]
    forward: sp.ImmutableDenseMatrix
    inverse: sp.ImmutableDenseMatrix | None
    inverted: Verdict
    singular: sp.Expr

    @property
    def jacobian(self) -> sp.ImmutableDenseMatrix:
        """(n, n) ∂T/∂x."""
        return sp.ImmutableDenseMatrix(self.forward.jacobian(list(self.old)))

    def to_new(self, expressions: sp.MatrixBase) -> sp.ImmutableDenseMatrix:
        """Expressions in x rewritten in z through the inverse.

        Raises:
            NoFormError: if no inverse was found.
        """
        if self.inverse is None:
            raise NoFormError(
                "expressions in the new coordinates",
                "no inverse of the transformation was found.",
                "Work in the old coordinates; nothing in the design needs the inverse.",
                value=self.inverted,
            )
        back = dict(zip(self.old, self.inverse, strict=True))
        return sp.ImmutableDenseMatrix(expressions.xreplace(back).applyfunc(tidy))

    def to_old(self, expressions: sp.MatrixBase) -> sp.ImmutableDenseMatrix:
        """Expressions in z rewritten in x."""
        return sp.ImmutableDenseMatrix(expressions.xreplace(dict(zip(self.new, self.forward, strict=True))))

    def _repr_latex_(self) -> str:
        from ulna.symbolic.formulas import expression_latex

        return f"$$z = {expression_latex(self.forward)}$$"


def new_symbols(
    stem: str, count: int, taken: Sequence[sp.Symbol] = (), *, plain_if_one: bool = False
) -> tuple[sp.Symbol, ...]:
    """`count` real symbols stem1, stem2, … (just `stem` for one, if asked), avoiding names taken."""
    names = {s.name for s in taken}
    endings = [""] if count == 1 and plain_if_one else [str(k + 1) for k in range(count)]
    while any(stem + ending in names for ending in endings):
        stem += "_"
    return tuple(sp.Symbol(stem + ending, real=True) for ending in endings)


def diffeomorphism(
    forward: sp.MatrixBase,
    old: Sequence[sp.Symbol],
    new: Sequence[sp.Symbol],
    *,
    near: Mapping[sp.Symbol, sp.Expr],
    singular: sp.Expr,
    seconds: float = 3.0,
) -> Diffeomorphism:
    """The change of coordinates z = T(x), its inverse sought on the branch through `near`.

    Args:
        forward: (n, 1) T(x); old, new: (n,) coordinates.
        near: base point, a value for each of `old`.
        singular: determinant of ∂T/∂x or an expression with the same zeros.
        seconds: time budget of the search for the inverse.
    """
    found = invert_map(list(forward), tuple(old), tuple(new), near=dict(near), seconds=seconds)
    inverse = None if found.expressions is None else sp.ImmutableDenseMatrix(list(found.expressions))
    return Diffeomorphism(
        old=tuple(old),
        new=tuple(new),
        forward=sp.ImmutableDenseMatrix(forward),
        inverse=inverse,
        inverted=found.verdict,
        singular=singular,
    )
