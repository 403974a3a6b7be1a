"""The error of a run is small beside each state's own size, whatever that size is."""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy as sp

from ulna.sim import Crossing, Ends, Held, Outcome, simulate
from ulna.sim.continuous.yardstick import Yardstick, misfits, powers_of_two
from ulna.system import Parameter, Signal, System

a, b, c, u, R, C = sp.symbols("a b c u R C", real=True)
NAMES = ("a", "b", "c")
MATRIX = ((0, 1, 0), (-9, -1, 2), (1, 0, -3))
START = (1.0, -0.5, 0.25)
TIMES = np.linspace(0.0, 4.0, 9)
DECADES = range(-20, 1, 4)


@cache
def exact() -> np.ndarray:
    """(9, 3) of the system of size 1, by the matrix exponential in 50 digits."""
    with mpmath.workdps(50):
        return np.array(
            [list(map(float, mpmath.expm(mpmath.matrix(MATRIX) * t) * mpmath.matrix(START))) for t in TIMES.tolist()]
        )


def scaled(*sizes: float) -> System:
    """x' = D A D⁻¹ x, whose states are D times those of x' = A x; the factors are parameters."""
    factors = sp.symbols("d0:3", real=True)
    states = sp.Matrix([a / factors[0], b / factors[1], c / factors[2]])
    rates = [factor * rate for factor, rate in zip(factors, sp.Matrix(MATRIX) * states, strict=True)]
    return System(
        name="scaled",
        states=tuple(Signal(name=name) for name in NAMES),
        rates=tuple(rates),
        outputs=(Signal(name="y"),),
        readouts=(a,),
        parameters=tuple(
            Parameter(name=str(factor), value=sp.Float(size)) for factor, size in zip(factors, sizes, strict=True)
        ),
    )


SCALED = scaled(1.0, 1.0, 1.0)


def parameters(sizes: np.ndarray) -> dict[str, np.ndarray]:
    return {f"d{k}": row for k, row in enumerate(sizes)}


@pytest.mark.parametrize("decade", DECADES)
@pytest.mark.parametrize("spread", [(0, 0, 0), (0, 7, -7)], ids=["even", "uneven"])
def test_a_run_is_exact_beside_each_state(decade: int, spread: tuple[int, ...]) -> None:
    sizes = 10.0 ** (decade + np.array(spread, dtype=float))
    values = {name: float(row) for name, row in parameters(sizes).items()}
    run = simulate(SCALED, sizes * START, TIMES, parameters=values)
    np.testing.assert_allclose(run.states / sizes, exact(), rtol=0, atol=1e-12)
    last = simulate(SCALED, sizes * START, 4.0, parameters=values)
    np.testing.assert_allclose(last.final_state / sizes, exact()[-1], rtol=0, atol=1e-12)


def test_many_runs_are_exact_beside_each_state() -> None:
    sizes = 10.0 ** np.array([[d, d + s, d - s] for d in DECADES for s in (0, 7)], dtype=float).T
    runs = simulate(SCALED, (sizes.T * START), 4.0, parameters=parameters(sizes), record=Ends(), threads=1)
    np.testing.assert_allclose(
        runs.final_state / sizes.T, np.tile(exact()[-1], (sizes.shape[1], 1)), rtol=0, atol=1e-12
    )


def test_events_of_small_motions_are_exact() -> None:
    oscillator = System(name="oscillator", states=(Signal(name="a"), Signal(name="b")), rates=(b, -a))
    for size in (1e-17, 1e-8, 1.0, 1e9):
        event = Crossing(name="zero", expression=a - sp.Float(size) / 2)
        run = simulate(oscillator, (size, 0.0), 20.0, events=(event,))
        expected = sorted(sign * np.pi / 3 + 2 * np.pi * k for sign in (1, -1) for k in range(4))[1:]
        found = [each.time for each in run.events]
        np.testing.assert_allclose(found, [t for t in expected if t < 20.0], rtol=0, atol=1e-12)


def test_a_state_that_begins_at_zero_shows_its_size_along_the_run() -> None:
    circuit = System(
        name="circuit",
        states=(Signal(name="c", unit="C"),),
        rates=((u - c / C) / R,),
        inputs=(Signal(name="u", unit="V"),),
        parameters=(Parameter(name="R", value=sp.Integer(10**6)), Parameter(name="C", value=sp.Rational(1, 10**12))),
    )
    times = np.linspace(0.0, 4e-6, 41)
    rising = simulate(circuit, (0.0,), times, inputs={"u": 1.0})
    np.testing.assert_allclose(rising["c"] * 1e12, -np.expm1(-times * 1e6), rtol=0, atol=1e-13)
    pulse = Held.known(times=np.array([0.0, 1e-6, 2e-6]), values=np.array([0.0, 1.0, 0.0]))
    found = simulate(circuit, (0.0,), times, inputs={"u": pulse})
    since = np.clip(times * 1e6 - 1.0, 0.0, 1.0)
    expected = -np.expm1(-since) * np.exp(-np.clip(times * 1e6 - 2.0, 0.0, None))
    np.testing.assert_allclose(found["c"] * 1e12, expected, rtol=0, atol=1e-13)
    assert found.outcome is Outcome.FINISHED


def test_states_of_one_size_are_left_alone_and_others_are_divided_by_powers_of_two() -> None:
    even, uneven = np.array([[1.0, 0.01, 0.0], [3.0, 0.0, 0.0]]), np.array([[1.0, 1e-9, 0.0], [3.0, 0.0, 0.0]])
    yardstick = Yardstick()
    assert yardstick.fits(even)
    assert yardstick.divisors is None
    assert not Yardstick().fits(uneven)
    assert misfits(np.abs(np.stack([even[0], uneven[0]], axis=1))).tolist() == [False, True]
    assert powers_of_two(np.array([3.0, 1e-9, 0.0])).tolist() == [2.0, 2.0**-30, 1.0]
