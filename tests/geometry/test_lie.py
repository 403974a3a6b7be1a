"""Laws of the Lie bracket and of Lie derivatives, over random polynomial and trigonometric fields."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Matrix, Rational, cos, exp, eye, sin, symbols, zeros

from ulna.base import UlnaError
from ulna.geometry import iterated_bracket, iterated_brackets, lie_bracket, lie_derivative, lie_derivative_of_covector
from ulna.symbolic.exact import is_zero

X = symbols("x1:4", real=True)
PIECES = (1, X[0], X[1], X[2], X[0] * X[1], X[2] ** 2, sin(X[0]), cos(X[1]), exp(X[2]))

functions = st.lists(st.tuples(st.integers(-2, 2), st.sampled_from(PIECES)), min_size=1, max_size=2).map(
    lambda terms: sum(c * p for c, p in terms) + 0 * X[0]
)
fields = st.lists(functions, min_size=3, max_size=3).map(lambda entries: Matrix(3, 1, entries))


def vanishes(array: Matrix) -> bool:
    return all(is_zero(entry).holds for entry in array)


def test_bracket_has_the_sign_of_the_paper() -> None:
    drift, shift = Matrix([X[1], 0, 0]), Matrix([0, 1, 0])
    # (∂f/∂x) g − (∂g/∂x) f with f = (x₂, 0, 0), g = (0, 1, 0)
    assert lie_bracket(drift, shift, X) == Matrix([1, 0, 0])


def test_bracket_of_linear_fields_is_the_field_of_the_commutator() -> None:
    a = Matrix([[0, 1, 2], [3, 0, -1], [1, 1, 1]])
    b = Matrix([[1, 0, 0], [2, 1, 0], [0, 5, 2]])
    x = Matrix(X)
    assert vanishes(lie_bracket(a * x, b * x, X) - (a * b - b * a) * x)


def test_iterated_brackets_of_a_linear_plant_are_powers_of_its_matrix() -> None:
    a, b = Matrix([[0, 1, 0], [0, 0, 1], [-1, -2, -3]]), Matrix([0, 0, 1])
    chain = iterated_brackets(a * Matrix(X), b, X, 3)
    assert [Matrix(c) for c in chain] == [b, a * b, a**2 * b, a**3 * b]
    assert iterated_bracket(a * Matrix(X), b, X, 2) == a**2 * b


@settings(max_examples=12, deadline=None)
@given(f=fields, g=fields)
def test_bracket_is_antisymmetric(f: Matrix, g: Matrix) -> None:
    assert vanishes(lie_bracket(f, g, X) + lie_bracket(g, f, X))


@settings(max_examples=8, deadline=None)
@given(f=fields, g=fields, h=fields)
def test_bracket_satisfies_jacobi(f: Matrix, g: Matrix, h: Matrix) -> None:
    total = lie_bracket(f, lie_bracket(g, h, X), X)
    total += lie_bracket(g, lie_bracket(h, f, X), X) + lie_bracket(h, lie_bracket(f, g, X), X)
    assert vanishes(total)


@settings(max_examples=12, deadline=None)
@given(f=fields, g=fields, a=functions)
def test_bracket_satisfies_leibniz(f: Matrix, g: Matrix, a: Matrix) -> None:
    # With this sign: [f, a g] = a [f, g] − (L_f a) g.
    assert vanishes(lie_bracket(f, a * g, X) - a * lie_bracket(f, g, X) + lie_derivative(a, f, X) * g)


@settings(max_examples=12, deadline=None)
@given(f=fields, g=fields, h=functions)
def test_derivative_along_a_bracket_is_the_commutator_of_derivatives(f: Matrix, g: Matrix, h: Matrix) -> None:
    inner = lie_derivative(h, lie_bracket(f, g, X), X)
    commutator = lie_derivative(lie_derivative(h, f, X), g, X) - lie_derivative(lie_derivative(h, g, X), f, X)
    assert is_zero(inner - commutator).holds


@settings(max_examples=8, deadline=None)
@given(f=fields, g=fields)
def test_bracket_is_natural_under_a_diffeomorphism(f: Matrix, g: Matrix) -> None:
    forward = Matrix([X[0], X[1] + X[0] ** 2, X[2] + sin(X[0]) * X[1]])
    y = symbols("y1:4", real=True)
    back = {X[0]: y[0], X[1]: y[1] - y[0] ** 2, X[2]: y[2] - sin(y[0]) * (y[1] - y[0] ** 2)}
    jacobian = forward.jacobian(X)

    def pushed(field: Matrix) -> Matrix:
        return (jacobian * field).subs(back, simultaneous=True)

    assert vanishes(pushed(lie_bracket(f, g, X)) - lie_bracket(pushed(f), pushed(g), y))


@settings(max_examples=12, deadline=None)
@given(f=fields, h=functions)
def test_derivative_of_a_differential_is_the_differential_of_the_derivative(f: Matrix, h: Matrix) -> None:
    gradient = Matrix([[h.diff(x) for x in X]])
    outer = Matrix([[lie_derivative(h, f, X).diff(x) for x in X]])
    assert vanishes(lie_derivative_of_covector(gradient, f, X) - outer)


@settings(max_examples=12, deadline=None)
@given(f=fields, g=fields, w=fields)
def test_covector_field_and_vector_field_obey_leibniz(f: Matrix, g: Matrix, w: Matrix) -> None:
    covector = w.T
    left = lie_derivative((covector * g)[0], f, X)
    right = (lie_derivative_of_covector(covector, f, X) * g)[0] - (covector * lie_bracket(f, g, X))[0]
    assert is_zero(left - right).holds


def test_a_row_is_refused_where_a_column_is_due() -> None:
    with pytest.raises(UlnaError, match="instead of"):
        lie_bracket(Matrix([[1, 2, 3]]), zeros(3, 1), X)
    with pytest.raises(UlnaError, match="instead of"):
        lie_derivative_of_covector(zeros(3, 1), zeros(3, 1), X)


def test_a_negative_order_is_refused() -> None:
    with pytest.raises(UlnaError, match="start at 0"):
        iterated_bracket(zeros(3, 1), eye(3)[:, 0], X, -1)


def test_a_constant_rational_scale_comes_out_exactly() -> None:
    field = Matrix([Rational(1, 3) * X[0], 0, 0])
    assert lie_derivative(X[0] ** 2, field, X) == Rational(2, 3) * X[0] ** 2
