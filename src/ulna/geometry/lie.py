"""Lie derivatives of functions, vector fields and covector fields.

Vector fields are columns (n, 1), covector fields (one-forms) rows (1, n), functions scalars, all over one tuple of
coordinates; every other symbol is a parameter. Nothing here is simplified for reading; longer results are brought to
lowest terms by exact algebra where that is quick (`compact`), which keeps chains of brackets short.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from sympy import Expr, Float, ImmutableDenseMatrix, Integer, Rational, Symbol
from sympy.matrices import MatrixBase

from ulna.base import UlnaError
from ulna.symbolic.exact import compact

Scalar: TypeAlias = Expr | int
"""A function, or a whole number as users write it."""


def expression(value: Scalar) -> Expr:
    """The value as an expression with exact numbers."""
    if isinstance(value, int):
        return Integer(value)
    return value.xreplace({number: Rational(number) for number in value.atoms(Float)})


def lie_derivative(function: Scalar, field: MatrixBase, coordinates: Sequence[Symbol]) -> Expr:
    """L_f h = (∂h/∂x) f, the rate of the function h along the flow of f.

    Args:
        function: h, a scalar expression.
        field: f, shape (n, 1).
        coordinates: x, n symbols.

    Raises:
        UlnaError: the field does not have one entry per coordinate.

    Examples:
        >>> import sympy as sp
        >>> x, v = sp.symbols("x v", real=True)
        >>> ulna.lie_derivative(x**2, sp.Matrix([v, -x]), [x, v])
        2*v*x
    """
    _check(field, (len(coordinates), 1), "vector field")
    scalar = expression(function)
    return compact([_contract([scalar.diff(x) for x in coordinates], list(field))])[0]


def lie_bracket(first: MatrixBase, second: MatrixBase, coordinates: Sequence[Symbol]) -> ImmutableDenseMatrix:
    """[f, g] = (∂f/∂x) g − (∂g/∂x) f, a vector field (n, 1), with the sign of the paper's eq. 19.

    Most books (Isidori, Khalil, Nijmeijer and van der Schaft) use the opposite sign. Ranks, involutivity and control
    laws do not depend on it; ad_f^k g changes sign for odd k.

    Raises:
        UlnaError: a field does not have one entry per coordinate.

    Examples:
        >>> import sympy as sp
        >>> x, v = sp.symbols("x v", real=True)
        >>> ulna.lie_bracket(sp.Matrix([v, -sp.sin(x)]), sp.Matrix([0, 1]), [x, v]).T
        Matrix([[1, 0]])
    """
    _check(first, (len(coordinates), 1), "vector field")
    _check(second, (len(coordinates), 1), "vector field")
    f, g = list(first), list(second)
    entries = [
        _contract([f[i].diff(x) for x in coordinates], g) - _contract([g[i].diff(x) for x in coordinates], f)
        for i in range(len(f))
    ]
    return ImmutableDenseMatrix(len(f), 1, compact(entries))


def lie_derivative_of_covector(
    covector: MatrixBase, field: MatrixBase, coordinates: Sequence[Symbol]
) -> ImmutableDenseMatrix:
    """L_f w = fᵀ (∂wᵀ/∂x)ᵀ + w (∂f/∂x), a covector field (1, n).

    With the bracket of eq. 19 the Leibniz rule reads L_f (w g) = (L_f w) g − w [f, g].

    Raises:
        UlnaError: a shape does not fit the coordinates.
    """
    n = len(coordinates)
    _check(covector, (1, n), "covector field")
    _check(field, (n, 1), "vector field")
    w, f = list(covector), list(field)
    entries = [
        _contract([w[j].diff(x) for x in coordinates], f) + _contract([f[i].diff(coordinates[j]) for i in range(n)], w)
        for j in range(n)
    ]
    return ImmutableDenseMatrix(1, n, compact(entries))


def iterated_brackets(
    first: MatrixBase, second: MatrixBase, coordinates: Sequence[Symbol], order: int
) -> tuple[ImmutableDenseMatrix, ...]:
    """(ad_f⁰ g, ad_f¹ g, …, ad_f^order g) with ad_f⁰ g = g and ad_fᵏ g = [f, ad_fᵏ⁻¹ g].

    Raises:
        UlnaError: a negative order, or a shape that does not fit the coordinates.
    """
    if order < 0:
        raise UlnaError("an iterated bracket", f"the order is {order}.", "Orders start at 0: ad⁰ g = g.")
    _check(second, (len(coordinates), 1), "vector field")
    chain = [ImmutableDenseMatrix(second)]
    for _ in range(order):
        chain.append(lie_bracket(first, chain[-1], coordinates))
    return tuple(chain)


def iterated_bracket(
    first: MatrixBase, second: MatrixBase, coordinates: Sequence[Symbol], order: int
) -> ImmutableDenseMatrix:
    """ad_f^order g with ad_f⁰ g = g and ad_fᵏ g = [f, ad_fᵏ⁻¹ g], a vector field (n, 1).

    Raises:
        UlnaError: a negative order, or a shape that does not fit the coordinates.
    """
    return iterated_brackets(first, second, coordinates, order)[-1]


def _contract(gradient: Sequence[Expr], field: Sequence[Expr]) -> Expr:
    total: Expr = Integer(0)
    for slope, rate in zip(gradient, field, strict=True):
        if slope != 0 and rate != 0:
            total += slope * rate
    return total


def _check(array: MatrixBase, shape: tuple[int, int], what: str) -> None:
    if tuple(array.shape) != shape:
        raise UlnaError(
            f"a Lie derivative over {max(shape)} coordinates",
            f"the {what} has shape {tuple(array.shape)} instead of {shape}.",
            "Vector fields are columns, covector fields rows, one entry per coordinate.",
        )


def bracket_name(order: int, index: int, inputs: int) -> str:
    """`ad_f^order g_index` as text, counted from 1 where there are several inputs."""
    g = f"g{index + 1}" if inputs > 1 else "g"
    return g if order == 0 else f"ad_f {g}" if order == 1 else f"ad_f^{order} {g}"
