"""Every known answer of the catalogue against the analysis, and every comparator against wrong answers."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
import sympy as sp
from answer_facts import Facts, facts
from known_answers import CHECKS, complaint

from ulna.design.analysis.analysis import analyse
from ulna.design.forms.extension import dynamic_extension
from ulna.design.forms.flatness import flat_output
from ulna.design.forms.normal_coordinates import normal_form
from ulna.plants import model, models

ANSWERS = {entry.name: entry.answers for entry in models() if entry.answers}
SLOW = {
    "acrobot", "ball_and_beam", "boost_converter", "car_with_trailer", "cart_pole", "cstr_exothermic",
    "field_controlled_dc_motor", "flexible_joint", "furuta_pendulum", "gyro_one_rate_measured",
    "hidden_chain_bernoulli", "hidden_chain_gaussian", "induction_motor", "inertia_wheel_pendulum",
    "isidori_full_linearisation", "isidori_zero_dynamics", "khalil_van_der_pol_square", "overhead_crane",
    "quadrotor_extended", "quadruple_tank", "satellite_attitude", "stepper_motor", "synchronous_generator",
    "two_link_arm", "two_mass_cubic_spring", "van_de_vusse",
}  # fmt: skip


@cache
def known_plant(name: str) -> Facts:
    return facts(model(name))


@cache
def answers_found(name: str) -> dict[str, Any]:
    """Values by key, and what has no key of its own: normal coordinates, extension of other outputs."""
    system, answers, plant = model(name), ANSWERS[name], known_plant(name)
    found = {key: answer.value for key, answer in analyse(system).answers.items()}
    if "normal_coordinates" in answers:
        found["normal_coordinates"] = list(normal_form(system).coordinates)
    if "flat_output" in answers:
        outputs = [plant.parse(e) for e in answers["flat_output"]]
        found["flat_output"] = answers["flat_output"] if flat_output(system, outputs).holds else None
    if "dynamic_extension" in answers:
        outputs = [plant.parse(e) for e in answers["dynamic_extension"]["outputs"]]
        if tuple(outputs) != plant.h:
            found["dynamic_extension"] = extension_of(name, outputs)
    return found


def extension_of(name: str, outputs: list[sp.Expr]) -> dict[str, Any]:
    found = dynamic_extension(model(name), outputs=outputs)
    assert found.system is not None
    rates = found.system.inline(found.system.rates)
    return {
        "states": [s.name for s in found.system.states],
        "inputs": [s.name for s in found.system.inputs],
        "rates": {s.name: r for s, r in zip(found.system.states, rates, strict=True)},
        "relative_degree": list(found.indices),
        "det": found.singular,
    }


CASES = [
    pytest.param(name, key, id=f"{name}-{key}", marks=[pytest.mark.slow] if name in SLOW else [])
    for name, answers in ANSWERS.items()
    for key in answers
]


@pytest.mark.parametrize(("name", "key"), CASES)
def test_the_analysis_gives_the_known_answer(name, key):
    assert complaint(key, known_plant(name), answers_found(name), ANSWERS[name]) is None


QUICK = {
    "relative_degree": "duffing",
    "linearizable_at_point": "duffing",
    "distribution_dims": "brockett_integrator",
    "minimum_phase": "critical_zero_dynamics",
    "decoupling_matrix": "heat_exchanger",
    "decoupling_det": "polar_robot",
    "linearizing_outputs": "khalil_sine_chain",
    "T": "khalil_sine_chain",
    "control": "khalil_sine_chain",
    "inverse": "khalil_sine_chain",
    "integrating_factor": "khalil_sine_chain",
    "singular_set": "khalil_sine_chain",
    "output_transform": "sir_epidemic",
    "observer_T": "sir_epidemic",
    "observer_injection": "van_der_pol",
    "zero_dynamics": "critical_zero_dynamics",
    "normal_coordinates": "khalil_normal_form",
    "dynamic_extension": "unicycle",
}
PARTS = [
    pytest.param(key, name, part, id=f"{key}-{part}" if part else key)
    for key, name in QUICK.items()
    for part in {"zero_dynamics": ("manifold", "u", "rhs"), "dynamic_extension": ("relative_degree",)}.get(key, (None,))
]


def test_every_comparator_is_tried_on_wrong_answers():
    assert set(QUICK) >= set(CHECKS)


@pytest.mark.parametrize(("key", "name", "part"), PARTS)
def test_a_comparator_accepts_the_right_and_refuses_a_wrong_finding(key, name, part):
    plant, right = known_plant(name), answers_found(name)
    assert complaint(key, plant, right, ANSWERS[name]) is None
    source = "decoupling_matrix" if key == "decoupling_det" else key
    wrong = {**right, source: spoiled(right[source], part, key, plant)}
    assert complaint(key, plant, wrong, ANSWERS[name]) is not None


@pytest.mark.parametrize(("key", "name", "part"), PARTS)
def test_a_comparator_refuses_a_wrong_known_answer(key, name, part):
    known = {**ANSWERS[name], key: spoiled(ANSWERS[name][key], part, key, known_plant(name))}
    assert complaint(key, known_plant(name), answers_found(name), known) is not None


def test_a_missing_value_is_refused():
    assert complaint("T", known_plant("duffing"), {}, ANSWERS["duffing"]) == "no value"


def spoiled(value: Any, part: str | None, key: str, plant: Facts) -> Any:
    """The value with its first entry (in that part of it) made wrong."""
    if part:
        return {**value, part: spoiled(value[part], None, key, plant)}
    if isinstance(value, dict):
        first = next(iter(value))
        return {**value, first: spoiled(value[first], None, key, plant)}
    if isinstance(value, list):
        return [spoiled(value[0], None, key, plant), *value[1:]]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if key == "minimum_phase":
        return "unstable"
    addend = {"inverse": "z1**2 + 1/3", "observer_injection": "y**2 + 1/3", "zero_dynamics": "1/3"}.get(key)
    if addend is None:
        first, last = plant.states[0].name, plant.states[-1].name
        addend = f"{last}**3 + {first}*{last} + {first}**2 + 1/3"
    return value + plant.parse(addend) if isinstance(value, sp.Expr) else f"({value}) + {addend}"
