"""Long sums and products are read in the order in which they are written, in parts that the parser takes well."""

from __future__ import annotations

import random
from fractions import Fraction

import pytest
import sympy as sp

from ulna.base import FormulaError
from ulna.symbolic.formulas import parse_formula
from ulna.symbolic.formulas.long_sums import grouped

x = sp.Symbol("x", real=True)


def value(words: str) -> Fraction:
    """The formula in Python's own arithmetic."""
    text = " ".join(f"Fraction({word})" if word.isdigit() else word for word in words.split())
    return eval(text, {"Fraction": Fraction})  # noqa: S307 - a formula of this test


@pytest.mark.parametrize("seed", range(6))
def test_groups_have_the_value_of_the_formula(seed: int) -> None:
    chance = random.Random(seed)

    def written(depth: int) -> str:
        words = [str(chance.randint(1, 9))]
        for _ in range(chance.choice((3, 200))):
            words.append(chance.choice("+-*/"))
            words += ["-"] if chance.random() < 0.1 else []
            inner = depth and chance.random() < 0.03
            words.append(f"( {written(depth - 1)} )" if inner else str(chance.randint(1, 9)))
            words += ["**", str(chance.randint(1, 2))] if chance.random() < 0.1 else []
        return " ".join(words)

    formula = written(2)
    try:
        expected = value(formula)
    except ZeroDivisionError:
        return
    assert value(grouped(formula.split())) == expected


def test_long_formulas_are_read() -> None:
    assert parse_formula("+".join(["x"] * 2000), {"x": x}) == 2000 * x
    assert parse_formula("x" + "-x*2" * 2000 + "/2" * 70, {"x": x}).coeff(x) == 1 - 2 * 1999 - sp.Rational(2, 2**70)
    assert parse_formula("max(" + "+".join(["x"] * 200) + ", 1)", {"x": x}) == sp.Max(200 * x, 1)


@pytest.mark.parametrize("formula", ["((x**1000)**1000)**1000", "*".join(["x**1000"] * 5)])
def test_powers_that_grow_too_large_are_refused(formula: str) -> None:
    with pytest.raises(FormulaError, match="too large"):
        parse_formula(formula, {"x": x})
    assert parse_formula("(x**10)**10", {"x": x}) == x**100
