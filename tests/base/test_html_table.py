"""Tables for notebooks: numbers for people, formulas set, and no text of a user ever taken for HTML."""

from __future__ import annotations

import math

import pytest
import sympy as sp
from markupsafe import Markup

from ulna.base import Verdict, html_table, number_text

EVIL = "<script>alert('x')</script>"


def test_every_text_is_escaped_wherever_it_stands() -> None:
    table = html_table([(EVIL, EVIL)], title=EVIL, headings=(EVIL, EVIL), below=(EVIL,))
    assert "<script" not in table
    assert table.count("&lt;script&gt;") == 6
    assert "<script" not in Verdict.refuted(EVIL, **{EVIL: EVIL, "symbol": sp.Symbol(EVIL)})._repr_html_()


def test_what_brings_its_own_html_is_put_in_as_it_is() -> None:
    assert '<td style="text-align:left"><i>x</i></td>' in html_table([("a", Markup("<i>x</i>"))])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3, "3"),
        (0.1 + 0.2, "0.3"),
        (complex(-2, 12**0.5), "-2 + 3.4641 j"),
        (complex(0, -1), "0 - 1 j"),
        (math.inf, "∞"),
        (math.nan, "nan"),
    ],
)
def test_numbers_have_six_digits(value: complex, text: str) -> None:
    assert number_text(value) == text


def test_numbers_stand_to_the_right_and_a_long_text_is_cut() -> None:
    table = html_table([("a", 0.25, "x" * 1000)], headings=("name", "number", "text"))
    assert '<td style="text-align:right">0.25</td>' in table
    assert '<th style="text-align:right">number</th>' in table
    assert f"{'x' * 300}… (1000 characters)" in table


def test_short_formulas_are_set_and_long_ones_told_as_text() -> None:
    x = sp.Symbol("x")
    verdict = Verdict.refuted("f is zero", field=sp.Matrix([x, x**2]), long=sp.Add(*(x**k for k in range(1, 99))))
    table = verdict._repr_html_()
    assert "<math" in table
    assert "characters)" in table
    assert "refuted: f is zero" in table
