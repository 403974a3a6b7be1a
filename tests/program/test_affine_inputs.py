"""Inputs that give the outputs asked for, read off a program that is affine in them."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ulna.base import UlnaError
from ulna.program import solved_for_inputs, to_numpy
from ulna.symbolic.compiling import kernel

x, y, u, w = (sp.Symbol(name, real=True) for name in "xyuw")
WANTED = [("v1", "a"), ("v2", "b")]
SAMPLE = [[0.7, 1.1, 0.3, 0.9]]

PAIRS = [
    (x * u + y, (u - w) / (1 + x**2)),
    (2 * u + 3 * w + x, x * u - y * w),
    ((u + w) * sp.sin(x) - (u - w) * y, (x - u) / y + w),
    (-(w + x) + sp.exp(y), y * (u + w * x) - 1),
]


@pytest.mark.parametrize("pair", PAIRS, ids=str)
def test_the_outputs_are_the_ones_asked_for(pair):
    program = kernel("p", (x, y, u, w), {"a": pair[0], "b": pair[1]})
    inverse = solved_for_inputs("inverse", program, ["u", "w"], WANTED, SAMPLE)
    assert inverse is not None
    generator = np.random.default_rng(1)
    for _ in range(5):
        states, v = generator.uniform(0.3, 2, 2), generator.uniform(-2, 2, 2)
        found = to_numpy(inverse)(*states, *v)
        assert np.array(to_numpy(program)(*states, *found)) == pytest.approx(v, rel=1e-10, abs=1e-10)


@settings(max_examples=25, deadline=None)
# Tiny coefficients beside large ones: as pivots they would cost eight digits.
@example([5.3e-9, -3e-3, 2.9e-7, -4.6e-4, 0.0, 2.9e-6, -4.9e-7, 1e-2, 5.8e-5])
@given(st.lists(st.floats(-3, 3), min_size=9, max_size=9))
def test_any_regular_matrix_is_solved(entries):
    """A x + u-dependent right-hand sides: the law of three coupled rows."""
    matrix = np.array(entries).reshape(3, 3) + 10 * np.eye(3)
    inputs = sp.symbols("u1:4", real=True)
    rows = [sum(sp.Rational(c) * s for c, s in zip(row, inputs, strict=True)) * sp.cos(x) + x for row in matrix]
    program = kernel("p", (x, *inputs), {f"a{k}": e for k, e in enumerate(rows)})
    wanted = [(f"v{k}", f"a{k}") for k in range(3)]
    inverse = solved_for_inputs("inverse", program, [s.name for s in inputs], wanted, [[0.4, 1, 2, 3]])
    assert inverse is not None
    found = np.array(to_numpy(inverse)(0.5, 1.0, -2.0, 3.0))
    expected = np.linalg.solve(matrix * np.cos(0.5), np.array([1.0, -2.0, 3.0]) - 0.5)
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-12)


def test_what_is_not_affine_is_refused():
    assert solved_for_inputs("i", kernel("p", (x, u), {"a": sp.sin(u) + x}), ["u"], [("v", "a")], [[1, 1]]) is None
    assert solved_for_inputs("i", kernel("p", (x, u), {"a": u * (u + x)}), ["u"], [("v", "a")], [[1, 1]]) is None


def test_an_output_without_input_is_refused():
    assert solved_for_inputs("i", kernel("p", (x, u), {"a": x}), ["u"], [("v", "a")], [[1, 1]]) is None


def test_singular_equations_say_so():
    program = kernel("p", (x, y, u, w), {"a": x * (u + w), "b": y * (u + w)})
    with pytest.raises(UlnaError, match="singular"):
        solved_for_inputs("inverse", program, ["u", "w"], WANTED, SAMPLE)
