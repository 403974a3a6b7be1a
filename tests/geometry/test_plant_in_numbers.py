"""Balls answer at every size: mass matrices, points that are no decimals, degrees by the graph of the plant."""

from __future__ import annotations

from ulna.base import Status
from ulna.geometry import structure_in_numbers
from ulna.geometry.plant_in_numbers import shortest_chains
from ulna.system import system_from_mapping

DOUBLE = {
    "states": {"x": "p", "q": "v", "r": "w", "p": "a", "v": "b", "w": "c"},
    "inputs": {"F": {}},
    "outputs": {"y": "x"},
    "definitions": {
        "a": {"zero": "4*a + 2*cos(q)*b + cos(r)*c - 2*sin(q)*v**2 - sin(r)*w**2 - F"},
        "b": {"zero": "2*cos(q)*a + 2*b + cos(q - r)*c + sin(q - r)*w**2 - 20*sin(q)"},
        "c": {"zero": "cos(r)*a + cos(q - r)*b + c - sin(q - r)*v**2 - 10*sin(r)"},
    },
}
"""A cart with a double pendulum; springless, all masses 1 or 2, all lengths 1."""


def test_a_cart_with_a_double_pendulum_is_accessible_but_not_linearisable() -> None:
    found = structure_in_numbers(system_from_mapping(DOUBLE))
    assert found is not None
    assert found.dimensions == (1, 2, 3, 4, 5, 6)
    assert found.rank.verdict.status is Status.PROVED
    assert found.rank_at_point.value == 6
    assert found.involutive.fails
    assert found.commuting.fails
    assert found.degrees == (2,)
    assert found.degrees_known.status is Status.PROVED


def test_degrees_above_what_the_graph_shows_are_supported_only() -> None:
    hidden = "b + (cos(a)**2 + sin(a)**2 - 1)*u"
    plant = system_from_mapping({"states": {"a": hidden, "b": "u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}})
    found = structure_in_numbers(plant)
    assert found is not None
    assert shortest_chains(plant) == (1,)
    assert found.degrees == (2,)
    assert found.degrees_known.status is Status.SUPPORTED
    idle = system_from_mapping(
        {"states": {"a": "-a", "b": "u"}, "inputs": {"u": {}}, "outputs": {"y": "a", "z": "b", "w": "d"}}
        | {"definitions": {"d": "e + 1", "e": "a*b"}}
    )
    assert shortest_chains(idle) == (None, 1, 1)


def test_a_singular_point_at_half_a_turn_is_never_called_regular() -> None:
    """π/2 is no decimal: at 1.5707963267948966 the rank would be 2."""
    plant = {"states": {"a": "sin(b)", "b": "u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}}
    here = structure_in_numbers(system_from_mapping(plant | {"operating_point": {"a": 0, "b": "pi/2"}}))
    near = structure_in_numbers(system_from_mapping(plant | {"operating_point": {"a": 0, "b": "1.5707963"}}))
    assert here is not None
    assert near is not None
    assert here.rank_at_point.value in (1, None)
    assert here.dimensions_at_point[1] in (1, None)
    assert near.rank_at_point.value == 2
    assert near.dimensions_at_point == (1, 2)
    assert here.rank.value == 2


def test_parameters_without_a_value_stand_at_arbitrary_numbers() -> None:
    plant = {"states": {"a": "k*b", "b": "u - m*sin(a)"}, "parameters": {"k": {}, "m": {}}, "inputs": {"u": {}}}
    found = structure_in_numbers(system_from_mapping(plant | {"outputs": {"y": "a"}}))
    assert found is not None
    assert found.rank.value == 2
    assert not found.commuting.fails
