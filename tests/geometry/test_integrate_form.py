"""One-forms whose integral is known, and forms that must be refused."""

import pytest
from sympy import (
    Expr,
    Integer,
    Matrix,
    Rational,
    Symbol,
    atan,
    cos,
    erf,
    exp,
    log,
    sin,
    sinh,
    sqrt,
    symbols,
)

from ulna.base import UlnaError
from ulna.geometry import OneForm, exact_potential, integrate, iterated_brackets, one_form
from ulna.geometry.integrate_form import parallel
from ulna.geometry.oneform import differential, scaled
from ulna.symbolic.exact import is_zero, null_space

X = x1, x2, x3, x4 = symbols("x1:5", real=True)
a, b, J, I = symbols("a b J I", real=True)
ONES = dict.fromkeys(X, 1)


def multiple(factor: Expr | int, function: Expr, count: int) -> OneForm:
    """factor · d(function), multiplied out so that the factor is hidden."""
    form = scaled(factor, differential(function, X[:count]))
    return one_form([w.expand() for w in form.components], X[:count])


KNOWN = {
    "a coordinate behind a factor": (exp(x1) * (1 + x2**2), x3, 3),
    "bilinear": (1 + x2**2, x1 + x2 * x3, 3),
    "hidden exponential": (exp(x1 - x2), x1 * exp(x2) + x3, 3),
    "gaussian, no factor of the form": (exp(-(x2**2)), (x1 + x2) * exp(x2**2), 2),
    "bernoulli": (x1**2 * exp(-x2), (1 / x1 + x2 - 1) * exp(x2), 2),
    "power hidden by its derivative": (1 / (1 + x2**2), (1 + x2**2) ** 3 * (x1 + x2 * x3), 3),
    "two powers": (1 / (x1 + x2**2) ** 2, (x1 + x2**2) ** 3 * (x1 * x3 - x2), 3),
    "quotient": (x1, (x1 * x2 + 1) / (x2 + x3**2), 3),
    "logarithm": (x1 + x2, log(x1 + x2) + x1 * x2, 2),
    "trigonometric factor": (1 / cos(x1), x2 * cos(x1) ** 2 + sin(x1), 2),
    "trigonometric sum angle": (1 / (3 + cos(x1 - x2)), sin(x1 - x2) * x3 + cos(x1 - x2) * x2**2, 3),
    "hyperbolic": (exp(x2), sinh(x1) * x2 + x2**2, 2),
    "arc tangent": (1 / (x1**2 + x2**2), atan(x1 / x2) + x3, 3),
    "error function": (exp(x1**2), erf(x1) * x3 + x2 * exp(-(x1**2)), 3),
    "root": (x2 + x1, x1 / sqrt(x1 + x2**2), 2),
    "exponent that is a parameter": (1 / (x1 * x2), x1**a * exp(b * x2), 2),
    "combination of parameters": (exp(x1), a * sin(x1) + b / (J - I) * x3 * x2, 3),
    "four coordinates": (exp(x3 * x2), a * x1 * exp(x4) - b * x2 * x3 + x4**2, 4),
    "high degree": (1 / (1 + x2), x1 + x2**5 * x3 + x4, 4),
    "composite": (x1 + 2 * x2**2, x1 * exp(x1 * cos(x2)), 2),
}


@pytest.mark.parametrize("name", KNOWN)
def test_a_multiple_of_a_differential_is_integrated(name: str) -> None:
    factor, function, count = KNOWN[name]
    form = multiple(factor, function, count)
    found = integrate(form, near=ONES)
    assert found.verdict.holds, found.verdict.evidence
    assert found.value is not None
    assert found.factor is not None
    coordinates = X[:count]
    for x, w in zip(coordinates, form.components, strict=True):
        assert is_zero(found.value.diff(x) - found.factor * w).holds
    for p in range(count):
        for q in range(p):
            one, other = coordinates[p], coordinates[q]
            jacobian = found.value.diff(one) * function.diff(other) - found.value.diff(other) * function.diff(one)
            assert is_zero(jacobian).holds


def test_the_result_vanishes_at_the_point_and_prefers_a_coordinate() -> None:
    assert integrate(multiple(exp(x1), x2, 2), near={x1: 0, x2: 3}).value == x2 - 3
    assert integrate(multiple(x2, x1**2 + x2**2, 2), near={x1: 1, x2: 2}).value == x1**2 + x2**2 - 5


