"""Several rest points: all in a box with proof, declared ranges, and the one that is the operating point."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from ulna.base import PlantError, Status
from ulna.plants import model
from ulna.system import equilibria, equilibrium, system_from_mapping


def plant(states, *, inputs=None, point=None, parameters=None):
    return system_from_mapping(
        {
            "name": "plant",
            "parameters": {name: {"value": value} for name, value in (parameters or {}).items()},
            "states": states,
            "inputs": {"u": {}} if inputs is None else inputs,
            "operating_point": point or {},
        }
    )


LORENZ = {"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 8*z/3"}
REACTOR = {
    "Ca": "1 - Ca - 72e9*exp(-8750/T)*Ca",
    "T": "350 - T + 50000/239*72e9*exp(-8750/T)*Ca + 50000/23900*(Tc - T)",
}
"""The usual benchmark: F. G. Shinskey's numbers as apmonitor.com gives them, volume and flow 100."""


def test_the_reactor_has_three_rest_points_asked_for_or_not():
    reactor = plant(REACTOR, inputs={"Tc": {}}, point={"Tc": 300})
    for found in (equilibria(reactor, {"T": (300, 500)}), equilibria(reactor)):
        assert [p["T"] for p in found] == pytest.approx([324.47544, 350.00553, 369.70491], abs=1e-5)
        assert found.complete.status is Status.PROVED
    assert equilibrium(reactor)["T"] == pytest.approx(324.47544, abs=1e-5)


@pytest.mark.parametrize(
    ("states", "within", "expected"),
    [
        # No state follows linearly everywhere: the factor of y vanishes where another equilibrium lies.
        ({"x": "x*(1 - y)", "y": "y*(x - 1)"}, {"x": (-3, 3), "y": (-3, 3)}, [(0, 0), (1, 1)]),
        ({"x": "x*(1 - y)", "y": "y*(x - 1)"}, None, [(0, 0), (1, 1)]),
        ({"x": "v", "v": "x - x**3 - v"}, None, [(-1, 0), (0, 0), (1, 0)]),
        ({"x": "v", "v": "x - x**3 - v"}, {"x": (0.5, 3)}, [(1, 0)]),
        ({"q": "v", "v": "-9.8*sin(q) - v"}, None, [(0, 0), (math.pi, 0)]),
        (LORENZ, None, [(-(72**0.5), -(72**0.5), 27), (0, 0, 0), (72**0.5, 72**0.5, 27)]),
        ({"x": "x**2 + 1"}, {"x": (-100, 100)}, []),
    ],
)
def test_rest_points_of_plants_done_by_hand(states, within, expected):
    found = equilibria(plant(states, inputs={}), within)
    assert [tuple(p.numbers.values()) for p in found] == [pytest.approx(e, abs=1e-12) for e in expected]
    assert found.complete.status is Status.PROVED


def test_a_cart_may_stand_anywhere():
    found = equilibria(model("cart_pole"))
    assert found.free == ("p",)
    assert [p["th"] for p in found] == pytest.approx([0, math.pi])


def test_what_is_not_isolated_or_double_is_not_claimed():
    line = equilibria(plant({"x": "x - y", "y": "2*x - 2*y"}, inputs={}))
    assert line.complete.status is Status.UNDECIDED
    assert "not isolated" in line.complete.evidence["reason"]
    double = equilibria(plant({"x": "(x - 1/3)**2"}, inputs={}), {"x": (-1, 1)})
    assert double.complete.status is Status.UNDECIDED
    assert [p["x"] for p in double] == pytest.approx([1 / 3], abs=1e-5)


def test_declared_ranges_of_inputs_choose_the_branch():
    def speed(**signal):
        states = {"z": "vz", "vz": "4*kf*n**2/m - g"}
        numbers = {"m": 0.5, "kf": 1e-5, "g": 9.81}
        return equilibrium(plant(states, inputs={"n": signal}, point={"z": 10}, parameters=numbers))["n"]

    assert speed(range=[0, 2000]) == pytest.approx(350.178526)
    assert speed(range=[-2000, 0]) == pytest.approx(-350.178526)


