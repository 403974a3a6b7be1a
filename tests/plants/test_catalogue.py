"""The catalogue: every plant loads, says where it comes from and what it shows."""

from __future__ import annotations

import tomllib
from importlib.resources import files

import pytest

from ulna.base import PlantError
from ulna.plants import model, models
from ulna.system import equilibrium, system_from_mapping, system_to_mapping

TEXTBOOK = sorted(p.name.removesuffix(".toml") for p in (files("ulna.plants") / "textbook").iterdir())
ANALYSIS_KEYS = {
    "relative_degree", "relative_degree_at_point", "decoupling_matrix", "singular_set", "controllability_rank",
    "controllability_rank_at_point", "distribution_dims", "involutive", "full_state_linearizable",
    "linearizable_at_point", "state_linearizable", "linearizing_outputs", "T", "inverse", "control", "q_closed",
    "integrating_factor", "accessibility_rank", "observability_rank_without_inputs", "observability_rank",
    "observability_rank_at_point", "observer_form", "observer_T",
    "observer_injection", "observer_form_output_transform", "output_transform", "zero_dynamics", "minimum_phase",
    "dynamic_extension",
}  # fmt: skip
FURTHER_KEYS = {"decoupling_det", "normal_coordinates", "flat_output"}
WITH_UNITS = ("boost_converter", "cart_pole", "magnetic_levitation", "mass_spring_damper")


@pytest.mark.parametrize("name", TEXTBOOK)
def test_a_textbook_plant_loads_and_is_read_back_the_same(name):
    system = model(name)
    assert system.source
    assert system_from_mapping(system_to_mapping(system)) == system


@pytest.mark.parametrize("entry", models(), ids=lambda entry: entry.name)
def test_every_plant_has_a_text_and_a_source(entry):
    assert entry.text
    assert entry.source


def test_textbook_plants_say_what_they_teach_in_a_line():
    lines = {entry.name: entry.teaches for entry in models() if entry.name in TEXTBOOK}
    assert not [name for name, line in lines.items() if not line.endswith(".") or "\n" in line or len(line) > 160]


def test_at_least_forty_plants_come_with_answers_under_known_keys():
    rows = {entry.name: entry.answers for entry in models() if entry.answers}
    assert len(rows) >= 40
    assert {key for answers in rows.values() for key in answers} <= ANALYSIS_KEYS | FURTHER_KEYS


def test_every_analysis_key_has_a_plant_that_knows_its_answer():
    assert {key for entry in models() for key in entry.answers} >= ANALYSIS_KEYS


@pytest.mark.parametrize("name", WITH_UNITS)
def test_physical_plants_have_units_on_every_signal(name):
    system = model(name)
    assert all(signal.unit for signal in (*system.states, *system.inputs, *system.outputs) if signal.name != "u")
    assert all(p.unit for p in system.parameters)


@pytest.mark.parametrize("name", ["van_de_vusse", "boost_converter", "magnetic_levitation", "quadruple_tank"])
def test_a_point_given_in_numbers_is_an_equilibrium_at_the_parameters_values(name):
    assert equilibrium(model(name)).verdict.holds


def test_a_misspelt_name_is_answered_with_near_ones():
    with pytest.raises(PlantError, match="boost_converter"):
        model("bost_converter")


def test_the_documented_table_lists_every_plant():
    import pathlib

    text = (pathlib.Path(__file__).parents[2] / "docs" / "catalogue.md").read_text(encoding="utf-8")
    missing = [entry.name for entry in models() if f"`{entry.name}`" not in text]
    assert not missing


def test_files_hold_no_unread_sections():
    for name in TEXTBOOK:
        data = tomllib.loads((files("ulna.plants") / "textbook" / f"{name}.toml").read_text(encoding="utf-8"))
        assert set(data["catalogue"]) == {"teaches", "answers"}, name
