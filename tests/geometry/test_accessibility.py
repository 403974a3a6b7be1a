"""Controllability matrix, dimensions of the G_i, Brunovský indices."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import sympy as sp

import ulna
from ulna.base import NoFormError, Status, UlnaError
from ulna.design.forms.full_linearisation import controller_form
from ulna.design.forms.linearisability_conditions import linearisability
from ulna.geometry import accessibility, lie_bracket, relative_degree
from ulna.system import System, read_system, system_from_mapping

x1, x2, x3 = sp.symbols("x1:4", real=True)


def plant(states: dict[str, str], inputs: str = "u", point: dict[str, object] | None = None, **more: object) -> System:
    names = inputs.split()
    return system_from_mapping(
        {
            "states": {name: {"equation": text} for name, text in states.items()},
            "inputs": {name: {} for name in names},
            "operating_point": point or dict.fromkeys(states, 0),
            "name": "plant",
            **more,
        }
    )


def one_link_arm() -> System:
    # Żak's numbers with the paper's corrected gain, eq. 25.
    return plant({"x1": "x2", "x2": "(98/10)*cos(x1) + (196/100)*x3", "x3": "-10*x2 - 10*x3 + 10*u"})


def test_the_paper_s_controllability_matrix_has_its_entries() -> None:
    found = accessibility(one_link_arm())
    matrix = found.matrix
    assert matrix.shape == (3, 3)
    assert list(matrix[:, 0]) == [0, 0, 10]
    assert list(matrix[:, 1]) == [0, sp.Rational(98, 5), -100]
    assert matrix[0, 2] == sp.Rational(98, 5)
    assert matrix[1, 2] == -196
    assert found.rank == found.rank_at_point == 3
    assert found.dimensions == (1, 2, 3)
    assert found.indices == (3,)
    assert found.controllable.holds
    assert found.controllable_at_point.holds


def test_the_columns_are_the_iterated_brackets() -> None:
    found = accessibility(plant({"x1": "sin(x2)", "x2": "x3 + x1**2", "x3": "x1*x3 + exp(x2)*u"}))
    view = found.view
    for before, after in zip(found.levels, found.levels[1:], strict=False):
        difference = lie_bracket(view.f, before[0], view.x) - after[0]
        assert difference.applyfunc(sp.simplify) == sp.zeros(3, 1)


def test_the_singular_expression_is_the_determinant() -> None:
    found = accessibility(plant({"x1": "x2**2", "x2": "u"}))
    assert found.singular is not None
    assert sp.expand(found.singular - found.matrix.det()) == 0


def test_generic_rank_and_rank_at_the_point_are_told_apart() -> None:
    found = accessibility(plant({"x1": "x2**2", "x2": "u"}))
    assert (found.rank, found.rank_at_point) == (2, 1)
    assert found.controllable.holds
    assert found.controllable_at_point.fails
    away = accessibility(plant({"x1": "x2**2", "x2": "u"}, point={"x1": 0, "x2": 1}))
    assert away.rank_at_point == 2


def test_a_plant_with_an_unreachable_state_is_not_controllable() -> None:
    found = accessibility(plant({"x1": "-x1", "x2": "-2*x2 + u", "x3": "x2"}))
    assert found.rank == 2
    assert found.dimensions == (1, 2, 2)
    assert found.indices == (2,)
    assert found.controllable.fails
    assert found.controllable.evidence["rank"] == 2


def test_two_chains_of_different_length_have_their_indices() -> None:
    found = accessibility(plant({"x1": "x2", "x2": "x3", "x3": "u1", "x4": "u2"}, inputs="u1 u2"))
    assert found.dimensions == (2, 3, 4, 4)
    assert found.indices == (3, 1)


def test_a_plant_without_inputs_reaches_nothing() -> None:
    found = accessibility(plant({"x1": "x2", "x2": "-x1"}, inputs=""))
    assert found.dimensions == (0, 0)
    assert found.controllable.fails
    assert found.matrix.shape == (2, 0)


def test_a_point_where_the_fields_are_infinite_is_undecided() -> None:
    found = accessibility(plant({"x1": "x2/x1", "x2": "u"}))
    assert found.controllable.holds
    assert not found.controllable_at_point.holds
    assert not found.controllable_at_point.fails


def test_symbolic_parameters_stay_generic() -> None:
    found = accessibility(plant({"x1": "a*x2", "x2": "u"}, parameters={"a": {}}))
    assert found.rank == found.rank_at_point == 2
    assert found.singular is not None
    assert found.singular.free_symbols == {sp.Symbol("a", real=True)}


def test_dry_friction_is_named_instead_of_differentiated() -> None:
    with pytest.raises(UlnaError, match=r"sign\(x2\).*not smooth"):
        accessibility(plant({"x1": "x2", "x2": "-sign(x2) + u"}))


def test_the_one_link_arm_with_symbols_has_full_rank() -> None:
    found = accessibility(read_system(Path(ulna.__file__).parent / "plants" / "data" / "one_link_arm.toml"))
    assert found.rank == 3


def endless(*_arguments: object) -> None:
    """Works forever: only a budget ends it, however fast or busy the machine is."""
    while True:
        pass


def test_brackets_that_take_too_long_leave_the_question_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Out of time is undecided everywhere: never a "not controllable" that nobody proved."""
    module = sys.modules["ulna.geometry.brackets"]
    monkeypatch.setattr(module, "_SECONDS_FOR_BRACKETS", 0.01)
    monkeypatch.setattr(module, "lie_bracket", endless)
    monkeypatch.setattr(module, "structure_in_numbers", lambda _: None)
    slow = plant({"x1": "x2*exp(x1)", "x2": "sin(x3)*x1", "x3": "u"}, name="too slow")
    found = accessibility(slow)
    assert found.cut_short
    judged = linearisability(slow)
    for verdict in (found.controllable, judged.verdict, judged.involutive, judged.at_point):
        assert verdict.status is Status.UNDECIDED
    with pytest.raises(NoFormError, match="no controller form was found"):
        controller_form(slow)


