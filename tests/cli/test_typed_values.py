"""What users type as values: numbers with units, lists, names, formulas of time."""

from __future__ import annotations

import math

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from ulna.base import UlnaError
from ulna.cli.typed_values import formula_of_time, named_values, quantity, typed_list
from ulna.sim import TIME


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("4", "kg", 4),
        ("4 kg", "kg", 4),
        ("4e-3kg", "kg", sp.Rational(4, 1000)),
        ("1500 g", "kg", sp.Rational(3, 2)),
        ("-30deg", "rad", -sp.pi / 6),
        ("30 °", "rad", sp.pi / 6),
        ("pi/2 rad", "rad", sp.pi / 2),
        ("2*pi", "rad", 2 * sp.pi),
        ("sqrt(2) m/s^2", "m/s^2", sp.sqrt(2)),
        ("20 mH", "H", sp.Rational(1, 50)),
        ("5 %", "", sp.Rational(1, 20)),
        ("3 m", None, 3),
    ],
)
def test_a_quantity_is_exact_in_si(text, unit, value):
    assert quantity(text, "--set", unit=unit) == value


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("4 kg", "rad", "'kg' measures mass, expected a pure number or an angle. Write it in rad."),
        ("4 kg", "", "Leave the unit out"),
        ("4 kgg", "kg", "the unit 'kgg': 'kgg' is unknown"),
        ("2pi", "rad", "no operator between"),
        ("x", "kg", "unknown symbol 'x'"),
        ("__import__('os')", "kg", "unknown function '__import__'"),
        ("1e400", "kg", "its value is inf"),
        ("", "kg", "the formula is empty"),
    ],
)
def test_what_is_no_quantity_is_refused(text, unit, reason):
    with pytest.raises(UlnaError) as refusal:
        quantity(text, "--set 'm=…'", unit=unit)
    assert reason in str(refusal.value)
    assert str(refusal.value).startswith("--set 'm=…'")


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["", "kg", " kg"]))
def test_a_number_is_read_back_to_the_last_bit(value, unit):
    assert float(quantity(f"{value!r}{unit}", "--set", unit="kg")) == value


def test_a_formula_of_time_is_a_formula_and_everything_else_a_number():
    assert formula_of_time("0.5*sin(2*t)", "--input") == sp.sin(2 * TIME) / 2
    assert formula_of_time("pi/2", "--input") == math.pi / 2
    assert formula_of_time("90 deg", "--input", unit="rad") == math.pi / 2
    # t is the time, not a metric ton.
    for text, reason in (("0.5 t", "no operator between"), ("x*t", "unknown symbol 'x'"), ("x", "unknown symbol")):
        with pytest.raises(UlnaError, match=reason):
            formula_of_time(text, "--input")


def test_commas_in_parentheses_do_not_divide():
    assert typed_list("atan2(1, 2), 3") == ["atan2(1, 2)", "3"]
    assert [entry[:2] for entry in named_values(["a=min(1,2), b=3", "c = 4"], "--set")] == [
        ("a", "min(1,2)"), ("b", "3"), ("c", "4")
    ]  # fmt: skip


@pytest.mark.parametrize(("entries", "reason"), [(["a"], "a name and its value"), (["a=1", "a=2"], "is given twice")])
def test_entries_without_a_name_or_with_one_twice_are_refused(entries, reason):
    with pytest.raises(UlnaError, match=reason):
        list(named_values(entries, "--set"))
