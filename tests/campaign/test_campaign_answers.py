"""What campaigns answer, against closed forms and against SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from campaign_loops import RUNAWAY, SPRING
from hypothesis import given
from hypothesis import strategies as st

from ulna.campaign import (
    CampaignError,
    Choice,
    Grid,
    Measures,
    Random,
    Saltelli,
    Uniform,
    clopper_pearson,
    fan,
    outcome_counts,
    quantiles,
    replay,
    sensitivity,
    settled_fraction,
    settled_map,
    sweep,
    wilson,
    worst_cases,
)
from ulna.campaign.answers.order_statistics import order_statistics
from ulna.sim import simulate
from ulna.system import system_from_mapping

RUNS = sweep(
    RUNAWAY, Random(vary={"x": Uniform(low=-1, high=3), "c": Choice(values=(0.0, 1.0))}, runs=200), horizon=6.0
)
FLAT = system_from_mapping(
    {
        "states": {"x": "0", "a": "0", "b": "0"},
        "outputs": {"y": "a + 2*b"},
    }
)
"""Nothing moves: the peak error of y is |a + 2 b|."""


def test_the_settled_fraction_is_that_of_the_runs_below_the_threshold() -> None:
    safe = (RUNS["c"] == 0) | (RUNS["x"] < 1)
    found = settled_fraction(RUNS)
    assert found.count <= safe.sum()
    assert found.value == pytest.approx(safe.mean(), abs=0.05)  # close to the threshold 6 s do not suffice
    assert found.low < found.value < found.high
    assert "at 95% confidence, Wilson" in str(found)
    exact = settled_fraction(RUNS, interval=clopper_pearson)
    assert exact.method == "Clopper–Pearson"
    assert exact.low < found.low
    assert found.high < exact.high


def test_outcomes_are_counted_by_name() -> None:
    blown = int((RUNS["outcome"] == 1).sum())
    assert outcome_counts(RUNS) == {"finished": 200 - blown, "blew_up": blown}
    assert 0 < blown < 200


def test_a_fraction_of_a_grid_claims_no_confidence() -> None:
    found = settled_fraction(sweep(RUNAWAY, Grid(axes={"x": [-1.0, 0.5, 4.0]}), horizon=8.0))
    assert (found.count, found.runs, found.drawn) == (2, 3, False)
    assert str(found) == "66.67%"


def test_wilson_limits_solve_the_equation_they_are_defined_by() -> None:
    low, high = wilson(37, 120, 0.95)
    for p in (low, high):
        assert abs(37 / 120 - p) / math.sqrt(p * (1 - p) / 120) == pytest.approx(1.959963984540054, rel=1e-9)


@given(st.integers(1, 300), st.data())
def test_limits_hold_the_fraction_and_the_exact_ones_are_those_of_the_beta_distribution(trials: int, data) -> None:
    from scipy.stats import beta

    hits = data.draw(st.integers(0, trials))
    for interval in (wilson, clopper_pearson):
        low, high = interval(hits, trials, 0.9)
        assert -1e-12 <= low <= hits / trials <= high <= 1 + 1e-12
    low, high = clopper_pearson(hits, trials, 0.9)
    assert low == pytest.approx(beta.ppf(0.05, hits, trials - hits + 1) if hits else 0.0, abs=1e-9)
    assert high == pytest.approx(beta.ppf(0.95, hits + 1, trials - hits) if hits < trials else 1.0, abs=1e-9)


def test_worst_cases_are_the_blow_ups_then_the_largest_and_can_be_replayed() -> None:
    blown = np.flatnonzero(RUNS["outcome"] != 0)
    cases = worst_cases(RUNS, "peak_error_y", count=len(blown) + 5)
    assert [c.number for c in cases[: len(blown)]] == sorted(blown, key=lambda run: RUNS["end_time"][run])
    rest = cases[len(blown) :]
    left = np.setdiff1d(np.arange(200), blown)
    assert [c.value for c in rest] == sorted(RUNS["peak_error_y"][left])[::-1][:5]
    worst = replay(RUNS, cases[0].number)
    assert worst.identical
    assert not worst.trajectory.outcome.finished
    assert cases[0].varied == {"x": worst.trajectory.states[0, 0], "c": worst.trajectory.parameters["c"]}


def test_quantiles_are_values_of_runs_and_may_be_infinite() -> None:
    table = quantiles(RUNS, ["settling_time_y", "peak_error_y"], levels=[0.0, 0.5, 1.0])
    assert table["settling_time_y"].values[2] == math.inf
    assert table["settling_time_y"].values[0] == np.nanmin(RUNS["settling_time_y"])
    assert set(table["peak_error_y"].values) <= set(RUNS["peak_error_y"])
    assert table["peak_error_y"].attrs["units"] == ""


@given(
    st.lists(st.floats(allow_nan=True, width=64), min_size=1, max_size=60),
    st.integers(1, 9),
    st.lists(st.floats(0, 1), max_size=5),
)
def test_quantiles_of_blocks_are_numpys_of_the_whole(values: list[float], size: int, levels: list[float]) -> None:
    whole = np.array(values)
    found, counted = order_statistics(
        lambda: ({"a": whole[k : k + size]} for k in range(0, len(whole), size)), ["a"], levels
    )["a"]
    numbers = whole[~np.isnan(whole)]
    assert counted == len(numbers)
    expected = np.quantile(numbers, levels, method="inverted_cdf") if counted else np.full(len(levels), np.nan)
    assert np.array_equal(found, expected, equal_nan=True)


def test_answers_do_not_depend_on_the_size_of_the_batches() -> None:
    plan = Random(vary={"x": Uniform(low=-1, high=3), "c": Choice(values=(0.0, 1.0))}, runs=200)
    cut = sweep(RUNAWAY, plan, horizon=6.0, batch_size=17)
    assert quantiles(cut).equals(quantiles(RUNS))
    assert worst_cases(cut, "steady_error_y", count=60) == worst_cases(RUNS, "steady_error_y", count=60)
    assert settled_fraction(cut) == settled_fraction(RUNS)
    one, other = settled_map(cut, "x", "c"), settled_map(RUNS, "x", "c")
    assert np.array_equal(one.fraction, other.fraction, equal_nan=True)
    assert np.array_equal(one.x_edges, other.x_edges)


def test_sobol_indices_of_a_sum_are_known() -> None:
    """Var(a) : Var(2 b) = 1 : 4, and nothing interacts; a + 2 b > 0 throughout."""
    vary = {"a": Uniform(low=1, high=2), "b": Uniform(low=1, high=2), "x": Uniform(low=1, high=2)}
    result = sweep(FLAT, Saltelli(vary=vary, base=512, seed=1), Measures(samples=2), horizon=1.0)
    found = sensitivity(result, "peak_error_y")
    assert found.names == ("a", "b", "x")
    assert found.first_order == pytest.approx([0.2, 0.8, 0.0], abs=0.02)
    assert found.total == pytest.approx([0.2, 0.8, 0.0], abs=0.02)
    assert np.all(found.first_order_low <= found.first_order + 1e-9)
    assert np.all(found.first_order <= found.first_order_high + 1e-9)


def test_sobol_indices_are_scipys_however_the_runs_are_cut() -> None:
    from scipy.stats import sobol_indices

    vary = {"x": Uniform(low=0.1, high=0.6), "c": Uniform(low=0.5, high=1.5)}
    found = [
        sensitivity(sweep(RUNAWAY, Saltelli(vary=vary, base=64), horizon=2.0, batch_size=size), "final_x")
        for size in (7, 64, 10_000)
    ]
    blocks = sweep(RUNAWAY, Saltelli(vary=vary, base=64), horizon=2.0)["final_x"].reshape(4, 1, 64)
    truth = sobol_indices(func={"f_A": blocks[0], "f_B": blocks[1], "f_AB": blocks[2:]}, n=64)
    for one in found:
        assert one.first_order == pytest.approx(np.ravel(truth.first_order), abs=1e-12)
        assert one.total == pytest.approx(np.ravel(truth.total_order), abs=1e-12)
        assert one.total_high == pytest.approx(found[0].total_high, abs=1e-12)


def test_grouped_rows_give_the_limits_that_single_rows_give(monkeypatch) -> None:
    vary = {"a": Uniform(low=1, high=2), "b": Uniform(low=1, high=2)}
    result = sweep(FLAT, Saltelli(vary=vary, base=2048, seed=1), Measures(samples=2), horizon=1.0)
    single = sensitivity(result, "peak_error_y", resamples=1000)
    monkeypatch.setattr("ulna.campaign.answers.sobol_indices.GROUPS", 256)
    grouped = sensitivity(result, "peak_error_y", resamples=1000)
    assert grouped.first_order == pytest.approx(single.first_order, abs=1e-12)
    width = single.total_high - single.total_low
    assert grouped.total_high - grouped.total_low == pytest.approx(width, rel=0.25)


def test_a_map_over_a_grid_has_a_cell_for_each_value() -> None:
    result = sweep(RUNAWAY, Grid(axes={"x": [-1.0, 0.5, 2.0, 4.0], "c": [0.0, 1.0]}), horizon=8.0)
    found = settled_map(result, "x", "c")
    assert found.fraction.tolist() == [[1, 1, 1, 1], [1, 1, 0, 0]]
    assert found.runs.tolist() == [[1] * 4] * 2
    assert found.x_edges == pytest.approx([-1.75, -0.25, 1.25, 3.0, 5.0])


def test_a_map_over_drawn_runs_counts_every_run_once() -> None:
    found = settled_map(RUNS, "x", "c", cells=10)
    assert found.runs.sum() == 200
    hits = np.where(found.runs > 0, found.fraction, 0) * found.runs
    assert hits.sum() == pytest.approx(settled_fraction(RUNS).count)


def test_a_map_has_as_many_cells_as_the_runs_can_fill() -> None:
    assert settled_map(RUNS, "x", "c").runs.shape == (4, 4)
    assert settled_map(RUNS, "x", "c", cells=25).runs.shape == (25, 25)


def test_a_fan_is_made_of_the_runs_themselves() -> None:
    result = sweep(SPRING, Grid(axes={"x": [-1.0, 0.0, 1.0, 2.0, 3.0]}), Measures(outputs=("y",)), horizon=3.0)
    found = fan(result, "y", levels=(0.0, 0.5, 1.0))
    assert (found.runs, found.early, found.unit) == (5, 0, "m")
    for row, start in zip(found.values, (-1.0, 1.0, 3.0), strict=True):
        # The spring is linear: extremes and median are runs up to the first crossing of zero.
        path = simulate(SPRING, [start, 0.0], found.times)["y"]
        until = int(np.argmax(path * path[0] <= 0))
        assert row[:until] == pytest.approx(path[:until], abs=1e-12)


def test_runs_that_end_early_count_in_a_fan_up_to_there() -> None:
    found = fan(RUNS, "y", runs=50)
    assert 0 < found.early < 50
    assert np.isfinite(found.values).all()


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda: RUNS["peak"], "no such figure"),
        (lambda: replay(RUNS, 200), "the runs 0 to 199"),
        (lambda: replay(RUNS, -1), "the runs 0 to 199"),
        (lambda: settled_fraction(RUNS, confidence=1.0), "between 0 and 1"),
        (lambda: worst_cases(RUNS, "peak_error_y", count=0), "at least one"),
        (lambda: quantiles(RUNS, levels=[1.2]), "between 0 and 1"),
        (lambda: sensitivity(RUNS, "settled"), "its plan is Random"),
        (lambda: settled_map(RUNS, "x", "x"), "two different axes"),
        (lambda: settled_map(RUNS, "x", "y"), "it was not varied"),
        (lambda: fan(RUNS, "y", runs=0), "expected one run or more"),
    ],
)
def test_a_question_without_an_answer_is_one_clear_error(call, reason: str) -> None:
    with pytest.raises(CampaignError, match=reason):
        call()


def test_indices_of_a_figure_that_is_not_finite_or_never_changes_are_refused() -> None:
    plan = Saltelli(vary={"x": Uniform(low=0.5, high=3), "c": Uniform(low=0, high=1)}, base=4)
    result = sweep(RUNAWAY, plan, horizon=4.0)
    with pytest.raises(CampaignError, match="not a finite number in"):
        sensitivity(result, "settling_time_y")
    still = sweep(FLAT, Saltelli(vary={"x": Uniform(low=0, high=1)}, base=4), horizon=1.0)
    with pytest.raises(CampaignError, match="in every run"):
        sensitivity(still, "end_time")
