"""`[picture]`: read, checked, written back; and it changes nothing of what the plant does."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ulna.base import PlantError
from ulna.loop import Loop, fingerprint
from ulna.plants import model, models
from ulna.system import system_from_mapping, system_to_mapping

PLANT = {"name": "p", "parameters": {"m": 2}, "states": {"a": "b", "b": "-m*a"}}


def _with(**picture):
    return system_from_mapping({**PLANT, "picture": picture})


def test_a_picture_is_read_and_written_back():
    plant = _with(kind="arm", angle="a", load="m", zero="up", length=0.5)
    assert system_from_mapping(system_to_mapping(plant)) == plant


def test_numbers_in_place_of_parameters_go_into_the_picture():
    plant = _with(kind="arm", angle="a", load="m").with_values()
    assert plant.picture is not None
    assert dict(plant.picture.parts)["load"] == 2.0
    assert system_from_mapping(system_to_mapping(plant)).picture == plant.picture


@pytest.mark.parametrize(
    ("picture", "found"),
    [
        ({"kind": "horse"}, "'horse' is unknown"),
        ({"angle": "a"}, "None is unknown"),
        ({"kind": "arm"}, "arm needs angle"),
        ({"kind": "arm", "angle": "c"}, "no state 'c'"),
        ({"kind": "arm", "angle": "a", "load": "b"}, "no parameter 'b'"),
        ({"kind": "arm", "angle": "a", "length": -1}, "not a positive number"),
        ({"kind": "arm", "angle": "a", "zero": "north"}, "none of right, up"),
        ({"kind": "arm", "angle": "a", "wings": "b"}, "no part 'wings'"),
        ({"kind": "tanks", "levels": "a"}, "expected a list of states"),
        ({"kind": "tanks", "levels": ["a", "h"]}, "no state 'h'"),
        ({"kind": "vehicle", "x": "a", "y": "b"}, "vehicle needs heading"),
    ],
)
def test_what_does_not_fit_is_named(picture, found):
    with pytest.raises(PlantError, match=found):
        _with(**picture)


def test_a_picture_decides_nothing():
    plant = _with(kind="pendulum", angle="a")
    assert fingerprint(Loop(plant=plant)) == fingerprint(Loop(plant=replace(plant, picture=None)))


def test_pictures_of_the_catalogue_survive_writing():
    drawn = [plant for entry in models() if (plant := model(entry.name)).picture is not None]
    assert len(drawn) >= 20
    for plant in drawn:
        assert system_from_mapping(system_to_mapping(plant)).picture == plant.picture
