"""Formulas as MathML."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import FormulaError, mathml
from ulna.base.letters import LETTERS, SIGNS
from ulna.report import with_decimals

x, y, theta = sp.symbols("x1 y theta_P", real=True)


def _inside(text: str) -> str:
    return re.sub(r"^<math[^>]*>|</math>$", "", text)


@pytest.mark.parametrize(
    ("latex", "expected"),
    [
        ("x_1", "<msub><mi>x</mi><mn>1</mn></msub>"),
        (r"a_1^2", "<msubsup><mi>a</mi><mn>1</mn><mn>2</mn></msubsup>"),
        (r"a^2_1", "<msubsup><mi>a</mi><mn>1</mn><mn>2</mn></msubsup>"),
        (r"\frac{1}{N}", "<mfrac><mn>1</mn><mi>N</mi></mfrac>"),
        (r"\sqrt[3]{x}", "<mroot><mi>x</mi><mn>3</mn></mroot>"),
        (
            r"\dot{\theta}_P",
            '<msub><mover accent="true"><mi>θ</mi><mo stretchy="false">˙</mo></mover><mi>P</mi></msub>',
        ),
        (r"\text{a b}", "<mtext>a&#160;b</mtext>"),
        (r"34.59", "<mn>34.59</mn>"),
        (r"-x", '<mrow><mo form="prefix">−</mo><mi>x</mi></mrow>'),
        (r"y-x", "<mrow><mi>y</mi><mo>−</mo><mi>x</mi></mrow>"),
        ("x''", "<msup><mi>x</mi><mo>′′</mo></msup>"),
        (r"\mathbb{R}^n", "<msup><mi>ℝ</mi><mi>n</mi></msup>"),
    ],
)
def test_latex_becomes_the_expected_elements(latex: str, expected: str) -> None:
    assert _inside(mathml(latex)) == expected


def test_a_matrix_has_its_rows_and_columns_and_brackets() -> None:
    root = ET.fromstring(_inside(mathml(r"\begin{bmatrix} 1 & 2 & 3 \\ 4 & 5 & 6 \\ \end{bmatrix}")))  # noqa: S314
    rows = root.findall(".//mtr")
    assert [[cell[0].text for cell in row] for row in rows] == [["1", "2", "3"], ["4", "5", "6"]]
    assert [mark.text for mark in root.findall("mo")] == ["[", "]"]


def test_equations_below_each_other_are_aligned_without_brackets() -> None:
    root = ET.fromstring(_inside(mathml(r"\begin{aligned}\dot{x} &= y \\ y &= 1\end{aligned}")))  # noqa: S314
    assert [len(row) for row in root.iter("mtr")] == [2, 2]
    assert root.findall("mo") == []


@pytest.mark.parametrize(
    "latex",
    [
        r"\begin{bmatrix} 1",
        r"\frac{1}",
        r"\frac12",
        r"\left( x",
        r"\unknown{x}",
        "}",
        r"\begin{tikz}\end{tikz}",
        "{x",
        r"\left<x\right>",
        r"\begin{matrix}1\end{bmatrix}",
        r"\mathbb{X}",
        "x & y",
        r"\right)",
        "#",
        r"\text{a",
    ],
)
def test_what_cannot_be_set_is_refused_and_named(latex: str) -> None:
    with pytest.raises(FormulaError, match=re.escape(latex)):
        mathml(latex)


def test_markup_in_a_formula_is_escaped() -> None:
    assert "<script>" not in mathml(r"\text{<script>} < >")


def test_letters_and_signs_are_single_characters() -> None:
    assert all(len(sign) == 1 for sign in (*LETTERS.values(), *SIGNS.values()))


EXPRESSIONS = st.recursive(
    st.sampled_from([x, y, theta, sp.Integer(3), sp.Rational(100, 51), sp.pi]),
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda pair: sp.Add(*pair)),
        st.tuples(inner, inner).map(lambda pair: sp.Mul(*pair)),
        inner.map(sp.cos),
        inner.map(lambda e: sp.exp(-e)),
        inner.map(lambda e: sp.sqrt(e**2 + 1)),
        inner.map(lambda e: 1 / (e**2 + 2)),
    ),
    max_leaves=8,
)


@settings(max_examples=30)
@given(EXPRESSIONS)
def test_whatever_sympy_prints_can_be_set(expression: sp.Expr) -> None:
    for shown in (with_decimals(expression, 6), sp.Matrix([[expression, 1]])):
        ET.fromstring(mathml(sp.latex(shown, full_prec=False, mul_symbol=None)))  # noqa: S314 (our own text)


@settings(max_examples=30)
@given(EXPRESSIONS)
def test_decimals_for_reading_stay_near_the_exact_value(expression: sp.Expr) -> None:
    point = {x: sp.Rational(3, 7), y: sp.Rational(-2, 5), theta: sp.Rational(5, 4)}
    exact = complex(expression.subs(point).evalf(30))
    shown = complex(with_decimals(expression, 12).subs(point).evalf(30))
    if abs(exact) < 1e8:
        assert abs(shown - exact) <= 1e-5 * (1 + abs(exact))


def test_decimals_keep_integers_and_exponents() -> None:
    shown = with_decimals(3 * x ** sp.Rational(1, 2) + sp.Rational(1, 4), 6)
    assert shown.coeff(sp.sqrt(x)) == sp.Integer(3)
    assert shown.atoms(sp.Float) == {sp.Float("0.25", 6)}
