"""Sine and cosine as a loop has them written out, against forty digits."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from ulna.program import HEADER, compiled
from ulna.sim.sampled.writing import Writer
from ulna.symbolic.compiling import kernel

X = sp.Symbol("x", real=True)


def _written(**functions: sp.Expr) -> Any:
    """The function f(x, out) of a column x; row k of `out` takes the k-th expression."""
    w = Writer()
    w.depth = 2
    for k, text in enumerate(w.kernel(kernel("functions", [X], functions), {"x": w.new("x[l]")})):
        w.line(f"out[{k}, l] = {text}")
    head = (
        '@numba.njit("void(float64[::1], float64[:, ::1])", error_model="numpy", cache=CACHE)\n'
        "def loop(x, out):\n    for l in range(len(x)):\n"
    )
    return compiled(HEADER + head + "\n".join(w.lines) + "\n")


def _ulps(values: np.ndarray, angles: np.ndarray, exact: object) -> np.ndarray:
    """Errors in units in the last place of what is exact, of 1e-13 where that is smaller."""
    with mpmath.workdps(40):
        true = [exact(mpmath.mpf(float(x))) for x in angles]  # pyright: ignore[reportCallIssue]
        units = [math.ulp(max(1e-13, abs(float(t)))) for t in true]
        return np.array([float(abs(v - t) / u) for v, t, u in zip(values.tolist(), true, units, strict=True)])


def _angles() -> np.ndarray:
    random = np.random.default_rng(0)
    near = (np.arange(-300, 301) * (math.pi / 2))[:, None] + random.uniform(-1e-9, 1e-9, (601, 2))
    wide = 10.0 ** random.uniform(-12, 6, 3000) * random.choice([-1.0, 1.0], 3000)
    zeros = np.arange(-300, 301) * (math.pi / 2)
    return np.concatenate([random.uniform(-7, 7, 4000), wide, near.ravel(), zeros[zeros != 0.0]])


def test_sine_and_cosine_are_within_two_units_in_the_last_place() -> None:
    angles = _angles()
    out = np.zeros((2, len(angles)))
    _written(s=sp.sin(X), c=sp.cos(X))(angles, out)
    assert _ulps(out[0], angles, mpmath.sin).max() < 2.0
    assert _ulps(out[1], angles, mpmath.cos).max() < 2.0


def test_large_angles_lose_no_more_than_the_spacing_of_doubles_near_one() -> None:
    random = np.random.default_rng(1)
    angles = 10.0 ** random.uniform(6, 10, 2000)
    out = np.zeros((2, len(angles)))
    _written(s=sp.sin(X), c=sp.cos(X))(angles, out)
    with mpmath.workdps(40):
        for row, exact in zip(out, (mpmath.sin, mpmath.cos), strict=True):
            worst = max(abs(v - exact(mpmath.mpf(x))) for v, x in zip(row.tolist(), angles.tolist(), strict=True))
            assert worst < 4.5e-16


def test_no_number_stays_no_number_and_zero_keeps_its_sine() -> None:
    out = np.zeros((2, 4))
    _written(s=sp.sin(X), c=sp.cos(X))(np.array([np.nan, np.inf, 0.0, -0.0]), out)
    assert np.isnan(out[:, :2]).all()
    assert out[:, 2:].tolist() == [[0.0, 0.0], [1.0, 1.0]]


@pytest.mark.parametrize("angle", [1.0, 2.5, -40.0])
def test_the_measure_of_errors_sees_a_wrong_last_digit(angle: float) -> None:
    wrong = np.array([math.sin(angle) * (1 + 1e-15)])
    assert _ulps(wrong, np.array([angle]), mpmath.sin).max() > 2.0
