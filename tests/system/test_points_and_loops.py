import math

import pytest
import sympy as sp

from ulna.base import PlantError, Status
from ulna.plants import model
from ulna.system import connect, equilibria, equilibrium, linearise, system_from_mapping

LAG = {"states": {"x": "(u - x)/T"}, "inputs": {"u": {}}, "outputs": {"y": "x"}, "parameters": {"T": {"value": 2}}}


def test_the_arm_rests_horizontally_with_the_current_that_holds_it():
    arm = model("one_link_arm")
    point = equilibrium(arm)
    assert point.verdict.holds
    current = point.states[sp.Symbol("i", real=True)].subs(arm.values)
    assert current == -sp.Rational(1764, 100)


def test_an_operating_point_left_out_is_solved_for():
    system = system_from_mapping({"states": {"x": "x - 3 + u", "z": "-z + x"}, "inputs": {"u": {}}})
    point = equilibrium(system)
    assert point.verdict.holds
    assert point.inputs[sp.Symbol("u", real=True)] == 3


def test_a_plant_without_equilibrium_says_so():
    point = equilibrium(system_from_mapping({"states": {"x": "1 + x**2"}}))
    assert point.verdict.fails
    assert point.verdict.evidence["state"] == "x"


def test_all_equilibria_of_the_arm_are_found_and_proved_complete():
    found = equilibria(model("one_link_arm"), {"theta": (-6.3, 6.3)})
    assert [p["theta"] for p in found] == pytest.approx([(k + 0.5) * math.pi for k in (-2, -1, 0, 1)])
    assert found.complete.status is Status.PROVED
    assert [linearise(p).stable for p in found] == [True, False, True, False]


def test_a_double_root_is_not_counted_as_settled():
    found = equilibria(system_from_mapping({"states": {"x": "(x - 1/3)**2"}}), {"x": (-1, 1)})
    assert found.complete.status == "undecided"


def test_linearisation_is_exact():
    at = linearise(model("one_link_arm").with_values(), {sp.Symbol("theta", real=True): sp.Integer(0)})
    assert at.A == sp.Matrix([[0, 1, 0], [0, 0, sp.Rational(100, 51)], [0, -10, -10]])


def test_two_lags_in_series_keep_their_names_apart():
    whole = connect(
        {"first": system_from_mapping(LAG), "second": system_from_mapping(LAG)},
        {"first.u": "command", "second.u": "first.y"},
        outputs=["second.y"],
        name="two lags",
    )
    assert [s.name for s in whole.states] == ["first_x", "second_x"]
    assert [s.name for s in whole.inputs] == ["command"]
    first, second, command = (sp.Symbol(n, real=True) for n in ("first_x", "second_x", "command"))
    assert whole.with_values().rates == ((command - first) / 2, (first - second) / 2)


def test_an_algebraic_loop_is_refused():
    gain = system_from_mapping({**LAG, "outputs": {"y": "x + u"}})
    with pytest.raises(PlantError, match="the algebraic loop b.u → a.u → b.u has a gain of exactly 1"):
        connect({"a": gain, "b": gain}, {"a.u": "b.y", "b.u": "a.y"}, outputs=["a.y"], name="circle")


def test_a_wire_to_nowhere_is_refused():
    lag = system_from_mapping(LAG)
    with pytest.raises(PlantError, match="no output"):
        connect({"a": lag}, {"a.u": "b.y"}, outputs=["a.y"], name="open")
    with pytest.raises(PlantError, match="no such input"):
        connect({"a": lag}, {"a.v": "command"}, outputs=["a.y"], name="open")
