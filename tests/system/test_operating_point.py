"""Operating points: exact where they can be, in decimals with a note where not."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.base import Status
from ulna.system import equilibrium, starting_point, system_from_mapping


def plant(states, *, parameters=None, point=None, inputs=("u",)):
    return system_from_mapping(
        {
            "format": 1,
            "name": "plant",
            "parameters": parameters or {},
            "states": states,
            "inputs": {u: {} for u in inputs},
            "operating_point": point or {},
        }
    )


def largest_rate(system, found):
    values = {**found.values, **dict(system.values)}
    return max(abs(sp.N(r.subs(values), 30)) for r in system.inline(system.rates))


def test_a_transcendental_rest_point_is_given_in_decimals_and_says_so():
    system = plant({"x1": "x2", "x2": "-k*x1 - cos(x1) - x2"}, parameters={"k": 2}, inputs=())
    found = equilibrium(system)
    assert found.verdict.status is Status.SUPPORTED
    assert found.verdict.evidence["digits"] == 12
    assert found.states[sp.Symbol("x2", real=True)] == 0
    assert found.parameters
    assert largest_rate(system, found) < 1e-11


def test_long_roots_of_a_cubic_are_given_in_decimals():
    system = plant({"v": "v - v**3/3 - w + u", "w": "v + a - b*w"}, parameters={"a": 0.7, "b": 0.8})
    found = equilibrium(system)
    assert all(value.is_Rational for value in found.states.values())
    assert list(found.inputs.values()) == [0]
    assert 0 < largest_rate(system, found) < 1e-11


def test_a_point_given_with_few_digits_counts_as_the_equilibrium_beside_it():
    states = {"x1": "x2", "x2": "1 - x3**2/(1 + x1)**2", "x3": "u - x3"}
    rounded = equilibrium(plant(states, point={"x1": 0.4142, "x2": 0, "x3": 1.41421}))
    assert rounded.verdict.status is Status.SUPPORTED
    assert rounded.states[sp.Symbol("x3", real=True)] == sp.Rational("1.41421")
    assert float(rounded.inputs[sp.Symbol("u", real=True)]) == pytest.approx(1.4142, abs=1e-3)


@pytest.mark.parametrize("point", [{"x1": 1, "x2": 1}, {"x1": 0.5, "x2": 0.3}])
def test_a_point_that_is_no_equilibrium_stays_where_it_was_given(point):
    found = equilibrium(plant({"x1": "x2**2 - exp(x1)", "x2": "u"}, point=point))
    assert found.verdict.fails
    assert [float(v) for v in found.states.values()] == list(point.values())


def test_a_plant_that_never_rests_is_refused():
    found = equilibrium(plant({"x1": "1 + exp(x1)", "x2": "u"}))
    assert found.verdict.fails
    assert set(found.states.values()) == {0}


def test_a_given_point_without_inputs_to_hold_it_is_no_equilibrium():
    found = equilibrium(plant({"x1": "x1*(1 - x2)", "x2": "x2*(x1 - 1) + x1"}, point={"x1": 1, "x2": 1}, inputs=()))
    assert found.verdict.fails
    assert list(found.states.values()) == [1, 1]


def test_the_verdict_tells_how_the_point_was_found():
    def method(states, **kinds):
        return equilibrium(plant(states, **kinds)).verdict.evidence.get("method")

    assert method({"x": "-x + u"}) == "as given"
    assert method({"x": "x - 3 + u"}) == "solved exactly"
    assert method({"x": "cos(x) - x + u"}, point={"u": 0}) == "Newton's method"
    assert method({"x": "1 + x**2"}, inputs=()) is None


COIL = {"d": "s", "s": "g - c*i**2/d**2", "i": "u - R*i"}
NUMBERS = {"g": "10", "c": "0.001", "R": 2}


def test_a_run_starts_at_rest_at_the_operating_point():
    ball = plant(COIL, parameters=NUMBERS, point={"d": "0.01"})
    assert starting_point(ball).numbers == {"d": 0.01, "s": 0.0, "i": pytest.approx(1.0)}


def test_a_run_starts_as_given_where_nothing_rests_there():
    falling = plant({"d": "s", "s": "10"}, point={"d": 3}, inputs=())
    assert starting_point(falling).numbers == {"d": 3.0, "s": 0.0}


def test_without_an_operating_point_a_run_starts_at_zero():
    assert starting_point(plant(COIL, parameters=NUMBERS)).numbers == {"d": 0.0, "s": 0.0, "i": 0.0}
