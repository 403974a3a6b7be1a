"""First integrals of involutive distributions of several codimensions."""

import pytest
from sympy import Expr, Matrix, atan, cos, exp, log, sin, symbols

from ulna.geometry import distribution, first_integrals, lie_derivative
from ulna.geometry.leaves import verified
from ulna.symbolic.exact import generic_rank, is_zero, null_space

X = x1, x2, x3, x4, x5 = symbols("x1:6", real=True)
a, b = symbols("a b", positive=True)
ONES = dict.fromkeys(X, 1)

FIELDS = {
    # name: spanning fields, number of coordinates
    "a straight field": ([[0, 1, 0]], 3),
    "polynomial characteristics": ([[1, x1, x1 * x2]], 3),
    "scaling": ([[x1, 2 * x2, -x3]], 3),
    "scaling with parameters as exponents": ([[a * x1, b * x2, x3]], 3),
    "rotation and growth": ([[x2, -x1, x3]], 3),
    "rotation with a phase": ([[x2, -x1, 0, 1], [0, 0, 1, 0]], 4),
    "hyperbolic rotation": ([[1, 0, x4, x3], [0, 1, x3, x4]], 4),
    "rigid body": ([[x2 * x3, -x1 * x3, b * x1 * x2]], 3),
    "normal form of Khalil's example": ([[(2 + x3**2) / (1 + x3**2), 0, 1]], 3),
    "normal form of Isidori's example": ([[exp(x2), 1, 0]], 3),
    "a flow through a quadrature": ([[1, x2, sin(x2) * x3, x1 * x2]], 4),
    "dependent fields": ([[1, x1, 0], [x2, x1 * x2, 0]], 3),
}


@pytest.mark.parametrize("name", FIELDS)
def test_all_first_integrals_are_found(name: str) -> None:
    rows, count = FIELDS[name]
    fields, coordinates = [Matrix(row) for row in rows], X[:count]
    found = first_integrals(distribution(fields, coordinates), near=dict.fromkeys(coordinates, 1))
    assert found.verdict.holds, found.verdict.evidence
    assert found.functions is not None
    rank = generic_rank(Matrix.hstack(*fields)).value
    assert len(found.functions) == count - rank
    assert all(is_zero(lie_derivative(h, f, coordinates)).holds for h in found.functions for f in fields)
    slopes = Matrix([[h.diff(x) for x in coordinates] for h in found.functions])
    assert generic_rank(slopes).value == count - rank


LEAVES: dict[str, list[Expr]] = {
    "two polynomials": [x1 + x2 * x3, x4 + x2**2],
    "a function of another": [x1 + x2**2, x3 * (x1 + x2**2) + sin(x4)],
    "exponential factors": [(x1 - x2 * x3**2) * exp(x2), (x3**2 + 1) * (x1**3 + x1 * x2 + x3)],
    "logarithms": [x2 - log(x3**2 + 1), x1 * (x2 - log(x3**2 + 1)) + x3],
    "arc tangents": [x1 + atan(x3), (x2 * exp(x1) + x3) * exp(x1)],
    "three of them": [x2 + 2 * x4 * exp(x3), x3 + 2 * cos(x2), x1**3 + x2 * sin(x2) - x4],
}


@pytest.mark.parametrize("name", LEAVES)
def test_leaves_hidden_in_their_tangent_fields_are_recovered(name: str) -> None:
    functions = LEAVES[name]
    coordinates = tuple(x for x in X if any(h.has(x) for h in functions))
    fields = null_space(Matrix([[h.diff(x) for x in coordinates] for h in functions]))
    mixed = [fields[0] * (1 + coordinates[0] ** 2), *(f + coordinates[1] * fields[0] for f in fields[1:])]
    found = first_integrals(distribution(mixed, coordinates))
    assert found.verdict.holds
    assert found.functions is not None
    for h in found.functions:  # a function of the given ones
        slopes = Matrix([[g.diff(x) for x in coordinates] for g in (*functions, h)])
        assert generic_rank(slopes).value == len(functions)


def test_a_distribution_that_is_not_involutive_is_refused_with_its_bracket() -> None:
    found = first_integrals(distribution([Matrix([sin(x3), cos(x3), 0]), Matrix([0, 0, 1])], X[:3]))
    assert found.functions is None
    assert found.verdict.fails
    assert found.verdict.evidence["pair"] == (0, 1)


def test_the_whole_tangent_space_has_no_first_integral() -> None:
    found = first_integrals(distribution([Matrix([1, 0]), Matrix([0, 1])], X[:2]))
    assert found.functions == ()
    assert found.verdict.holds


def test_no_fields_leave_all_coordinates() -> None:
    assert first_integrals(distribution([], X[:2])).functions == (x1, x2)


def test_wrong_and_dependent_functions_are_refused() -> None:
    span = distribution([Matrix([1, x1, x1 * x2])], X[:3])
    right = x1**2 - 2 * x2
    assert verified([right], span).holds
    assert verified([right + x3], span).fails
    assert verified([right, right**2], span).fails


def test_running_out_of_time_is_undecided_and_keeps_what_was_found() -> None:
    span = distribution([Matrix([1, 0, x3**2 + x1 * x3 * sin(x3) + exp(x1**2)])], X[:3])
    found = first_integrals(span, seconds=0.5)
    assert found.functions is None
    assert found.found == (x2,)
    assert not found.verdict.holds
    assert not found.verdict.fails
