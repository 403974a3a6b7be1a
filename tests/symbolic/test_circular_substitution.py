"""Integrals of rational functions of sines and cosines."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.symbolic.exact import is_zero
from ulna.symbolic.integration import antiderivative_by_substitution

y, e = sp.symbols("y e", real=True)
sin, cos, tan = sp.sin(y), sp.cos(y), sp.tan(y)


@pytest.mark.parametrize(
    "integrand",
    [
        -(e**2 * cos**2 + 1) * tan / (e**2 * cos**2 - 1),
        cos / (1 + sin**2),
        1 / (1 + cos**2),
        sin**3 / cos,
        tan**3,
        1 / cos,
        sin * cos / (2 + cos),
    ],
)
def test_the_integral_differentiates_back(integrand):
    found = antiderivative_by_substitution(integrand, y)
    assert found is not None
    assert is_zero(found.diff(y) - integrand).holds


@pytest.mark.parametrize("integrand", [y * sin, 1 / (2 + cos), sp.sin(2 * y), 1 / (1 + y**2)])
def test_other_integrands_are_left_to_other_rules(integrand):
    assert antiderivative_by_substitution(integrand, y) is None