def test_a_simple_function_of_the_integral_is_returned() -> None:
    product = integrate(multiple(1 / (x1 * x2), x1**2 * x2, 2), near=ONES)
    assert product.value == x1**2 * x2 - 1
    argument = integrate(multiple(1, sin(x1 + x2 * x3), 3))
    assert argument.value == x1 + x2 * x3


def test_the_result_is_real_where_the_arguments_of_logarithms_are_negative() -> None:
    found = integrate(multiple(1, log(-x1) + x2 + x1 * x2, 2), near={x1: -1, x2: 1})
    assert found.value is not None
    value = found.value.subs({x1: Rational(-5, 4), x2: Rational(3, 4)})
    assert value.is_real


def test_an_exact_potential_has_the_form_itself_as_its_differential() -> None:
    form = differential(sin(x1 + x2 * x3) + exp(x3), X[:3])
    found = exact_potential(form, near={x1: 0, x2: 1, x3: 0})
    assert found.verdict.holds
    assert found.value is not None
    assert is_zero(found.value - sin(x1 + x2 * x3) - exp(x3) + 1).holds
    assert exact_potential(scaled(x1, form)).verdict.fails


def test_a_form_that_violates_frobenius_is_refused_with_a_point() -> None:
    found = integrate(one_form([x2, 0, 1], X[:3]))
    assert found.value is None
    assert found.verdict.fails
    assert "point" in found.verdict.evidence


def test_a_zero_form_is_an_error() -> None:
    with pytest.raises(UlnaError, match="identically zero"):
        integrate(one_form([0, sin(x1) ** 2 + cos(x1) ** 2 - 1], X[:2]))


def test_an_equation_without_closed_form_is_undecided_in_time() -> None:
    # y' = y² + x y sin y + exp(x²) has no elementary integral that is known
    slope = x2**2 + x1 * x2 * sin(x2) + exp(x1**2)
    found = integrate(one_form([-slope, 1], X[:2]), seconds=0.5)
    assert found.value is None
    assert not found.verdict.holds
    assert not found.verdict.fails
    assert found.verdict.evidence["tried"]


def test_a_wrong_potential_is_refused() -> None:
    form = multiple(exp(x1), x1 + x2 * x3, 3)
    assert parallel(x1 + x2 * x3, form).holds
    assert parallel(x1 - x2 * x3, form).fails
    assert parallel(Integer(3), form).fails


def last_covector(drift: list, control: list, x: tuple[Symbol, ...]) -> OneForm:
    """The row that annihilates g, ad_f g, …, ad_fⁿ⁻² g."""
    chain = iterated_brackets(Matrix(drift), Matrix(control), x, len(x) - 2)
    return one_form(null_space(Matrix.hstack(*(c.as_mutable() for c in chain)).T)[0], x)


PLANTS = {
    # name: drift, control, coordinates, linearising output, point
    "pendulum with a reaction wheel": (
        [x2, a * sin(x1) / (J - I), -a * sin(x1) / (J - I)],
        [0, -1 / (J - I), J / (I * (J - I))],
        3,
        J * x2 + I * x3,
    ),
    "series motor": ([-x1 - a * x1 * x2, b * x1**2 - x2], [1, 0], 2, x2),
    "gaussian": ([x2, 0], [-(1 + 2 * x2**2 + 2 * x1 * x2), 1], 2, (x1 + x2) * exp(x2**2)),
    "bernoulli": ([1, 0], [x1 + x1**2 * x2, 1], 2, (1 / x1 + x2 - 1) * exp(x2)),
    "bilinear": ([x2 - x3**2, x3, 0], [-x2 * (1 + x2**2), 0, 1 + x2**2], 3, x1 + x2 * x3),
    "flexible joint": ([x2, -a * sin(x1) - b * (x1 - x3), x4, x1 - x3], [0, 0, 0, 1], 4, x1),
    "van de Vusse reactor": ([-a * x1 - x1**2, a * x1 - b * x2], [J - x1, -x2], 2, x2 / (x1 - J)),
}


@pytest.mark.parametrize("name", PLANTS)
def test_the_linearising_output_of_a_plant_is_found(name: str) -> None:
    drift, control, count, output = PLANTS[name]
    form = last_covector(drift, control, X[:count])
    found = integrate(form, near=ONES)
    assert found.verdict.holds
    assert parallel(output, form).holds
