"""Whatever holds a system may stand for it, in every verb of `system`; anything else is refused in three parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from ulna.base import PlantError
from ulna.plants import as_plant, model
from ulna.system import (
    System,
    as_system,
    connect,
    control_affine,
    linearise,
    read_system,
    system_from_mapping,
    system_to_mapping,
    write_system,
)

LAG = system_from_mapping({"name": "lag", "states": {"x": "u - x"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})


@dataclass(frozen=True)
class Holder:
    system: Any


@pytest.mark.parametrize(
    "verb",
    [
        as_system,
        control_affine,
        lambda given: linearise(given, {}),
        lambda given: connect({"a": given}, {"a.u": "w"}, outputs=["a.y"], name="whole"),
        system_to_mapping,
        as_plant,
    ],
)
def test_a_holder_stands_for_its_system(verb: Any) -> None:
    assert verb(Holder(LAG)) == verb(LAG)


def test_a_holder_is_written_as_its_system(tmp_path: Any) -> None:
    write_system(Holder(LAG), tmp_path / "lag.toml")
    assert read_system(tmp_path / "lag.toml") == LAG


@pytest.mark.parametrize("given", [5, "lag", None, Holder("lag"), Holder(Holder(LAG))])
def test_what_holds_no_system_is_refused_with_what_to_try(given: Any) -> None:
    with pytest.raises(PlantError, match=r"not a System and has no `system`\. Read a plant file"):
        as_system(given)


def test_a_plant_is_meant_by_name_by_file_or_by_itself(tmp_path: Any) -> None:
    write_system(LAG, tmp_path / "lag.toml")
    assert as_plant("one-link-arm") == model("one_link_arm")
    assert as_plant(tmp_path / "lag.toml") == as_plant(str(tmp_path / "lag.toml")) == LAG
    assert isinstance(as_plant(LAG), System)
    with pytest.raises(PlantError, match="Did you mean one_link_arm"):
        as_plant("one_link_arms")
    with pytest.raises(PlantError, match="it cannot be read"):
        as_plant("nowhere.toml")
