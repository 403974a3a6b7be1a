"""Linear partial differential equations solved in spaces of functions."""

from sympy import Expr, Integer, Symbol, cos, exp, log, sin, symbols

from ulna.symbolic.exact import is_zero
from ulna.symbolic.exact.letters import irreducible_factors, letters, wide_letters, words
from ulna.symbolic.integration import potential_in_span
from ulna.symbolic.integration.ansatz import LinearEquations, Span, solutions
from ulna.symbolic.integration.potential import gradient_equations, potential_by_quadrature

X = x, y = symbols("x y", real=True)
a, b, c = symbols("a b c", real=True)


def span(expressions: list[Expr], degree: int, logarithms: tuple[Expr, ...] = ()) -> Span:
    alphabet = letters(expressions, X)
    return Span(alphabet=alphabet, monomials=tuple(words(alphabet, degree, 200)), logarithms=logarithms)


def test_first_integral_of_a_rotation_comes_first() -> None:
    equations = LinearEquations(coordinates=X, fields=((y, -x),))
    assert solutions(equations, span([x, y], 4))[0] == x**2 + y**2


def test_coefficients_may_be_fractions_of_parameters() -> None:
    equations = LinearEquations(coordinates=X, fields=((b * y, -(a - c) * x),))
    [found] = solutions(equations, span([x, y], 2))
    assert is_zero(b * y * found.diff(x) - (a - c) * x * found.diff(y)).holds
    assert found.diff(x) != 0


def test_an_inhomogeneous_system_has_one_particular_solution() -> None:
    form = [2 * x * exp(y) + cos(x), x**2 * exp(y)]
    [found] = solutions(gradient_equations(form, X), span(form, 3))
    assert found == x**2 * exp(y) + sin(x)


def test_logarithms_belong_to_the_space() -> None:
    form = [1 / (x + y), 1 / (x + y) + 1]
    [found] = solutions(gradient_equations(form, X), span(form, 1, (x + y,)))
    assert found == log(x + y) + y


def test_a_system_without_solution_gives_none() -> None:
    assert solutions(gradient_equations([y, Integer(0)], X), span([y], 3)) == []
    assert solutions(LinearEquations(coordinates=X, fields=((Integer(1), exp(x**2)),)), span([y], 3)) == []


def test_potential_of_a_closed_form_by_both_ways() -> None:
    function = x**3 * sin(y) + log(1 + x**2) + y / (1 + x**2)
    form = [function.diff(x), function.diff(y)]
    for found in (potential_in_span(form, X), potential_by_quadrature(form, X)):
        assert found is not None
        assert all(is_zero(found.diff(v) - w).holds for v, w in zip(X, form, strict=True))


def test_letters_close_under_partners_and_keep_primitive_exponentials() -> None:
    found = letters([sin(2 * x) + exp(4 * y) + exp(-6 * y)], X)
    assert set(found) == {x, y, sin(2 * x), cos(2 * x), exp(2 * y)}
    assert letters([exp(Symbol("p")) * x], (x,)) == (x,)


def test_factors_are_irreducible_and_free_of_constants() -> None:
    assert set(irreducible_factors([3 * (x**2 - y**2) / (1 + x)], X)) == {x - y, x + y, 1 + x}


def test_wide_letters_undo_differentiation() -> None:
    found = wide_letters([1 / (1 + x**2)], X)
    assert log(1 + x**2) in found
    assert any(letter.diff(x) == 1 / (1 + x**2) for letter in found)


def test_words_are_ordered_by_degree_and_leave_out_squares_of_sines() -> None:
    found = words((x, sin(x)), 2, 100)
    assert found == [(1, 0), (0, 1), (2, 0), (1, 1)]