@pytest.mark.parametrize("last", ["u", "u + x2"])
def test_numbers_answer_where_brackets_take_too_long(monkeypatch: pytest.MonkeyPatch, last: str) -> None:
    module = sys.modules["ulna.geometry.brackets"]
    monkeypatch.setattr(module, "_SECONDS_WHERE_NUMBERS_KNOW", 0.01)
    monkeypatch.setattr(module, "lie_bracket", endless)
    slow = plant({"x1": "x2*exp(x1)", "x2": "sin(x3) + x1", "x3": last}, name=f"too slow {last}")
    found, judged = accessibility(slow), linearisability(slow)
    assert found.cut_short
    assert (found.rank, found.dimensions, found.indices) == (3, (1, 2, 3), (3,))
    assert found.controllable.status is Status.PROVED
    assert judged.involutive.status is Status.SUPPORTED
    assert judged.verdict.holds


def test_numbers_refute_where_brackets_take_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    module = sys.modules["ulna.geometry.brackets"]
    monkeypatch.setattr(module, "_SECONDS_WHERE_NUMBERS_KNOW", 0.01)
    monkeypatch.setattr(module, "lie_bracket", endless)
    pole = plant({"p": "q", "q": "u", "t": "w", "w": "sin(t) - u*cos(t)"}, name="slow cart and pole")
    judged = linearisability(pole)
    assert judged.accessibility.rank == 4
    assert judged.involutive.fails
    assert judged.verdict.fails
    with pytest.raises(NoFormError, match="no controller form") as caught:
        controller_form(pole)
    assert "None" not in str(caught.value)


def test_derivatives_that_take_too_long_leave_the_relative_degree_open(monkeypatch: pytest.MonkeyPatch) -> None:
    module = sys.modules["ulna.geometry.decoupling"]
    monkeypatch.setattr(module, "_SECONDS", 0.01)
    monkeypatch.setattr(module, "lie_derivative", endless)
    found = relative_degree(plant({"x1": "x2", "x2": "u"}, name="too slow", outputs={"y": {"equation": "x1"}}))
    assert found.per_output == (None,)
    assert found.certainty.status is Status.UNDECIDED
    assert found.invertible.status is Status.UNDECIDED
    assert found.at_point.status is Status.UNDECIDED
