"""One-forms: exterior derivative, products, closedness and Frobenius' condition.

A one-form ω = Σ wᵢ dxᵢ carries its coordinates; a two-form is the antisymmetric matrix of its components.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from sympy import Expr, ImmutableDenseMatrix, Integer, Symbol
from sympy.matrices import MatrixBase

from ulna.base import UlnaError, Verdict, all_of
from ulna.geometry.lie import Scalar, expression
from ulna.symbolic.exact import is_zero, null_space


@dataclass(frozen=True, slots=True, kw_only=True)
class OneForm:
    """ω = Σ wᵢ dxᵢ.

    Args:
        coordinates: x, n symbols.
        row: the wᵢ, shape (1, n).

    Examples:
        >>> import sympy as sp
        >>> x, y = sp.symbols("x y", real=True)
        >>> form = ulna.one_form([2 * x, 2 * y], [x, y])
        >>> ulna.integrate(form).value
        x**2 + y**2
    """

    coordinates: tuple[Symbol, ...]
    row: ImmutableDenseMatrix

    def __post_init__(self) -> None:
        shape = (1, len(self.coordinates))
        if tuple(self.row.shape) != shape:
            raise UlnaError(
                f"a one-form over {shape[1]} coordinates",
                f"its components have shape {tuple(self.row.shape)} instead of {shape}.",
                "Components are a row, one entry per coordinate.",
            )

    @property
    def components(self) -> tuple[Expr, ...]:
        """The wᵢ as a tuple."""
        return tuple(self.row)


def one_form(components: Sequence[Scalar] | MatrixBase, coordinates: Sequence[Symbol]) -> OneForm:
    """ω = Σ wᵢ dxᵢ from its components (a sequence or a matrix of n entries).

    Examples:
        >>> import sympy as sp
        >>> x, y = sp.symbols("x y", real=True)
        >>> ulna.one_form([y, x], [x, y]).row
        Matrix([[y, x]])
    """
    row = ImmutableDenseMatrix([[expression(c) for c in components]])
    return OneForm(coordinates=tuple(coordinates), row=row)


def differential(function: Scalar, coordinates: Sequence[Symbol]) -> OneForm:
    """dh = Σ (∂h/∂xᵢ) dxᵢ."""
    scalar = expression(function)
    return one_form([scalar.diff(x) for x in coordinates], coordinates)


def scaled(factor: Scalar, form: OneForm) -> OneForm:
    """μ ω."""
    return one_form([factor * w for w in form.components], form.coordinates)


def exterior_derivative(form: OneForm) -> ImmutableDenseMatrix:
    """dω as the antisymmetric matrix (n, n) of ∂wⱼ/∂xᵢ − ∂wᵢ/∂xⱼ, so that dω = Σ_{i<j} (dω)ᵢⱼ dxᵢ ∧ dxⱼ."""
    x, w = form.coordinates, form.components
    upper = {(i, j): w[j].diff(x[i]) - w[i].diff(x[j]) for i, j in combinations(range(len(x)), 2)}
    return _antisymmetric(upper, len(x))


def wedge(first: OneForm, second: OneForm) -> ImmutableDenseMatrix:
    """α ∧ β as the antisymmetric matrix (n, n) of αᵢ βⱼ − αⱼ βᵢ.

    Raises:
        UlnaError: the forms live over different coordinates.
    """
    if first.coordinates != second.coordinates:
        raise UlnaError("a wedge product", f"{first.coordinates} and {second.coordinates} are different coordinates.")
    a, b = first.components, second.components
    upper = {(i, j): a[i] * b[j] - a[j] * b[i] for i, j in combinations(range(len(a)), 2)}
    return _antisymmetric(upper, len(a))


def contraction(form: OneForm, field: MatrixBase) -> Expr:
    """ω(f) = Σ wᵢ fᵢ, a function; f of shape (n, 1)."""
    return sum((w * f for w, f in zip(form.components, field, strict=True)), Integer(0))


def closed(form: OneForm) -> Verdict:
    """Whether dω = 0; a refutation names the component ∂wⱼ/∂xᵢ − ∂wᵢ/∂xⱼ, a point and its value there."""
    claim = "the one-form is closed"
    derivative = exterior_derivative(form)
    parts = []
    for i, j in combinations(range(len(form.coordinates)), 2):
        part = is_zero(derivative[i, j])
        if part.fails:
            names = (str(form.coordinates[i]), str(form.coordinates[j]))
            return Verdict.refuted(claim, **{**part.evidence, "component": names, "expression": derivative[i, j]})
        parts.append(part)
    return all_of(claim, parts)


def frobenius(form: OneForm) -> Verdict:
    """Whether ω ∧ dω = 0, so that ω = b dT locally; a refutation names the component, a point and its value there.

    Only components that contain one index p with w_p ≠ 0 need a look: contracting ω ∧ dω with ∂/∂x_p shows that they
    generate the others.
    """
    return frobenius_codistribution((form,))


def frobenius_codistribution(forms: Sequence[OneForm]) -> Verdict:
    """Whether dωₖ ∧ ω₁ ∧ … ∧ ω_d = 0 for all k: the independent forms span the differentials of d functions.

    Raises:
        UlnaError: no forms, or forms over different coordinates.
    """
    claim = "the one-form is integrable up to a factor" if len(forms) == 1 else "the one-forms are integrable"
    if not forms or len({form.coordinates for form in forms}) > 1:
        raise UlnaError("Frobenius' condition", "there are no forms, or they live over different coordinates.")
    coordinates = forms[0].coordinates
    kernel = _kernel(ImmutableDenseMatrix.vstack(*(form.row for form in forms)))
    parts = []
    for number, form in enumerate(forms):
        derivative = exterior_derivative(form)
        for i, j in combinations(range(len(kernel)), 2):
            value = (kernel[i].T * derivative * kernel[j])[0]
            part = is_zero(value)
            if part.fails:
                evidence = {**part.evidence, "form": number, "expression": value}
                evidence["fields"] = (kernel[i], kernel[j])
                return Verdict.refuted(claim, **evidence, coordinates=tuple(str(x) for x in coordinates))
            parts.append(part)
    return all_of(claim, parts)


def _kernel(rows: MatrixBase) -> list[ImmutableDenseMatrix]:
    """Fields that span the common kernel of the rows on an open dense set; for one row without any division."""
    n = rows.cols
    if rows.rows == 1:
        pivot = next((i for i in range(n) if not is_zero(rows[i]).holds), None)
        if pivot is None:
            return []
        fields = []
        for j in range(n):
            if j != pivot:
                entries = [Integer(0)] * n
                entries[j], entries[pivot] = rows[pivot], -rows[j]
                fields.append(ImmutableDenseMatrix(n, 1, entries))
        return fields
    return list(null_space(rows))


def _antisymmetric(upper: dict[tuple[int, int], Expr], n: int) -> ImmutableDenseMatrix:
    def entry(i: int, j: int) -> Expr:
        if i == j:
            return Integer(0)
        return upper[i, j] if i < j else -upper[j, i]

    return ImmutableDenseMatrix(n, n, lambda i, j: entry(int(i), int(j)))
