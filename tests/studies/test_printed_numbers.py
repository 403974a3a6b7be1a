"""Printed numbers and sums against exact ones: what the rules accept, and what they must reject."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from ulna.base import FormulaError
from ulna.studies.paper.compare import (
    Comparison,
    Finding,
    Route,
    compare_formula,
    compare_number,
    compare_terms,
    worst,
)
from ulna.studies.paper.notation import read_digits, read_formula, read_printed
from ulna.studies.paper.terms import split_terms

x1, x2, z1, z2 = sp.symbols("x1 x2 z1 z2", real=True)


def _number(text: str, exact: str | sp.Expr, *routes: Route) -> Comparison:
    printed = read_printed(text)
    value = sp.Rational(exact) if isinstance(exact, str) else exact
    return compare_number(printed.expression, printed.marks, value, routes)


@pytest.mark.parametrize(
    ("printed", "exact"),
    [
        ("34.59", "588/17"),
        ("19.6", "1000/51"),
        ("804", "41000/51"),
        ("0.05", "51/1000"),
        ("-5", "-51/10"),
        ("0", "0"),
        ("10", "10"),
        ("0.5", "0.45"),
        ("-6.528", "-6.528"),
    ],
)
def test_a_number_agrees_when_the_exact_one_rounds_to_it(printed: str, exact: str) -> None:
    assert _number(printed, exact).finding is Finding.AGREES


def test_an_irrational_number_agrees_by_its_digits() -> None:
    assert _number("3.46", 2 * sp.sqrt(3)).finding is Finding.AGREES
    assert _number("3.47", 2 * sp.sqrt(3)).finding is Finding.MISPRINT


@pytest.mark.parametrize(
    ("printed", "exact", "words"),
    [
        ("1.77", "1.764", "off by 0.34 %"),
        ("8", "-8", "the sign is wrong"),
        ("-1.81", "1.764", "the sign is wrong, and the size by 2.6 %"),
        ("3.46", "34.59", "the decimal point is 1 off"),
        ("0", "1/1000", "left out"),
        ("0.001", "0", "no such term"),
        ("-9.1", "-10", "off by 9 %"),
        ("34.60", "588/17", "off by"),
    ],
)
def test_a_misprint_is_one_and_says_what_is_wrong(printed: str, exact: str, words: str) -> None:
    outcome = _number(printed, exact)
    assert outcome.finding is Finding.MISPRINT
    assert words in outcome.meaning
    assert outcome.printed == printed


def test_digits_cut_off_are_a_rounding_not_a_misprint() -> None:
    assert _number("-34", "-588/17").finding is Finding.ROUNDING
    assert _number("34", "588/17").finding is Finding.ROUNDING
    assert "cut off" in _number("34", "588/17").meaning
    assert _number("36", "588/17").finding is Finding.MISPRINT
    assert _number("-34", "588/17").finding is Finding.MISPRINT


def test_a_number_that_follows_from_earlier_printed_ones_is_a_carried_rounding() -> None:
    carried = Route(label="with (46) as printed", value=sp.Rational(40))
    outcome = _number("40", "41", carried)
    assert outcome.finding is Finding.ROUNDING
    assert "with (46) as printed it is 40" in outcome.meaning
    assert _number("42", "41", carried).finding is Finding.MISPRINT


def test_a_number_that_follows_from_a_misprint_is_a_copied_misprint() -> None:
    outcome = _number("17.7", "17.64", Route(label="with (26)", value=sp.Rational(177, 10), through_misprint=True))
    assert outcome.finding is Finding.MISPRINT
    assert outcome.copied
    assert not _number("17.8", "17.64").copied


@given(st.fractions(min_value=-1000, max_value=1000, max_denominator=997), st.integers(0, 6))
def test_rounding_any_number_to_any_digits_agrees_and_two_units_off_does_not(number: object, places: int) -> None:
    exact = sp.Rational(number)
    scale = 10**places
    units = sp.floor(sp.Abs(exact) * scale + sp.Rational(1, 2))
    sign = "-" if exact < 0 else ""

    def text(count: sp.Integer) -> str:
        whole, part = divmod(int(count), scale)
        return f"{sign}{whole}" + (f".{part:0{places}d}" if places else "")

    if units != 0:
        assert _number(text(units), exact).finding is Finding.AGREES
        assert _number(text(units + 2), exact).finding is Finding.MISPRINT


def test_sums_are_compared_term_by_term() -> None:
    exact = sp.Rational(-1448, 1000) * x2 + sp.Rational(1764, 1000) * x2 * sp.sin(x1)
    found = {c.place: c.finding for c in compare_terms(read_printed("-1.428*x2 - 1.81*x2*sin(x1)"), exact)}
    assert found == {"x2": Finding.MISPRINT, "x2*sin(x1)": Finding.MISPRINT}
    assert worst(compare_terms(read_printed("-1.448*x2 + 1.764*x2*sin(x1)"), exact)) is Finding.AGREES


def test_numbers_inside_functions_are_compared_by_their_digits() -> None:
    exact = sp.Rational(-588, 17) * z2 * sp.sin(sp.Rational(1000, 51) * z1)
    assert worst(compare_terms(read_printed("-34.59*z2*sin(19.6*z1)"), exact)) is Finding.AGREES
    wrong = compare_terms(read_printed("-34.59*z2*sin(19.7*z1)"), exact)
    assert [c.finding for c in wrong] == [Finding.AGREES, Finding.MISPRINT]
    assert wrong[1].place == "z2*sin(z1), in sin of z1"


def test_missing_and_superfluous_terms_are_misprints() -> None:
    missing, extra = (
        compare_terms(read_printed("2*x1"), 2 * x1 + 3 * x2),
        compare_terms(read_printed("2*x1 + 3*x2"), 2 * x1),
    )
    assert [c.finding for c in missing] == [c.finding for c in extra] == [Finding.AGREES, Finding.MISPRINT]
    assert "left out" in missing[1].meaning
    assert "no such term" in extra[1].meaning


def test_a_term_without_a_number_says_exactly_one() -> None:
    assert worst(compare_terms(read_printed("x2"), x2)) is Finding.AGREES
    assert worst(compare_terms(read_printed("x2"), sp.Rational(101, 100) * x2)) is Finding.MISPRINT


def test_nothing_printed_for_nothing_exact_agrees() -> None:
    assert worst(compare_terms(read_printed("0"), sp.Integer(0))) is Finding.AGREES
    assert worst(compare_terms(read_printed("0"), x1)) is Finding.MISPRINT


def test_formulas_are_compared_exactly() -> None:
    a, b, R, Ra = sp.symbols("a b R Ra", real=True)
    assert compare_formula((a + b) ** 2, a**2 + 2 * a * b + b**2).finding is Finding.AGREES
    assert compare_formula(a + b, a + 2 * b).finding is Finding.MISPRINT
    assert compare_formula(-a * b, a * b).meaning == "the sign is wrong"
    assert compare_formula(R / a, Ra / a).meaning == "R stands where Ra is meant"


def test_the_worst_finding_counts() -> None:
    assert worst([]) is Finding.STATEMENT
    assert worst([_number("1", "1"), _number("34", "588/17")]) is Finding.ROUNDING
    assert worst([_number("1", "2"), _number("34", "588/17")]) is Finding.MISPRINT


def test_a_number_keeps_its_digits() -> None:
    assert read_digits("0.510").step == sp.Rational(1, 1000)
    assert read_digits("34.59").value == sp.Rational(3459, 100)
    assert read_printed("0.10*x1").value == x1 / 10


def test_exponents_are_not_printed_numbers() -> None:
    printed = read_printed("0.5*x1**2")
    assert [digits.text for digits in printed.marks.values()] == ["0.5"]
    assert printed.value == x1**2 / 2


@pytest.mark.parametrize(
    "text",
    """__import__('os')|x1.real|x1[0]|9**9**9|x1**99|x1 if x2 else 0|lambda: 0|1e5*x1|'a'|tan(x1)|x1 +||x1 = 2|1j|True
    0x10|(x1, x2)|x1 @ x2|x1 < x2|~x1|print(x1)|cos(x1, *x2)|cos(x1=2)""".replace("\n    ", "|").split("|"),
)
def test_anything_but_a_formula_is_refused(text: str) -> None:
    with pytest.raises(FormulaError, match="printed"):
        read_formula(text)


def test_names_can_stand_for_matrices_whose_shapes_must_fit() -> None:
    names = {"A": sp.eye(3), "v": sp.ones(3, 1)}
    assert read_formula("A*v", names) == sp.ones(3, 1)
    with pytest.raises(FormulaError, match="do not fit together"):
        read_formula("v*A", names)


@given(
    st.lists(
        st.tuples(st.integers(-9, 9), st.sampled_from([x1, x2, x1 * x2, sp.cos(3 * x1), x2 * sp.sin(x1)])), max_size=6
    )
)
def test_terms_put_together_again_are_the_sum(parts: list[tuple[int, sp.Expr]]) -> None:
    expression = sp.Add(*(factor * shape for factor, shape in parts))
    rebuilt = sp.Integer(0)
    for shape, term in split_terms(expression).items():
        numbers = dict(term.inner)
        rebuilt += term.factor * shape.subs(sp.cos(x1), sp.cos(numbers.get("cos of x1", 1) * x1))
    assert sp.expand(rebuilt - expression) == 0
