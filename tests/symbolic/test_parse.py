import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from ulna.base import FormulaError
from ulna.symbolic.formulas import exact, formula, parse_formula

x, y, E = (sp.Symbol(n, real=True) for n in "xyE")
NAMES = {"x": x, "y": y, "E": E}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x**2/y + sin(x)", x**2 / y + sp.sin(x)),
        ("x^2", x**2),
        ("0.1*x", x / 10),
        ("1.5e-3*x", 3 * x / 2000),
        ("-x**-2", -(x**-2)),
        ("E*pi", E * sp.pi),
        ("ln(x)", sp.log(x)),
        ("Rational(49,5)*x", sp.Rational(49, 5) * x),
        ("2**0.5", sp.sqrt(2)),
        ("atan2(y, x)", sp.atan2(y, x)),
        ("min(x, y, 3)", sp.Min(3, x, y)),
        ("abs(x)", sp.Abs(x)),
        ("heaviside(x)", sp.Heaviside(x)),
        ("Piecewise((x, x < 5), (y, True))", sp.Piecewise((x, x < 5), (y, True))),
        (
            "Piecewise((x, (x < 5) & (y > 1) | (y < x)), (y, True))",
            sp.Piecewise((x, ((x < 5) & (y > 1)) | (y < x)), (y, True)),
        ),
        ("Piecewise((x, x < 5 and y > 1), (y, True))", sp.Piecewise((x, (x < 5) & (y > 1)), (y, True))),
        ("Piecewise((x, x == 2), (y, x != y), (1, True))", sp.Piecewise((x, sp.Eq(x, 2)), (y, sp.Ne(x, y)), (1, True))),
        ("exp(1)", sp.E),
    ],
)
def test_formulas_are_read_exactly(text, expected):
    assert parse_formula(text, NAMES) == expected


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("__import__('os')", "unknown function"),
        ("x.__class__", "not part of a formula"),
        ("(lambda: 1)()", "unknown symbol 'lambda'"),
        ("x[0]", "not part of a formula"),
        ("'x'", "not part of a formula"),
        ("x & y", "comparison on both sides"),
        ("Piecewise((x, x < 1 and y), (y, True))", "not a complete formula"),
        ("Piecewise((x, (x < 1) == y), (y, True))", "comparison stands where a number"),
        ("x; y", "not part of a formula"),
        ("9**9**9", "too large"),
        ("x**9**9", "too large"),
        ("99999**999", "digits"),
        ("1e999999", "too many digits"),
        ("2x", "no operator"),
        ("x y", "no operator"),
        ("foo(x)", "unknown function 'foo'"),
        ("x(3)", "not a function"),
        ("thet", "unknown symbol 'thet'"),
        ("sin", "without its argument"),
        ("sin(x, y)", "takes 1 argument"),
        ("sin(x", "without"),
        ("x)", "too many"),
        ("", "empty"),
        ("x +", "ends with"),
        ("x *** y", "not a complete formula"),
        ("1/0", "divides by zero"),
        ("x/(y - y)", "divides by zero"),
        ("sqrt(-1)", "not real"),
        ("x < y", "comparison"),
        ("(" * 500 + "x" + ")" * 500, "nested"),
        ("**".join("x" * 600_000), "nested"),
        ("sin(" * 200 + "x" + ")" * 200, "nested"),
        ("min(x, log(-1))", "not real"),
        ("max(x, ln(0))", "logarithm of zero"),
        ("abs(log(-2) + x)", "not real"),
        ("(-8)**(1/3)*x", "not real.*real root"),
        ("sqrt(-1)*x", "not real"),
        ("asin(2)*x", "not real"),
        ("Piecewise((1, x > log(-1)), (2, True))", "not real"),
        ("min(0/0, x)", "divides by zero"),
        ("x + True", "comparison stands where a number"),
        ("sin(x < 1)", "comparison stands where a number"),
        ("x**(x < 1)", "comparison stands where a number"),
        ("Rational(1, 0)*x", "two numbers"),
        ("exp(exp(exp(exp(9))))*x", "digits"),
        ("pi**exp(exp(9))", "digits"),
        ("1" * 5000 + "*x", "too many digits"),
    ],
)
def test_what_is_no_formula_is_refused_with_its_reason(text, reason):
    with pytest.raises(FormulaError, match=reason):
        parse_formula(text, NAMES)


def test_a_near_name_is_suggested():
    with pytest.raises(FormulaError, match="Did you mean 'theta'"):
        parse_formula("thetta", {"theta": sp.Symbol("theta", real=True)})


_LEAVES = st.sampled_from([x, y, sp.Integer(2), sp.Rational(-3, 7), sp.pi])
_TREES = st.recursive(
    _LEAVES,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] * p[1]),
        inner.map(sp.sin),
        inner.map(sp.exp),
        inner.map(sp.Abs),
        st.tuples(inner, st.integers(-3, 3)).map(lambda p: p[0] ** p[1] if p[0] != 0 else p[0]),
    ),
    max_leaves=8,
)


@given(_TREES)
def test_written_formulas_read_back(expression):
    if not expression.has(sp.zoo, sp.nan):
        assert sp.simplify(parse_formula(formula(expression), NAMES) - expression) == 0


def test_exact_takes_decimals_by_their_text():
    assert exact(0.1) == sp.Rational(1, 10)
    assert exact("2/3") == sp.Rational(2, 3)
    for wrong in (float("nan"), float("inf"), True):
        with pytest.raises(ValueError, match="number"):
            exact(wrong)


@pytest.mark.parametrize("text", ["1e-999999999", "1e999999999", "7" * 5000, "1/0", "one"])
def test_numbers_that_nobody_means_are_refused_at_once(text):
    with pytest.raises((ValueError, TypeError)):
        exact(text)


def test_a_tree_at_the_limit_is_written_and_read_back():
    tower = x
    for _ in range(149):
        tower = sp.Pow(x, tower)
    assert parse_formula("**".join("x" * 150), NAMES) == tower
    assert parse_formula(formula(tower), NAMES) == tower
