"""Plants that lack inputs or outputs."""

from __future__ import annotations

from ulna.design.analysis.numeric_answers import answers_in_numbers
from ulna.system import system_from_mapping

KEYS = ("observability_rank", "relative_degree")


def test_a_plant_without_inputs_is_answered_in_numbers_too() -> None:
    system = system_from_mapping(
        {"format": 1, "name": "free", "states": {"x1": "x2", "x2": "-x1"}, "outputs": {"y": "x1**3 + x1"}}
    )
    found = answers_in_numbers(system, KEYS)
    assert found["observability_rank"].value == 2
    assert found["relative_degree"].value is None