def test_declared_ranges_of_states_choose_the_branch():
    def rest(rate, **signal):
        return equilibrium(plant({"x": {"equation": rate, **signal}}, inputs={}))

    assert rest("x**2 - 4", range=[0, 10])["x"] == 2
    assert rest("x**2 - 4", range=[-10, -1])["x"] == -2
    assert rest("cos(x) - x/10", range=[4, 8])["x"] == pytest.approx(5.267116, abs=1e-6)
    refused = rest("x**2 - 4", range=[5, 10])
    assert refused.verdict.fails
    assert abs(refused.verdict.evidence["outside"]["x"]) == 2


@pytest.mark.parametrize("angle", [3.141592653589793, 3.14159, "3.141592653589793"])
def test_a_decimal_near_a_rest_point_is_not_refused(angle):
    free = equilibrium(plant({"q": "v", "v": "-9.8*sin(q) - v"}, inputs={}, point={"q": angle, "v": 0}))
    assert free.verdict.status is Status.SUPPORTED
    assert free["q"] == float(angle)
    held = equilibrium(plant({"q": "v", "v": "-9.8*sin(q) - v + u"}, point={"q": angle}))
    assert held.verdict.holds
    assert abs(held["u"]) < 3e-5


def test_mistakes_are_named():
    with pytest.raises(PlantError, match="the range of x is empty"):
        equilibria(plant({"x": "x - 1"}), {"x": (2, 1)})
    with pytest.raises(PlantError, match="'y' of a point of 'plant'"):
        equilibria(plant({"x": "x - 1"}), {"y": (0, 1)})


def test_linear_elimination_keeps_nothing_hidden():
    # The factor of y is x: dividing by it would hide the rest point at the origin.
    x, y = sp.symbols("x y", real=True)
    found = equilibria(plant({"x": "x*y - x", "y": "x - y**2"}, inputs={}), {"x": (-2, 2), "y": (-2, 2)})
    assert {(p.states[x], p.states[y]) for p in found} >= {(1, 1)}
    assert any(abs(p["x"]) < 1e-6 and abs(p["y"]) < 1e-3 for p in found)


def test_nothing_is_reached_where_rates_die_out_at_infinity():
    """The slip of a braked wheel dies out like 1/s: Newton's method would go on to 10³⁹."""
    found = equilibria(model("abs_brake"), inputs={"u": 0.0}, seconds=0.2)
    assert all(abs(value) < 1e16 for point in found for value in point.states.values())


def test_a_box_that_begins_where_a_root_does_is_searched_whole():
    tanks = plant(
        {
            "a": {"equation": "u - 0.1*sqrt(a)", "range": [0, 5]},
            "b": {"equation": "0.1*sqrt(a) - 0.05*sqrt(b)", "range": [0, 5]},
        }
    )
    found = equilibria(tanks, inputs={"u": 0.05})
    assert found.complete.holds
    assert [(p["a"], p["b"]) for p in found] == [(0.25, 1.0)]


def test_a_line_of_equilibria_is_one_point_and_says_so():
    found = equilibria(plant({"x": "v*cos(th)", "v": "-v", "th": "v*tan(th)"}, inputs={}))
    assert found.line
    assert len(found) == 1
    assert found.complete.status is Status.UNDECIDED
    assert not equilibria(plant(LORENZ, inputs={})).line


def test_a_jump_beside_a_rest_point_hinders_nothing():
    motor = plant({"w": "10*i - 2*w - 30*sign(w)", "i": "200*u - 200*i - 20*w"}, point={"w": 10})
    assert [round(p["i"], 9) for p in equilibria(motor, inputs={"u": 6})] == [5.0]


def test_inputs_left_out_stay_at_zero_where_the_plant_then_rests_in_decimals_only():
    reactor = plant(
        {"x": "-x + Da*(1 - x)*exp(T/(1 + T/20))", "T": "-T + 8*Da*(1 - x)*exp(T/(1 + T/20)) + 0.3*(u - T)"},
        parameters={"Da": 0.072},
    )
    here = equilibrium(reactor)
    assert here["u"] == 0
    assert here["T"] == pytest.approx(0.885965022)
