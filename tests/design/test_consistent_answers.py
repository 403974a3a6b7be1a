"""Made-up contradictions between answers are never handed on: the proved side stays, else nothing does."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp

from ulna.base import Status, Verdict
from ulna.design import analyse
from ulna.design.analysis.answer import Answer
from ulna.design.analysis.consistency import consistent
from ulna.plants import model
from ulna.report.results import plain
from ulna.symbolic.formulas import excerpt, formula, is_longer
from ulna.system import system_from_mapping

PLANT = system_from_mapping({"states": {"a": "b", "b": "c", "c": "u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}})


def said(status: str, value: Any, **evidence: Any) -> Answer:
    return Answer(verdict=Verdict(claim="made up", status=Status(status), evidence=evidence), value=value)


def held(**answers: Answer) -> dict[str, Answer]:
    return consistent(PLANT, answers)


@pytest.mark.parametrize("key", ["controllability_rank", "observability_rank"])
def test_a_rank_at_the_point_never_exceeds_the_generic_one(key: str) -> None:
    found = held(**{key: said("supported", 2), f"{key}_at_point": said("proved", 3)})
    assert found[key].value is None
    assert found[key].verdict.status is Status.UNDECIDED
    assert "exceeds" in found[key].verdict.evidence["contradiction"]
    assert found[f"{key}_at_point"].value == 3
    both = held(**{key: said("supported", 2), f"{key}_at_point": said("supported", 3)})
    assert both[key].value is both[f"{key}_at_point"].value is None


@pytest.mark.parametrize(
    ("key", "wrong", "right"),
    [
        ("controllability_rank", 2, 3),
        ("observability_rank", 2, 3),
        ("full_state_linearizable", False, True),
        ("involutive", False, True),
    ],
)
def test_degrees_that_add_up_prove_ranks_and_linearisability(key: str, wrong: Any, right: Any) -> None:
    degrees = {"relative_degree": said("proved", [3])}
    open_before = held(**degrees, **{key: said("undecided", None)})
    assert open_before[key].value == right
    assert open_before[key].verdict.status is Status.PROVED
    assert held(**degrees, **{key: said("supported", wrong)})[key].value == right
    both_sure = held(**degrees, **{key: said("refuted" if wrong is False else "proved", wrong)})
    assert both_sure[key].value is None
    assert both_sure[key].verdict.status is Status.UNDECIDED


def test_supported_degrees_do_not_overrule_a_proof() -> None:
    found = held(relative_degree=said("supported", [3]), controllability_rank=said("proved", 2))
    assert found["controllability_rank"].value is None


def test_degrees_that_hold_at_the_point_linearise_there() -> None:
    found = held(
        relative_degree=said("proved", [3]),
        relative_degree_at_point=said("proved", True),
        linearizable_at_point=said("undecided", None),
        controllability_rank_at_point=said("supported", 2),
    )
    assert found["linearizable_at_point"].value is True
    assert found["controllability_rank_at_point"].value == 3


def test_a_law_without_internal_dynamics_linearises_the_whole_state() -> None:
    found = held(control=said("supported", None, internal_dimension=0), full_state_linearizable=said("undecided", None))
    assert found["full_state_linearizable"].value is True
    some = held(control=said("supported", None, internal_dimension=1), full_state_linearizable=said("undecided", None))
    assert some["full_state_linearizable"].value is None


def test_a_proved_relative_degree_has_a_regular_decoupling_matrix() -> None:
    found = held(relative_degree=said("proved", [2]), decoupling_matrix=said("refuted", [[0]]))
    assert found["relative_degree"].value is found["decoupling_matrix"].value is None
    found = held(relative_degree=said("supported", [2]), decoupling_matrix=said("refuted", [[0]]))
    assert found["relative_degree"].value is None
    assert found["decoupling_matrix"].value == [[0]]


def test_zero_dynamics_are_a_point_where_degrees_add_up() -> None:
    moving = said("supported", {"coords": {"c": "c"}})
    found = held(relative_degree=said("proved", [3]), zero_dynamics=moving, minimum_phase=said("supported", "stable"))
    assert found["zero_dynamics"].value is found["minimum_phase"].value is None
    point = said("proved", {"coords": {}})
    kept = held(relative_degree=said("proved", [3]), zero_dynamics=point, minimum_phase=said("proved", "exponential"))
    assert kept["zero_dynamics"] == point


def test_linearisable_implies_rank_and_involutivity() -> None:
    found = held(full_state_linearizable=said("proved", True), involutive=said("undecided", None))
    assert found["involutive"].verdict.status is Status.PROVED
    found = held(linearizable_at_point=said("proved", True), full_state_linearizable=said("supported", False))
    assert found["full_state_linearizable"].value is True


def test_what_is_undecided_has_no_value() -> None:
    assert held(observability_rank=said("undecided", 3))["observability_rank"].value is None


def test_several_outputs_need_a_regular_matrix() -> None:
    degrees = said("proved", [1, 2])
    singular = held(
        relative_degree=degrees, decoupling_matrix=said("refuted", None), involutive=said("undecided", None)
    )
    assert singular["involutive"].value is None
    regular = held(relative_degree=degrees, decoupling_matrix=said("proved", []), involutive=said("undecided", None))
    assert regular["involutive"].value is True


def test_answers_that_agree_pass_unchanged() -> None:
    answers = {
        "relative_degree": said("proved", [3]),
        "decoupling_matrix": said("proved", [[1]]),
        "controllability_rank": said("proved", 3),
        "controllability_rank_at_point": said("proved", 3),
        "full_state_linearizable": said("proved", True),
    }
    assert consistent(model("one_link_arm"), answers) == answers


def test_a_transformation_is_defined_at_the_point_it_is_proved_for() -> None:
    rates = {"x1": "x1*x2 + (x1 + x2)*u", "x2": "x1 + (x2 - x1)*u"}
    for place in ({"x1": 1, "x2": 0}, {"x1": 2, "x2": 1}):
        plant = system_from_mapping({"states": rates, "inputs": {"u": {}}, "operating_point": place})
        found = analyse(plant, questions=("linearizable_at_point", "T"))
        here = plant.operating_point
        assert found["linearizable_at_point"].value is True
        assert found["T"].verdict.status is Status.PROVED
        for entry in found["T"].value:
            value = entry.subs({sp.Symbol(name, real=True): number for name, number in here})
            assert value.is_real
            assert value.is_finite


def test_a_formula_without_value_at_a_regular_point_is_not_shown() -> None:
    a, b, c = PLANT.state_symbols
    where = {a: sp.Integer(1), b: sp.Integer(0), c: sp.Integer(0)}
    for entry in (sp.log(b), sp.atan(a / b), sp.sqrt(c - 1)):
        answers = {"T": said("proved", [entry]), "linearizable_at_point": said("proved", True)}
        assert consistent(PLANT, answers, where)["T"].value is None
        answers["T"] = said("proved", [entry.subs({b: a, c: a})])
        assert consistent(PLANT, answers, where)["T"] == answers["T"]


@pytest.mark.parametrize("term", ["cos(a)/a", "sin(a)/a**2", "b**2/(a*b)", "sqrt(a - 1)", "log(a)", "asin(2 + a)"])
def test_nothing_is_said_about_a_point_where_the_plant_has_no_value(term: str) -> None:
    plant = system_from_mapping(
        {
            "states": {"a": "b", "b": f"{term} + u"},
            "inputs": {"u": {}},
            "outputs": {"y": "a"},
            "operating_point": {"a": 0},
        }
    )
    # Some questions have no answer in any time; the point is what is asked for.
    found = analyse(plant, seconds=2, groups=3)
    assert not found.point.verdict.holds
    for key, answer in found.items():
        if key.endswith("at_point"):
            assert answer.value is None, key
            assert answer.verdict.status is Status.UNDECIDED
    value = found["zero_dynamics"].value
    assert value is None or not any(e.has(sp.I) for e in (*value["manifold"].values(), *value["u"]))


def test_long_answers_are_not_printed_to_be_cut() -> None:
    x = PLANT.state_symbols[0]
    long = sp.Add(*(sp.sin(k * x) ** k for k in range(1, 5500)), evaluate=False)
    assert excerpt(long, 2000) == "an expression of more than 2000 parts"
    assert excerpt(x + 1, 2000) == formula(x + 1)
    assert is_longer([x, {"y": long}["y"]], 2000)
    assert "more than" in plain({"field": sp.Matrix([long])})["field"][0][0]
