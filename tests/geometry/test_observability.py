"""Observability matrices, indices and ranks; decompositions by their block structure."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.base import Status, UlnaError
from ulna.geometry import accessible_decomposition, observability, observable_decomposition, observation_space
from ulna.geometry.decomposition import accessible_structure, observable_structure
from ulna.symbolic.exact import is_zero
from ulna.system import System, control_affine, system_from_mapping


def plant(states: dict[str, str], outputs: dict[str, str], inputs: str = "", **more: object) -> System:
    return system_from_mapping(
        {"name": "plant", "states": states, "outputs": outputs, "inputs": {u: {} for u in inputs.split()}} | more
    )


ARM = plant({"x1": "x2", "x2": "49/5*sin(x1) + x3", "x3": "-10*x2 - 10*x3 + 10*u"}, {"y": "x1"}, "u")
GYRO = plant(
    {"x1": "p1*x2*x3", "x2": "p2*x1*x3", "x3": "p3*x1*x2"},
    {"y": "x1"},
    parameters={"p1": {}, "p2": {}, "p3": {}},
    operating_point={"x1": 0, "x2": 0, "x3": 0},
)


def test_a_linear_plant_gives_kalmans_matrix() -> None:
    A = sp.Matrix([[1, 2, 0], [0, 3, 1], [4, 0, 1]])
    C = sp.Matrix([[1, 0, 2]])
    x = sp.symbols("x1:4", real=True)
    rates = A * sp.Matrix(x)
    linear = plant({f"x{k + 1}": str(rates[k]) for k in range(3)}, {"y": "x1 + 2*x3"})
    assert observability(linear).matrix == sp.Matrix.vstack(C, C * A, C * A**2)


def test_the_arm_is_observable_everywhere() -> None:
    seen = observability(ARM)
    assert seen.rank.value == seen.at_point.value == 3
    assert seen.determinant == 1
    assert seen.observable.status is Status.PROVED


def test_rank_of_the_gyro_drops_at_rest_and_its_determinant_says_where() -> None:
    seen = observability(GYRO)
    assert (seen.rank.value, seen.at_point.value) == (3, 1)
    x1, x2, x3, p1, p2, p3 = sp.symbols("x1 x2 x3 p1 p2 p3", real=True)
    assert seen.determinant is not None
    assert is_zero(seen.determinant + 2 * x1 * p1**2 * (x2**2 * p3 - x3**2 * p2)).holds
    assert seen.observable.holds
    assert seen.observable_at_point.fails


def test_a_plant_without_output_is_refuted_and_says_so() -> None:
    seen = observability(plant({"x1": "-x1 + u"}, {}, "u"))
    assert seen.observable.fails
    assert seen.rank.value == 0
    assert "no output" in seen.observable.evidence["reason"]


def test_a_hidden_state_is_found() -> None:
    seen = observability(plant({"x1": "-x1", "x2": "-2*x2 + u", "x3": "-3*x3"}, {"y": "x1 + x3"}, "u"))
    assert seen.rank.value == 2
    assert seen.observable.fails


def test_inputs_can_make_observable_what_the_drift_hides() -> None:
    bilinear = plant({"x1": "-x1 + u*x2", "x2": "-x2"}, {"y": "x1"}, "u")
    assert observability(bilinear).rank.value == 1
    assert observation_space(bilinear).rank.value == 2
    assert observation_space(bilinear).observable.holds


def test_indices_of_two_outputs_add_up() -> None:
    two = plant(
        {"x1": "x2", "x2": "-x1*x3", "x3": "x1 - x3 + u"},
        {"y1": "x1", "y2": "x3"},
        "u",
    )
    seen = observability(two)
    assert seen.indices == (2, 1)
    assert seen.rank.value == 3


def test_terms_without_derivatives_are_refused() -> None:
    with pytest.raises(UlnaError, match="not smooth"):
        observability(plant({"x1": "-abs(x1)"}, {"y": "x1"}))


HALVES = plant({"x1": "x2*x3", "x2": "-x2 + u", "x3": "-x3*(1 + x3**2)", "x4": "x1*x4 + u"}, {"y": "x2*exp(x3)"}, "u")


def test_the_part_that_inputs_do_not_move_is_split_off() -> None:
    found = accessible_decomposition(HALVES)
    assert found.dimension == 3
    assert found.map is not None
    assert found.verdict.holds
    split = found.map.forward[3]
    assert is_zero(sp.Matrix([split]).jacobian(list(found.view.x))[:, :2].norm()).holds


def test_the_part_that_outputs_do_not_see_is_split_off() -> None:
    found = observable_decomposition(HALVES)
    assert found.dimension == 2
    assert found.map is not None
    assert found.verdict.holds
    assert found.map.forward.jacobian(list(found.view.x))[:2, [0, 3]].is_zero_matrix


def test_a_curved_unobservable_direction_is_found() -> None:
    circle = plant({"x1": "-x2*(1 + x3)", "x2": "x1*(1 + x3)", "x3": "x1**2 + x2**2 - x3"}, {"y": "x3"})
    found = observable_decomposition(circle)
    assert found.dimension == 2
    assert found.verdict.holds


def test_wrong_splits_are_refused() -> None:
    view = control_affine(HALVES)
    x1, x2, x3, x4 = view.x
    assert accessible_structure(view, [x3]).holds
    assert accessible_structure(view, [x1]).fails
    assert accessible_structure(view, [x3 + x2]).fails
    assert observable_structure(view, [x2, x3]).holds
    assert observable_structure(view, [x2]).fails
    assert observable_structure(view, [x2, x4]).fails


def test_a_complete_plant_has_nothing_to_split_off() -> None:
    assert accessible_decomposition(ARM).complete
    assert observable_decomposition(ARM).complete


def test_rows_that_do_not_count_elsewhere_count_where_others_vanish() -> None:
    seen = observability(plant({"x1": "x3**2", "x2": "x3", "x3": "-x1"}, {"y1": "x1", "y2": "x2"}))
    assert (seen.indices, seen.rank.value) == ((2, 1), 3)
    assert seen.at_point.value == 3
    assert seen.observable_at_point.holds


def test_a_rank_that_drops_with_two_outputs_is_proved_with_all_rows() -> None:
    seen = observability(plant({"x1": "x3**2", "x2": "x1", "x3": "-x3"}, {"y1": "x1", "y2": "x2"}))
    assert (seen.rank.value, seen.at_point.value) == (3, 2)
    assert seen.at_point.verdict.status is Status.PROVED
    assert seen.observable_at_point.fails


def test_the_rank_at_rest_of_a_body_with_two_measured_angles_is_found_without_its_long_rows() -> None:
    rates = {
        "ph": "w1 + tan(th)*(sin(ph)*w2 + cos(ph)*w3)",
        "th": "cos(ph)*w2 - sin(ph)*w3",
        "ps": "(sin(ph)*w2 + cos(ph)*w3)/cos(th)",
        "w1": "a1*w2*w3",
        "w2": "a2*w1*w3",
        "w3": "a3*w1*w2",
    }
    body = plant(rates, {"y1": "ph", "y2": "th"}, parameters={"a1": {}, "a2": {}, "a3": {}})
    seen = observability(body)
    assert (seen.rank.value, seen.at_point.value) == (5, 4)
