"""Exact algebra: zero tests, ranks, spans, short forms, rigorous balls, within time budgets.

Other packages import from here. Each question has one verb and, where there are several ways, strategies:
`is_zero(test=SampledZero())`, `null_space`, `generic_rank` and `rank_at`, `tidy`, `attempt`.
"""

from ulna.symbolic.exact.attempts import Attempt, attempt
from ulna.symbolic.exact.ball import RootWhereReal, Tape, exact_ball, tape
from ulna.symbolic.exact.budget import patience, set_patience, time_budget, worked
from ulna.symbolic.exact.linear import LinearSolution, inverse, inverse_last_column, inverse_last_row, solve_linear
from ulna.symbolic.exact.quotients import compact, lowest_terms, normal
from ulna.symbolic.exact.rank import (
    Rank,
    generic_rank,
    minor_determinant,
    rank_at,
    rank_of_balls,
    rank_of_numbers,
    value_at,
)
from ulna.symbolic.exact.sample import SEED, Point, random_points
from ulna.symbolic.exact.simplify import shortened, tidy, zero_set
from ulna.symbolic.exact.spans import in_span, null_space, reduced_against, without_common_factor
from ulna.symbolic.exact.zero import ResidueZero, SampledZero, ZeroTest, are_zero, is_zero, vanishes

__all__ = [
    "SEED",
    "Attempt",
    "LinearSolution",
    "Point",
    "Rank",
    "ResidueZero",
    "RootWhereReal",
    "SampledZero",
    "Tape",
    "ZeroTest",
    "are_zero",
    "attempt",
    "compact",
    "exact_ball",
    "generic_rank",
    "in_span",
    "inverse",
    "inverse_last_column",
    "inverse_last_row",
    "is_zero",
    "lowest_terms",
    "minor_determinant",
    "normal",
    "null_space",
    "patience",
    "random_points",
    "rank_at",
    "rank_of_balls",
    "rank_of_numbers",
    "reduced_against",
    "set_patience",
    "shortened",
    "solve_linear",
    "tape",
    "tidy",
    "time_budget",
    "value_at",
    "vanishes",
    "without_common_factor",
    "worked",
    "zero_set",
]
