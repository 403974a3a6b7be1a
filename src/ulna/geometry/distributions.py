"""Distributions: spans of vector fields, their dimension, members, annihilator, involutivity and closure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from sympy import ImmutableDenseMatrix, Matrix, Symbol
from sympy.matrices import MatrixBase

from ulna.base import UlnaError, Verdict, all_of
from ulna.geometry.lie import Scalar, expression, lie_bracket
from ulna.geometry.oneform import OneForm
from ulna.symbolic.exact import Rank, generic_rank, in_span, null_space, rank_at, reduced_against, without_common_factor


@dataclass(frozen=True, slots=True, kw_only=True)
class Distribution:
    """span{f₁, …, f_m} over n coordinates; the fields may be dependent.

    Args:
        coordinates: x, n symbols.
        fields: vector fields of shape (n, 1).

    Examples:
        >>> import sympy as sp
        >>> x, y = sp.symbols("x y", real=True)
        >>> span = ulna.distribution([sp.Matrix([1, y]), sp.Matrix([0, x])], [x, y])
        >>> span.fields[1].T
        Matrix([[0, x]])
    """

    coordinates: tuple[Symbol, ...]
    fields: tuple[ImmutableDenseMatrix, ...]

    def __post_init__(self) -> None:
        shape = (len(self.coordinates), 1)
        for number, field in enumerate(self.fields):
            if tuple(field.shape) != shape:
                raise UlnaError(
                    f"a distribution over {shape[0]} coordinates",
                    f"field number {number} has shape {tuple(field.shape)} instead of {shape}.",
                    "Vector fields are columns, one entry per coordinate.",
                )

    @property
    def matrix(self) -> ImmutableDenseMatrix:
        """The fields side by side, shape (n, m)."""
        if not self.fields:
            return ImmutableDenseMatrix(len(self.coordinates), 0, [])
        return ImmutableDenseMatrix.hstack(*self.fields)


def distribution(fields: Sequence[MatrixBase], coordinates: Sequence[Symbol]) -> Distribution:
    """The span of columns (n, 1).

    Examples:
        >>> import sympy as sp
        >>> x, y = sp.symbols("x y", real=True)
        >>> ulna.distribution([sp.Matrix([1, y])], [x, y]).coordinates
        (x, y)
    """
    return Distribution(coordinates=tuple(coordinates), fields=tuple(ImmutableDenseMatrix(field) for field in fields))


def generic_dimension(span: Distribution) -> Rank:
    """The dimension on an open dense set."""
    return _rank_of(*span.fields)


def dimension_at(span: Distribution, point: Mapping[Symbol, Scalar]) -> Rank:
    """The dimension at a point; parameters without a value there stay generic."""
    return rank_at(span.matrix.as_mutable(), {x: expression(value) for x, value in point.items()})


def generic_basis(span: Distribution) -> Distribution:
    """Fields chosen among the spanning ones, in their order, that are independent on an open dense set."""
    kept: list[ImmutableDenseMatrix] = []
    for field in span.fields:
        if len(kept) == len(span.coordinates):
            break
        if _rank_of(*kept, field).value > len(kept):
            kept.append(field)
    return Distribution(coordinates=span.coordinates, fields=tuple(kept))


def contains(span: Distribution, field: MatrixBase) -> Verdict:
    """Whether the field lies in the span on an open dense set; the evidence holds both ranks and the point."""
    return in_span(field, span.matrix)


def annihilator(span: Distribution) -> tuple[OneForm, ...]:
    """n − d one-forms that vanish on the span and are independent on an open dense set."""
    n = len(span.coordinates)
    if not span.fields:
        rows = [ImmutableDenseMatrix.eye(n)[i, :] for i in range(n)]
    else:
        rows = [column.T for column in null_space(span.matrix.T)]
    return tuple(OneForm(coordinates=span.coordinates, row=row) for row in rows)


def involutive(span: Distribution) -> Verdict:
    """Whether all brackets of spanning fields lie in the span, on an open dense set.

    The refutation's evidence: `pair` (positions i < j among the spanning fields), `bracket` = [f_i, f_j],
    `rank_before`, `rank_after` and the `point` where the ranks were taken.

    Examples:
        >>> import sympy as sp
        >>> x, y, z = sp.symbols("x y z", real=True)
        >>> span = ulna.distribution([sp.Matrix([1, 0, y]), sp.Matrix([0, 1, 0])], [x, y, z])
        >>> ulna.involutive(span).fails  # the bracket has a part along z
        True
    """
    claim = "the distribution is involutive"
    basis = generic_basis(span)
    if len(basis.fields) >= len(span.coordinates):
        return Verdict.proved(claim, reason="it is the whole tangent space")
    parts = []
    for i, j in combinations(range(len(basis.fields)), 2):
        bracket = lie_bracket(basis.fields[i], basis.fields[j], span.coordinates)
        if all(entry == 0 for entry in bracket):
            continue
        part = contains(basis, bracket)
        if part.fails:
            pair = (span.fields.index(basis.fields[i]), span.fields.index(basis.fields[j]))
            return Verdict.refuted(claim, **{**part.evidence, "pair": pair, "bracket": bracket})
        parts.append(part)
    return all_of(claim, parts, dimension=len(basis.fields))


def involutive_closure(span: Distribution) -> Distribution:
    """The smallest involutive distribution that contains the span, as a generic basis: fields first, then brackets."""
    fields = list(generic_basis(span).fields)
    first = 0
    while first < len(fields) < len(span.coordinates):
        known = len(fields)
        for i in range(known):
            for j in range(max(i + 1, first), known):
                bracket = lie_bracket(fields[i], fields[j], span.coordinates)
                if len(fields) == len(span.coordinates):
                    break
                if _rank_of(*fields, bracket).value > len(fields):
                    fields.append(bracket)
        first = known
    return Distribution(coordinates=span.coordinates, fields=tuple(fields))


def filtration(
    drift: MatrixBase, inputs: Sequence[MatrixBase], coordinates: Sequence[Symbol], order: int
) -> tuple[Distribution, ...]:
    """G₀ ⊂ G₁ ⊂ … ⊂ G_order, G₀ = span of the input fields, Gₖ = Gₖ₋₁ + [f, Gₖ₋₁], each with a short generic basis.

    These are the spans of ad_fⁱ g_j, i ≤ k (Isidori, Nonlinear Control Systems, 1995, sec. 5.2), but the fields are
    not the brackets: each is reduced by the fields before it and freed of common factors, which
    [f, a X] = a [f, X] − (L_f a) X allows. Brackets themselves grow tenfold with every step.

    Args:
        drift: f, shape (n, 1).
        inputs: the g_j, shape (n, 1).
        coordinates: x, n symbols.
        order: of the last member.
    """
    fields = _reduced_fields([], inputs)
    members = [Distribution(coordinates=tuple(coordinates), fields=tuple(fields))]
    newest = fields
    for _ in range(order):
        brackets = [lie_bracket(drift, field, coordinates) for field in newest]
        newest = _reduced_fields(fields, brackets)
        fields = [*fields, *newest]
        members.append(Distribution(coordinates=tuple(coordinates), fields=tuple(fields)))
    return tuple(members)


def _reduced_fields(known: Sequence[ImmutableDenseMatrix], more: Sequence[MatrixBase]) -> list[ImmutableDenseMatrix]:
    """Of the additional fields those that are new, reduced by the known ones and those before."""
    found: list[ImmutableDenseMatrix] = []
    for field in more:
        before = [*known, *found]
        if len(before) == field.rows:
            break
        rows = ImmutableDenseMatrix([list(f) for f in before]) if before else ImmutableDenseMatrix(0, field.rows, [])
        reduced = reduced_against(list(field), rows) if before else without_common_factor(list(field))
        if reduced is None:
            reduced = tuple(field) if _rank_of(*before, field).value > len(before) else ()
        if any(entry != 0 for entry in reduced):
            found.append(ImmutableDenseMatrix(field.rows, 1, reduced))
    return found


def _rank_of(*fields: MatrixBase) -> Rank:
    return generic_rank(Matrix.hstack(*(field.as_mutable() for field in fields)))
