"""Dimension, membership, annihilator, involutivity and closure."""

import pytest
from sympy import Matrix, cos, exp, sin, symbols

from ulna.base import Status, UlnaError
from ulna.geometry import (
    annihilator,
    distribution,
    filtration,
    involutive,
    involutive_closure,
    iterated_brackets,
    lie_bracket,
)
from ulna.geometry.distributions import contains, dimension_at, generic_basis, generic_dimension
from ulna.geometry.oneform import contraction
from ulna.symbolic.exact import is_zero

X = x1, x2, x3 = symbols("x1:4", real=True)
ROBOT = distribution([Matrix([sin(x3), cos(x3), 0]), Matrix([0, 0, 1])], X)  # Röbenack 2017, Involutiv_Test


def test_dimension_drops_at_a_point() -> None:
    span = distribution([Matrix([x1, 0, 0]), Matrix([0, 1, 0])], X)
    assert generic_dimension(span).value == 2
    assert dimension_at(span, {x1: 0, x2: 0, x3: 0}).value == 1
    assert dimension_at(span, {x1: 1, x2: 0, x3: 0}).value == 2


def test_dependent_fields_are_dropped_from_a_basis() -> None:
    span = distribution([Matrix([1, x1, 0]), Matrix([x2, x1 * x2, 0]), Matrix([0, 0, 1])], X)
    assert generic_basis(span).fields == (span.fields[0], span.fields[2])


def test_a_combination_with_functions_is_a_member() -> None:
    assert contains(ROBOT, x1 * ROBOT.fields[0] + exp(x2) * ROBOT.fields[1]).holds


def test_a_stranger_is_refused_with_both_ranks() -> None:
    verdict = contains(ROBOT, Matrix([cos(x3), -sin(x3), 0]))
    assert verdict.fails
    assert (verdict.evidence["rank_before"], verdict.evidence["rank_after"]) == (2, 3)


def test_annihilator_vanishes_on_every_field() -> None:
    forms = annihilator(ROBOT)
    assert len(forms) == 1
    assert all(is_zero(contraction(form, field)).holds for form in forms for field in ROBOT.fields)
    assert len(annihilator(distribution([], X))) == 3


def test_unicycle_is_not_involutive_and_the_bracket_is_shown() -> None:
    verdict = involutive(ROBOT)
    assert verdict.fails
    assert verdict.evidence["pair"] == (0, 1)
    assert verdict.evidence["bracket"] == lie_bracket(ROBOT.fields[0], ROBOT.fields[1], X)
    assert (verdict.evidence["rank_before"], verdict.evidence["rank_after"]) == (2, 3)


def test_closure_of_the_unicycle_is_everything() -> None:
    assert len(involutive_closure(ROBOT).fields) == 3


def test_closure_of_an_involutive_distribution_is_itself() -> None:
    span = distribution([Matrix([x2, -x1, 0]), Matrix([0, 0, 1])], X)
    assert involutive(span).holds
    assert involutive_closure(span).fields == span.fields


def test_closure_is_involutive_and_contains_the_fields() -> None:
    y = y1, y2, y3, y4 = symbols("y1:5", real=True)
    span = distribution([Matrix([1, 0, y2, 0]), Matrix([0, 1, 0, y3])], y)
    closure = involutive_closure(span)
    assert involutive(closure).holds
    assert all(contains(closure, field).holds for field in span.fields)
    assert len(closure.fields) == 4
    assert y1 is not y4


def test_brackets_that_stay_inside_by_function_multiples_are_accepted() -> None:
    span = distribution([Matrix([1, 0, x2]), Matrix([0, exp(x1), x1 * exp(x1)])], X)
    assert involutive(span).holds


def test_a_whole_tangent_space_is_involutive() -> None:
    whole = distribution([Matrix([1, 0, 0]), Matrix([x1, 1, 0]), Matrix([0, x2, 1])], X)
    assert involutive(whole).status is Status.PROVED


PLANTS = {
    # name: drift, input fields
    "one input": ([x2 - x3**2, x3, 0], [[-x2 * (1 + x2**2), 0, 1 + x2**2]]),
    "hidden factor": ([x2 * exp(x1), sin(x3), x1 * x2], [[0, exp(x2) * x1, exp(x2) * (1 + x1**2)]]),
    "not controllable": ([-x1, -2 * x2, -3 * x3], [[1, 1, 0]]),
    "two inputs": ([x2, x1 * x3, 0], [[0, cos(x1), 1], [0, 0, x2]]),
    "dependent inputs": ([x2, x3, 0], [[0, 0, x1], [0, 0, exp(x2)]]),
}


@pytest.mark.parametrize("name", PLANTS)
def test_filtration_spans_the_iterated_brackets(name: str) -> None:
    drift, inputs = Matrix(PLANTS[name][0]), [Matrix(g) for g in PLANTS[name][1]]
    members = filtration(drift, inputs, X, 2)
    for order, member in enumerate(members):
        brackets = [b for g in inputs for b in iterated_brackets(drift, g, X, order)]
        raw = distribution(brackets, X)
        assert len(member.fields) == generic_dimension(raw).value
        assert generic_dimension(distribution([*member.fields, *brackets], X)).value == len(member.fields)


def test_filtration_of_a_disguised_chain_of_integrators_has_short_fields() -> None:
    # z = (x₁ + x₂², x₂ + sin x₃, x₃), z' = (z₂, z₃, u exp(x₁ x₂)): brackets grow, the fields of G₂ do not.
    z = Matrix([x1 + x2**2, x2 + sin(x3), x3])
    inverse = z.jacobian(X).inv()
    drift, control = inverse * Matrix([z[1], z[2], 0]), inverse * Matrix([0, 0, exp(x1 * x2)])
    members = filtration(drift, [control], X, 1)
    assert sum(int(entry.count_ops()) for field in members[1].fields for entry in field) < 25
    assert involutive(members[1]).holds


def test_a_field_of_wrong_length_is_refused() -> None:
    with pytest.raises(UlnaError, match="shape"):
        distribution([Matrix([1, 0])], X)
