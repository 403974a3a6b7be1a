"""Normal forms, common factors, null spaces, plain angles and compact chains."""

import pytest
from sympy import Expr, Matrix, atan, cos, exp, log, sin, sqrt, symbols

from ulna.symbolic.exact import compact, is_zero, normal, null_space, vanishes, without_common_factor
from ulna.symbolic.exact.angles import with_plain_angles

x, y, z, a = symbols("x y z a", real=True)


@pytest.mark.parametrize(
    "zero",
    [sin(x) ** 2 + cos(x) ** 2 - 1, sqrt(1 + x**2) * sqrt(1 + y**2) - sqrt((1 + x**2) * (1 + y**2)), x - x],
)
def test_zeros_vanish(zero: Expr) -> None:
    assert vanishes(zero)


@pytest.mark.parametrize("other", [sin(x) ** 2 - cos(x) ** 2, x - y, sqrt(x + 1) - x, log(x) - x])
def test_other_functions_do_not_vanish(other: Expr) -> None:
    assert not vanishes(other)


def test_normal_form_cancels_by_the_identities_of_sines() -> None:
    assert normal((1 - cos(x) ** 2) / sin(x)) == sin(x)
    assert normal((x**2 - 1) / (x - 1)) == x + 1


def test_common_factors_and_denominators_go() -> None:
    form = [exp(x) * y * (1 + z**2) / (1 + y), exp(x) * (1 + z**2), 0 * x]
    assert without_common_factor(form) == (y, y + 1, 0)


def test_null_space_is_annihilated_and_complete() -> None:
    matrix = Matrix([[x, y, 0, 1], [0, sin(x), cos(x), z], [x, y + sin(x), cos(x), 1 + z]])
    columns = null_space(matrix)
    assert len(columns) == 2
    assert all(is_zero(entry).holds for column in columns for entry in matrix * column)


def test_null_space_honours_the_pivots_asked_for() -> None:
    columns = null_space(Matrix([[x, y, 1]]), pivots=[1])
    assert [bool(c[0]) for c in columns] == [True, False]
    assert all(c[1] != 0 for c in columns)
    assert len(null_space(Matrix([[0, y, 0]]))) == 2


def test_null_spaces_with_many_minors_or_without_exact_form_are_right_as_well() -> None:
    wide = Matrix(4, 11, lambda i, j: x ** (i * j % 5) + y * i + z**j)
    columns = null_space(wide)
    assert len(columns) == 7
    assert all(is_zero(entry).holds for column in columns for entry in wide * column)
    moduli = Matrix([[abs(x - y), x, sqrt((x + z) ** 2)], [x, abs(x + z), y]])
    [column] = null_space(moduli)
    assert any(entry != 0 for entry in column)
    assert all(is_zero(entry).holds for entry in moduli * column)


def test_roots_that_are_related_count_once() -> None:
    """Finite fields do not see that √x √y = √(xy): the rank of the rows is taken in real numbers."""
    u, v = symbols("u v", positive=True)
    rows = Matrix([[sqrt(u) * sqrt(v), 1, 0], [sqrt(u * v) * u, u, 0]])
    assert len(null_space(rows)) == 2


def test_an_angle_that_is_a_sum_becomes_one_symbol_and_comes_back() -> None:
    expressions = [sin(x + y**2) * cos(2 * x + 2 * y**2), cos(z), x * exp(y)]
    plain, meaning = with_plain_angles(expressions)
    assert len(meaning) == 1
    assert plain[2] == x * exp(y)
    assert [e.xreplace(meaning) for e in plain] == expressions


def test_related_angles_stay_related() -> None:
    [plain], meaning = with_plain_angles([sin(x + y) ** 2 + cos(2 * x + 2 * y) / 2])
    assert is_zero(plain.xreplace(meaning) - sin(x + y) ** 2 - cos(2 * x + 2 * y) / 2).holds
    [one, two, three], meaning = with_plain_angles([sin(x + z**2), sin(y - z**2), sin(x + y)])
    assert three.args[0] == one.args[0] + two.args[0]
    assert len(meaning) == 2


def test_compact_keeps_values_and_shortens_long_ones() -> None:
    long = sum(
        (sin(x) ** 2 / (2 - cos(y) ** 2) ** k + cos(x) ** 2 / (2 - cos(y) ** 2) ** k) * a**k for k in range(1, 6)
    )
    [short, small] = compact([long, x + atan(y)])
    assert is_zero(short - long).holds
    assert len(str(short)) < len(str(long))
    assert small == x + atan(y)
