"""Gain schedules: gains at the knots against python-control, loops where one linearisation fails, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from ulna.base import DesignError
from ulna.design import LinearQuadratic, Poles, SetPoint, close_loop, gain_schedule, local_law
from ulna.plants import model
from ulna.sim import simulate
from ulna.system import system_from_mapping

control = pytest.importorskip("control")

BALL = model("magnetic_levitation")
TANK = system_from_mapping(
    {
        "format": 1,
        "name": "tank with an outflow by Torricelli",
        "states": {"h": {"equation": "(u - 0.5*sqrt(h))/(1 + h)"}},
        "inputs": {"u": {}},
        "outputs": {"y": "h"},
        "operating_point": {"h": 1},
    }
)


def ball_slopes(w: float) -> tuple[np.ndarray, np.ndarray]:
    """A and B of the levitated ball at rest at the distance w, by hand: i = w sqrt(m g/k) = 100 w."""
    return np.array([[0, 1, 0], [2 * 9.8 / w, 0, -2 * 9.8 / (100 * w)], [0, 0, -2 / 0.05]]), np.array([[0], [0], [20]])


def at(matrix, symbol: str, value: float) -> np.ndarray:
    names = {s.name: s for s in matrix.free_symbols}
    return np.array(matrix.subs({names[symbol]: value}).evalf(), dtype=float)


@pytest.mark.parametrize("measured", [False, True])
def test_gains_at_the_knots_are_those_of_lqr(measured):
    weights = [1e5, 10.0, 0.1]
    law = gain_schedule(
        BALL, over={"y": (0.005, 0.03, 6)}, gains=LinearQuadratic(state_weights=weights), measured=measured
    )
    for k, w in enumerate(np.linspace(0.005, 0.03, 6)):
        wanted, _, poles = control.lqr(*ball_slopes(w), np.diag(weights), np.eye(1))
        assert at(law.gains, "x" if measured else "y_ref", w) == pytest.approx(wanted, rel=1e-7)
        own = np.roots([1.0, *map(float, reversed(law.polynomials[k]))])
        assert sorted(own.real) == pytest.approx(sorted(poles.real), rel=1e-6)


def test_between_knots_the_gains_are_in_the_middle_and_outside_those_of_the_end():
    law = gain_schedule(BALL, over={"y": (0.01, 0.03, 3)}, gains=[-30, -40, -50])
    first, second, last = (control.place(*ball_slopes(w), [-30, -40, -50]) for w in (0.01, 0.02, 0.03))
    assert at(law.gains, "y_ref", 0.015) == pytest.approx((first + second) / 2, rel=1e-7)
    assert at(law.gains, "y_ref", 0.5) == pytest.approx(last, rel=1e-7)
    assert "gain schedule over y_ref" in law.method


def test_the_schedule_follows_where_one_linearisation_fails():
    states = {"th": {"equation": "om"}, "om": {"equation": "10*sin(th) + u"}}
    plant = system_from_mapping(
        {
            "format": 1,
            "name": "pendulum with a torque, angle from upright",
            "states": states,
            "inputs": {"u": {}},
            "outputs": {"y": "th"},
            "operating_point": {"th": "pi", "om": 0},
        }
    )
    poles, started, times = Poles(-2, -3), [0.05, 0.0], np.linspace(0, 10, 11)
    one = local_law(plant, poles, reference=SetPoint())
    upright = np.array([[0, 1], [10, 0]]) - np.array([[0], [1]]) @ np.array(one.gains, dtype=float)
    assert np.linalg.eigvals(upright).real.max() > 1  # hanging down: 10 + k = 6; upright: -10 + k = -14
    law = gain_schedule(plant, over={"y": (0, 3.2, 17)}, gains=poles)
    for r in (0.0, 0.9):
        run = simulate(close_loop(plant, law), started, times, inputs={"y_ref": r})
        assert run["y"][-1] == pytest.approx(r, abs=1e-3)
        lost = simulate(close_loop(plant, one), started, times, inputs={"y_ref": r})
        assert abs(lost["y"][-1] - r) > 0.5


@pytest.mark.parametrize(("integral", "error"), [(False, 1e-2), (True, 1e-9)])
def test_integral_action_closes_what_interpolation_leaves(integral, error):
    gains = [-2, -3] if integral else [-2]
    law = gain_schedule(TANK, over={"y": (0.25, 4, 5)}, gains=gains, integral=integral)
    for w in (0.25, 0.6, 2.9, 4.0):
        loop = close_loop(TANK, law)
        run = simulate(loop, [1.0], np.linspace(0, 30, 31), inputs={"y_ref": w})
        assert run["y"][-1] == pytest.approx(w, abs=error)


def test_two_inputs_hold_the_other_output():
    plant = model("quadruple_tank").with_values()
    law = gain_schedule(plant, over={"y1": (1.5, 2.1, 3)}, gains=LinearQuadratic())
    loop = close_loop(plant, law)
    run = simulate(loop, [16 / 9, 16 / 9, 1, 1], np.linspace(0, 100, 3), inputs={"y1_ref": 2.1})
    assert run["y1"][-1] == pytest.approx(2.1, abs=1e-6)
    assert run["y2"][-1] == pytest.approx(16 / 9, abs=1e-6)


@pytest.mark.parametrize(
    ("over", "found"),
    [
        ({"z": (0.1, 0.2, 3)}, "the outputs are y"),
        ({"y": (0.2, 0.1, 3)}, "the range of y"),
        ({"y": (0.1, 0.2, 1)}, "the range of y"),
        ({"y": (-1, 1, 2)}, "no equilibrium of the plant was found with y = -1"),
    ],
)
def test_what_is_no_family_is_refused(over, found):
    with pytest.raises(DesignError, match=found):
        gain_schedule(TANK, over=over, gains=[-2])


def test_more_inputs_than_outputs_are_refused():
    states, inputs = {"h": {"equation": "u1 + u2 - sqrt(h)"}}, {"u1": {}, "u2": {}}
    pumps = {"format": 1, "name": "two pumps", "states": states, "inputs": inputs, "outputs": {"y": "h"}}
    with pytest.raises(DesignError, match="2 inputs and 1 controlled outputs"):
        gain_schedule(
            system_from_mapping({**pumps, "operating_point": {"h": 1, "u2": 0}}), over={"y": (1, 2, 2)}, gains=[-1]
        )
