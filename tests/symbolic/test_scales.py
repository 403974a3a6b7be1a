"""Measured numbers in exponents and angles give letters of low degree, and the identities between them still hold."""

from __future__ import annotations

import contextlib

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import Status
from ulna.symbolic.exact import is_zero, normal, tidy
from ulna.symbolic.exact.embed import embed
from ulna.symbolic.exact.field import Field, NotEmbeddableError, TooLargeError
from ulna.symbolic.exact.scales import OtherLettersError, Scales

x, y = sp.symbols("x y", real=True)
exp, sin, cos, tanh = sp.exp, sp.sin, sp.cos, sp.tanh
decimals = st.decimals("0.001", "99", places=3).map(lambda number: sp.Rational(str(number))).filter(bool)


def greatest_degree(expression: sp.Expr) -> int:
    _, [element] = embed([expression])
    return max(int(polynomial.total_degree()) for polynomial in element)


@settings(max_examples=30, deadline=None)
@given(decimals, decimals, decimals)
def test_no_decimal_makes_a_high_degree(a: sp.Rational, b: sp.Rational, c: sp.Rational) -> None:
    for expression in (
        exp(a * x) + c,
        x * exp(a * x) + exp(b * x) - c,
        tanh(x / a) + tanh(x / b),
        exp(-a / x) + y,
        exp(a) + exp(b) * exp(c) * x,
        sin(a * x) * cos(b * x),
    ):
        assert greatest_degree(expression) <= 60


@pytest.mark.parametrize(
    "zero",
    [
        exp(sp.Rational(967, 25) * x) ** 2 - exp(sp.Rational(1934, 25) * x),
        tanh(x / sp.Rational(259, 10000)) * 2 - 2 + 4 / (exp(x * sp.Rational(20000, 259)) + 1),
        exp(sp.Rational(18477, 25000)) ** 2 * x - x * exp(sp.Rational(18477, 12500)),
        sin(sp.Rational(157, 50) * x) * 2 * cos(sp.Rational(157, 50) * x) - sin(sp.Rational(157, 25) * x),
        exp(1000 * x + sp.Rational(7, 11) * y) - exp(1000 * x) * exp(sp.Rational(7, 11) * y),
        exp(967 * x) * exp(x) - exp(968 * x),
    ],
    ids=str,
)
def test_identities_between_multiples_are_proved(zero: sp.Expr) -> None:
    assert is_zero(zero).status is Status.PROVED
    assert is_zero(zero + exp(sp.Rational(967, 25) * x) / 10**30).fails


def test_letters_are_chosen_anew_for_a_multiple_they_do_not_give() -> None:
    scales = Scales()
    assert scales.multiples(sp.Rational(967, 25), x) == [(1, sp.Rational(967, 25))]
    with pytest.raises(OtherLettersError):
        scales.multiples(sp.Rational(1), x)
    assert scales.multiples(sp.Rational(1), x) == [(1, sp.Rational(1))]
    assert scales.multiples(sp.Rational(992, 25), x) == [(1, sp.Rational(1)), (1, sp.Rational(967, 25))]


def test_too_many_unrelated_multiples_are_refused() -> None:
    scales = Scales()
    for number in (101, 1009, 10007, 100003, 1000003, 10000019):
        with contextlib.suppress(OtherLettersError):
            scales.multiples(sp.Rational(number, 7), x)
    with pytest.raises(NotEmbeddableError):
        scales.multiples(sp.Rational(100000007, 7), x)


def test_products_of_high_degree_are_refused_before_they_are_computed() -> None:
    ring = Field(3)
    a, b = (ring.variables[k] for k in (0, 1))
    with pytest.raises(TooLargeError):
        ring.power((a + b, ring.one), 10**9)
    with pytest.raises(TooLargeError):
        ring.times(a**2000 + b, b**2000 + a)
    assert ring.times(a**20 + b, b) == a**20 * b + b**2


@settings(max_examples=3, deadline=None)
@given(decimals, decimals)
def test_short_forms_keep_their_values(a: sp.Rational, b: sp.Rational) -> None:
    expression = (exp(a * x) * exp(b * x) + exp(a * x)) / exp(a * x) - tanh(b * x) * cos(a)
    for form in (normal(expression), tidy(expression)):
        assert abs(sp.N((form - expression).subs(x, sp.Rational(1, 7)), 30)) < 1e-20
