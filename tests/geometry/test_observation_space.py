"""Observability by some input, accessibility by brackets of the inputs: known answers, and what must be refused."""

from __future__ import annotations

import pytest

from ulna.base import NoFormError, Status
from ulna.design import controller_form
from ulna.geometry import accessible, observability, observation_space
from ulna.plants import model
from ulna.system import system_from_mapping

ROBOT = {"x": "v*cos(th)", "y": "v*sin(th)", "th": "om"}
CAR = {"x": "v*cos(th)", "y": "v*sin(th)", "th": "v*tan(delta)", "delta": "w"}


def plant(states, inputs, outputs):
    names = {name: {} for name in inputs}
    return system_from_mapping({"name": "plant", "states": states, "inputs": names, "outputs": outputs})


@pytest.mark.parametrize(
    ("states", "inputs", "outputs", "rank", "drift", "motion"),
    [
        (ROBOT, ["v", "om"], {"a": "x", "b": "y"}, 3, 2, "v != 0"),
        (CAR, ["v", "w"], {"a": "x", "b": "y"}, 4, 2, "v != 0"),
        ({"x": "u*y", "y": "0*x"}, ["u"], {"a": "x"}, 2, 1, "u != 0"),
        ({"x": "y", "y": "u"}, ["u"], {"a": "x"}, 2, 2, None),
        # Distance alone never shows on which side of the beacon the robot is turned: rotations are not seen.
        (ROBOT, ["v", "om"], {"r": "x**2 + y**2"}, 2, 1, None),
        ({"x": "-x + u", "y": "-y"}, ["u"], {"a": "x"}, 1, 1, None),
    ],
)
def test_ranks_with_and_without_inputs(states, inputs, outputs, rank, drift, motion):
    system = plant(states, inputs, outputs)
    found = observation_space(system)
    assert found.rank.value == rank
    assert found.at_point.value <= rank
    assert observability(system).rank.value == drift
    assert found.observable.status is (Status.PROVED if rank == len(states) else Status.REFUTED)
    assert found.observable.evidence.get("observable_while") == motion


@pytest.mark.parametrize(
    ("states", "inputs", "dimension"),
    [
        (ROBOT, ["v", "om"], 3),
        (CAR, ["v", "w"], 4),
        ({"x": "a", "y": "b", "z": "x*b - y*a"}, ["a", "b"], 3),  # Brockett's integrator
        ({"x": "-x + u", "y": "-y"}, ["u"], 1),
        ({"x": "y", "y": "u"}, ["u"], 2),
        ({"x": "a", "y": "b", "z": "x*a + y*b"}, ["a", "b"], 2),  # z - (x^2 + y^2)/2 stays
    ],
)
def test_accessibility_counts_brackets_of_inputs(states, inputs, dimension):
    verdict, found = accessible(plant(states, inputs, {}))
    assert found == dimension
    assert verdict.holds == (dimension == len(states))


def test_a_refusal_says_what_can_be_reached():
    with pytest.raises(NoFormError, match=r"rank 2 instead of 3 \(the plant is accessible all the same"):
        controller_form(model("unicycle"))
    with pytest.raises(NoFormError, match="rank 1 instead of 2, and brackets of all fields reach no more than 1"):
        controller_form(plant({"x": "-x + u", "y": "-y"}, ["u"], {}))
