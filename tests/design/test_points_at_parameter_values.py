"""A point at which the plant rests only for the parameters' values is judged there, and the answers say so."""

from __future__ import annotations

from ulna.design.forms.linearisability_conditions import linearisability
from ulna.geometry import accessibility, observability, relative_degree
from ulna.plants import model
from ulna.system import equilibrium, system_from_mapping


def test_the_reactor_loses_rank_at_its_steady_state():
    reactor = model("bioreactor")
    found = accessibility(reactor)
    assert (found.rank, found.rank_at_point) == (2, 1)
    assert "parameters at their values" in found.controllable_at_point.claim
    verdict = linearisability(reactor).at_point
    assert verdict.fails
    assert verdict.evidence["generically"]
    values = {p.name: value for p, value in verdict.evidence["point"].items()}
    assert values["sf"] == 4


def test_every_pointwise_answer_uses_the_values():
    """At a = 1 the plant rests at x = 1, and there both y' and the observability vanish; for other a they do not."""
    plant = system_from_mapping(
        {
            "parameters": {"a": {"value": 1}},
            "states": {"x": "a - x", "z": "(x - a)*z + (x - a)*u"},
            "inputs": {"u": {}},
            "outputs": {"y": "z"},
            "operating_point": {"x": 1, "z": 1},
        }
    )
    assert relative_degree(plant).at_point.fails
    seen = observability(plant)
    assert seen.at_point.value == 2
    assert accessibility(plant).rank_at_point == 0


def test_a_point_that_is_at_rest_for_all_parameters_leaves_them_free():
    plant = system_from_mapping(
        {
            "parameters": {"a": {"value": 0}},
            "states": {"x": "-x + a*u"},
            "inputs": {"u": {}},
            "outputs": {"y": "x"},
            "operating_point": {"x": 0},
        }
    )
    assert equilibrium(plant).parameters == {}
    assert accessibility(plant).rank_at_point == 1
