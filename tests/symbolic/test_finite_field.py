"""The algebra of functions survives in the finite field; null spaces and fractions come back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sympy import Expr, I, Rational, Symbol, cos, cosh, exp, log, oo, pi, sin, sinh, sqrt, symbols, tan, zoo

from ulna.symbolic.exact.finite_field import PRIMES, FieldSample
from ulna.symbolic.exact.residues import combined_residue, null_space_modulo, rational_from_residue

x, y, z = symbols("x y z", real=True)
a = Symbol("a", real=True)

IDENTITIES: dict[str, Expr] = {
    "pythagoras": sin(x * y) ** 2 + cos(x * y) ** 2 - 1,
    "addition": sin(x + 2 * y) - sin(x) * cos(2 * y) - cos(x) * sin(2 * y),
    "half angles": cos(x) - 1 + 2 * sin(x / 2) ** 2,
    "tangent": tan(x) * cos(x) - sin(x),
    "exponential": exp(2 * x - y) * exp(y / 3) ** 3 - exp(2 * x),
    "hyperbolic": cosh(x) + sinh(x) - exp(x),
    "euler": exp(0 * x) - 1,
    "logarithm of a product": log(x**2 * y) - 2 * log(x) - log(y),
    "logarithm of a multiple": log(2 + 2 * x) - log(2) - log(1 + x),
    "square root": sqrt(1 + x**2) ** 2 - 1 - x**2,
    "root of a symbol": sqrt(x) ** 3 - x * sqrt(x),
    "cube root": (1 + x) ** Rational(2, 3) * (1 + x) ** Rational(1, 3) - 1 - x,
    "symbolic exponent": x ** (a + 2) - x**a * x**2,
    "symbolic exponents multiply": x ** (2 * a) - (x**a) ** 2,
    "imaginary unit": I**2 + 1,
    "fraction": 1 / (x - 1) - 1 / (x + 1) - 2 / (x**2 - 1),
}


@pytest.mark.parametrize("name", IDENTITIES)
def test_an_identity_holds_in_the_field(name: str) -> None:
    sample = FieldSample(24)
    values = sample(IDENTITIES[name])
    assert sample.valid.any()
    assert not np.any(values[sample.valid])


@pytest.mark.parametrize("wrong", [sin(x) - cos(x), exp(x) - exp(2 * x), log(x * y) - log(x), sqrt(x) - x, pi - 3])
def test_a_wrong_identity_fails_in_the_field(wrong: Expr) -> None:
    sample = FieldSample(24)
    values = sample(wrong)
    assert np.all(values[sample.valid])


def test_points_where_a_denominator_vanishes_are_not_valid() -> None:
    sample = FieldSample(8)
    sample(1 / (x - x * cos(z) ** 2 - x * sin(z) ** 2))
    assert not sample.valid.any()


@pytest.mark.parametrize("undefined", [oo + 0 * x, zoo])
def test_what_is_not_finite_is_not_valid(undefined: Expr) -> None:
    sample = FieldSample(8)
    sample(undefined)
    assert not sample.valid.any()


def test_constants_have_one_value_at_all_points() -> None:
    sample = FieldSample(8, constants=[a])
    assert len(set(sample(a * exp(a)).tolist())) == 1
    assert len(set(sample(a * x).tolist())) > 1


@given(st.integers(-2000, 2000), st.integers(1, 2000))
def test_small_fractions_are_recovered_from_one_residue(p: int, q: int) -> None:
    prime = PRIMES[0]
    assert rational_from_residue(p * pow(q, -1, prime) % prime, prime) == Rational(p, q)


@given(st.integers(-(10**15), 10**15), st.integers(1, 10**9))
def test_large_fractions_are_recovered_from_several_residues(p: int, q: int) -> None:
    residues = [p * pow(q, -1, prime) % prime for prime in PRIMES]
    assert rational_from_residue(combined_residue(residues, PRIMES), math.prod(PRIMES)) == Rational(p, q)


def test_a_residue_without_small_fraction_is_refused() -> None:
    assert rational_from_residue(pow(123457, 3, PRIMES[0]), PRIMES[0]) is None


def test_null_space_annihilates_and_is_complete() -> None:
    matrix = np.array([[1, 2, 3, 4], [2, 4, 6, 8], [0, 0, 1, 5]], dtype=np.int64)
    basis = null_space_modulo(matrix)
    assert len(basis) == 2
    for vector in basis:
        column = np.array([vector.get(k, 0) for k in range(4)])
        assert not np.any(matrix @ column % PRIMES[0])
