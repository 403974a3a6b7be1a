"""Formulas and sentences on terminals of any width."""

from __future__ import annotations

import re

import pytest
import sympy as sp

from ulna.cli.layout import broken, say, shown
from ulna.plants import model
from ulna.symbolic.formulas import decimal_text, exact_text, formula, parse_formula

NAMES = re.compile(r"[A-Za-z_]\w*|\d+(?:\.\d+)?(?:e[+-]\d+)?")


@pytest.fixture
def columns(monkeypatch, request):
    monkeypatch.setenv("COLUMNS", str(request.param))
    return request.param


@pytest.mark.parametrize("columns", [40, 60, 80, 120], indirect=True)
@pytest.mark.parametrize("plant", ["cart_pole", "acrobot", "pmsm_salient", "induction_motor", "helicopter_three_axes"])
def test_a_long_formula_keeps_its_names_and_numbers_whole(plant, columns):
    system = model(plant)
    for rate in system.inline(system.rates):
        text = formula(sp.expand(rate))
        lines = list(broken("rate = ", text))
        assert "".join("".join(lines).split()) == "".join(f"rate = {text}".split())
        assert NAMES.findall(" ".join(lines)) == NAMES.findall(f"rate = {text}")
        # Longer is only what has no place to break.
        assert all(len(line) <= columns or not re.search(r".\s[-+]\s", line[12:]) for line in lines)
        assert all(line.startswith("  ") for line in lines[1:])


def test_a_formula_goes_on_below_where_it_or_its_bracket_begins(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    sum_in_front = "alpha*beta + gamma*delta*epsilon - zeta*eta*theta"
    assert list(broken("u = ", sum_in_front)) == ["u = alpha*beta + gamma*delta*epsilon", "    - zeta*eta*theta"]
    in_bracket = "gamma*(first_term + second_term + third_term)"
    assert list(broken("u = ", in_bracket)) == ["u = gamma*(first_term + second_term", "           + third_term)"]


@pytest.mark.parametrize("columns", [40, 80], indirect=True)
def test_a_sentence_is_broken_at_spaces_only(columns, capsys):
    say("the inputs of the plant are not involutive: [g, ad_f g] leaves a_very_long_name_that_stays_whole", indent=2)
    lines = capsys.readouterr().out.splitlines()
    assert all(len(line) <= columns for line in lines)
    assert "a_very_long_name_that_stays_whole" in " ".join(lines)


X, Y, T = sp.symbols("x y theta", real=True)
R = sp.Rational


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ((-500000 * X + 4410000 * Y * sp.sin(T) - 52920000) / 2500000, "-0.2*x + 1.764*y*sin(theta) - 21.168"),
        (R(79858, 625), "127.773"),
        (R(54072450001, 5000000000), "10.8145"),
        (sp.Integer(54072450001), "5.40725e+10"),
        (sp.Integer(12), "12"),
        (X ** R(3, 2) / 3, "0.333333*x**(3/2)"),
        (sp.sqrt(3) * X, "1.73205*x"),
        (R(1, 3) * (X + Y), "0.333333*x + 0.333333*y"),
        (sp.Piecewise((X / 3, X < R(1, 3)), (Y, True)), "Piecewise((0.333333*x, x < 1/3), (y, True))"),
        (sp.Max(X / 4, 1), "max(1, 0.25*x)"),
        (X * 0, "0"),
    ],
)  # fmt: skip
def test_numbers_are_decimals_of_six_digits(expression, text):
    assert decimal_text(expression) == text


@pytest.mark.parametrize("plant", ["cart_pole", "cstr_exothermic", "pmsm_salient", "furuta_pendulum", "acrobot"])
def test_a_formula_in_decimals_has_the_same_values(plant):
    system = model(plant).with_values()
    names = {s.name: s for s in (*system.state_symbols, *system.input_symbols)}
    point = {s: R(3 + 2 * k, 7) for k, s in enumerate(names.values())}
    for rate in system.inline(system.rates):
        again = parse_formula(decimal_text(rate, 12), names)
        assert float(again.subs(point)) == pytest.approx(float(rate.subs(point)), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (R(441, 250) * X - Y / 3, "1.764*x - y/3"),
        (R(-7, 4) / (X * Y), "-1.75/(x*y)"),
        (R(1, 2) * sp.sqrt(2) * sp.sin(X / 4), "0.5*sqrt(2)*sin(0.25*x)"),
        ((50 * X - 441 * Y) / 250, "0.2*x - 1.764*y"),
        (X ** R(-3, 2), "x**(-3/2)"),
        (R(54072450001, 5000000000), "10.8144900002"),
        (X / 3**40, "x/12157665459056928801"),
    ],
)
def test_a_fraction_is_written_as_a_decimal_where_it_is_a_short_one(expression, text):
    assert exact_text(expression) == text
    assert parse_formula(text, {"x": X, "y": Y}) == expression


@pytest.mark.parametrize("plant", ["cart_pole", "cstr_exothermic", "pmsm_salient", "furuta_pendulum", "abs_brake"])
def test_what_is_written_in_exact_decimals_is_read_back_exactly(plant):
    system = model(plant).with_values()
    names = {s.name: s for s in (*system.state_symbols, *system.input_symbols)}
    for rate in system.inline(system.rates):
        assert sp.simplify(parse_formula(exact_text(rate), names) - rate) == 0


def test_vectors_and_mappings_are_one_text():
    assert shown(sp.Matrix([[R(1, 3), 2]])) == "(0.333333, 2)"
    assert shown(sp.Matrix([[R(1, 3), 2]]), exact=True) == "(1/3, 2)"
    assert shown({"x": R(1, 2), "y": None, "z": []}) == "x = 0.5; y = –"
    assert shown([True, False, None, 1.23456789, 2 - 3.5j]) == "yes, no, –, 1.23457, 2-3.5j"
