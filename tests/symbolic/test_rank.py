"""Ranks, spans, kernels and inverses of matrices of expressions."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import Status
from ulna.symbolic.exact import (
    SampledZero,
    are_zero,
    generic_rank,
    in_span,
    inverse,
    inverse_last_column,
    inverse_last_row,
    is_zero,
    minor_determinant,
    null_space,
    rank_at,
    solve_linear,
)

x1, x2, x3, x4 = x = sp.symbols("x1:5", real=True)
a, G, J, k, m = sp.symbols("a G J k m", real=True)
sin, cos, exp = sp.sin, sp.cos, sp.exp


def controllability(f: list[sp.Expr], g: list[sp.Expr]) -> sp.Matrix:
    """[g, ad_f g, ...] with ad_f g = (df/dx) g - (dg/dx) f."""
    states = list(x[: len(f)])
    field, columns = sp.Matrix(f), [sp.Matrix(g)]
    for _ in range(len(f) - 1):
        last = columns[-1]
        columns.append(field.jacobian(states) * last - last.jacobian(states) * field)
    return sp.Matrix.hstack(*columns)


def acrobot() -> sp.Matrix:
    """Unit-mass acrobot, angles from hanging (Murray & Hauser 1991): controllability matrix, rank 4."""
    q1, q2, p1, p2 = x
    d = 2 - cos(q2) ** 2
    pull = sin(q2) * (2 * p1 * p2 + p2**2) - 2 * G * sin(q1) - G * sin(q1 + q2)
    turn = sin(q2) * p1**2 + G * sin(q1 + q2)
    f = [p1, p2, (pull + (1 + cos(q2)) * turn) / d, (-(1 + cos(q2)) * pull - (3 + 2 * cos(q2)) * turn) / d]
    return controllability(f, [sp.S.Zero, sp.S.Zero, -(1 + cos(q2)) / d, (3 + 2 * cos(q2)) / d])


MATRICES = {
    "flexible joint": (
        controllability(
            [x2, -m * G * sin(x1) - k * (x1 - x3), x4, k * (x1 - x3) / J], [sp.S.Zero, sp.S.Zero, sp.S.Zero, 1 / J]
        ),
        4,
    ),
    "acrobot": (acrobot(), 4),
    "linear uncontrollable": (sp.Matrix([[1, -1, 1], [1, -1, 1], [0, 2, a]]), 2),
    "rotation": (sp.Matrix([[cos(x1), -sin(x1)], [sin(x1), cos(x1)]]), 2),
    "dependent by Pythagoras": (sp.Matrix([[1, sin(x1)], [sin(x1), 1 - cos(x1) ** 2]]), 1),
    "dependent by addition theorem": (
        sp.Matrix([[sin(x1 + x2), cos(x1)], [sin(x1) * cos(x2) + cos(x1) * sin(x2), cos(x1)]]),
        1,
    ),
    "outer product": (sp.Matrix([exp(x1), x2, 1 / (1 + x3)]) * sp.Matrix([[x1, sin(x2), a, 1]]), 1),
    "zero": (sp.zeros(2, 3), 0),
    "hidden zero": (sp.Matrix([[sin(2 * x1) - 2 * sin(x1) * cos(x1)]]), 0),
    "wide": (sp.Matrix([[x1, x2, x3], [x2, x3, x1]]), 2),
}


@pytest.mark.parametrize("name", MATRICES)
def test_the_generic_rank_is_right_and_proved(name: str) -> None:
    matrix, expected = MATRICES[name]
    rank = generic_rank(matrix)
    assert rank.value == expected
    assert rank.verdict.status is Status.PROVED
    assert len(rank.rows) == len(rank.columns) == expected


@pytest.mark.parametrize("name", [name for name, (_, rank) in MATRICES.items() if rank])
def test_the_pivot_minor_does_not_vanish_at_the_point(name: str) -> None:
    matrix, _ = MATRICES[name]
    rank = generic_rank(matrix)
    assert rank.point is not None
    minor = matrix.extract(list(rank.rows), list(rank.columns)).xreplace(dict(rank.point))
    assert abs(sp.N(minor, 40).det()) > sp.Rational(1, 10**20)


def test_the_minor_determinant_is_the_singular_set() -> None:
    field = [x2, m * sin(x1) / J, -m * sin(x1) / J]
    matrix = controllability(field, [sp.S.Zero, -1 / J, (J + 1) / J])
    rank = generic_rank(matrix)
    singular = minor_determinant(matrix, rank)
    assert is_zero(singular - matrix.det()).status is Status.PROVED
    assert singular.xreplace({x1: sp.pi / 2}) == 0


def test_the_rank_drops_at_a_singular_point_with_parameters_left_free() -> None:
    matrix = sp.Matrix([[a * cos(x2), 0], [x1, 1]])
    assert generic_rank(matrix).value == 2
    local = rank_at(matrix, {x1: sp.S.Zero, x2: sp.pi / 2})
    assert local.value == 1
    assert local.verdict.status is Status.PROVED
    assert rank_at(matrix, {x1: sp.S.Zero, x2: sp.S.Zero}).value == 2


def test_a_removable_singularity_is_removed() -> None:
    matrix = sp.Matrix([[(x1**2 - x1 * x2) / x1, 1], [0, x2]])
    assert rank_at(matrix, {x1: sp.S.Zero, x2: sp.S.One}).value == 2


def test_a_pole_is_undecided_and_named() -> None:
    rank = rank_at(sp.Matrix([[1 / x1, 1], [1, x1]]), {x1: sp.S.Zero})
    assert rank.verdict.status is Status.UNDECIDED
    assert rank.verdict.evidence["entry"] == (0, 0)


def test_without_time_the_upper_bound_is_only_supported() -> None:
    matrix, _ = MATRICES["dependent by Pythagoras"]
    assert generic_rank(matrix, seconds=0).verdict.status is Status.SUPPORTED


def test_a_rank_deficit_without_known_relations_is_only_supported() -> None:
    matrix = sp.Matrix([[sp.gamma(x1 + 1), 1], [x1 * sp.gamma(x1), 1]])
    rank = generic_rank(matrix)
    assert rank.value == 1
    assert rank.verdict.status is Status.SUPPORTED


def test_a_combination_lies_in_the_span() -> None:
    first, second = sp.Matrix([1, x1, sin(x2)]), sp.Matrix([0, 1, exp(x3)])
    assert in_span(cos(x1) * first - x2 * second, first.row_join(second)).status is Status.PROVED


def test_a_vector_outside_the_span_is_refuted_with_both_ranks() -> None:
    verdict = in_span(sp.Matrix([0, 0, 1]), sp.Matrix([[1, 0], [x1, 1], [0, 0]]))
    assert verdict.fails
    assert (verdict.evidence["rank_before"], verdict.evidence["rank_after"]) == (2, 3)


def test_only_zero_lies_in_the_empty_span() -> None:
    assert in_span(sp.zeros(2, 1), sp.zeros(2, 0)).status is Status.PROVED
    assert in_span(sp.Matrix([1, 0]), sp.zeros(2, 0)).fails


def test_the_kernel_is_tidy() -> None:
    matrix = sp.Matrix([[sin(x1), cos(x1) * sin(x1), 0]])
    assert null_space(matrix) == (sp.Matrix([-cos(x1), 1, 0]), sp.Matrix([0, 0, 1]))


@pytest.mark.parametrize("name", MATRICES)
def test_the_kernel_has_the_right_dimension_and_is_mapped_to_zero(name: str) -> None:
    matrix, rank = MATRICES[name]
    kernel = null_space(matrix)
    assert len(kernel) == matrix.cols - rank
    assert all(are_zero(list(matrix * vector)).status is Status.PROVED for vector in kernel)


@pytest.mark.parametrize("name", ["flexible joint", "acrobot", "rotation"])
def test_last_row_and_last_column_belong_to_the_inverse(name: str) -> None:
    matrix, size = MATRICES[name]
    unit = sp.eye(size)
    row, column = inverse_last_row(matrix), inverse_last_column(matrix)
    assert row.solution is not None
    assert column.solution is not None
    assert row.verdict.status is Status.PROVED
    sampled = SampledZero(points=3, seconds=0)
    assert are_zero(list(row.solution * matrix - unit[-1, :]), test=sampled).holds
    assert are_zero(list(matrix * column.solution - unit[:, -1]), test=sampled).holds


def test_an_inverse_is_in_lowest_terms() -> None:
    rotation, _ = MATRICES["rotation"]
    assert inverse(rotation).solution == rotation.T


def test_a_singular_matrix_has_no_inverse() -> None:
    found = inverse(MATRICES["dependent by Pythagoras"][0])
    assert found.solution is None
    assert found.verdict.fails


entries = st.sampled_from([0, 1, -2, x1, x2, a, sin(x1), cos(x1), exp(x2), x1 * x2, 1 / (1 + x1**2)]).map(sp.sympify)


@settings(max_examples=30, deadline=None)
@given(st.lists(entries, min_size=9, max_size=9), st.lists(entries, min_size=3, max_size=3))
def test_a_solution_satisfies_its_equations(values: list[sp.Expr], right: list[sp.Expr]) -> None:
    matrix, vector = sp.Matrix(3, 3, values), sp.Matrix(right)
    found = solve_linear(matrix, vector)
    if found.solution is None:
        assert is_zero(matrix.det(method="berkowitz")).holds
    else:
        assert are_zero(list(matrix * found.solution - vector)).holds


@settings(max_examples=30, deadline=None)
@given(st.lists(entries, min_size=12, max_size=12))
def test_rank_and_kernel_add_up_to_the_width(values: list[sp.Expr]) -> None:
    matrix = sp.Matrix(3, 4, values)
    assert generic_rank(matrix).value + len(null_space(matrix)) == 4
    assert generic_rank(matrix.T).value == generic_rank(matrix).value
