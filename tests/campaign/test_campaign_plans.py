"""Plans: run k is a pure function of plan and k; the points are what the plan's name says."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.stats import qmc

from ulna.campaign import (
    CampaignError,
    Choice,
    Grid,
    LatinHypercube,
    LogUniform,
    Normal,
    Posterior,
    Random,
    Saltelli,
    Sobol,
    Uniform,
    as_probability_distribution,
    posterior,
)
from ulna.campaign.plans import seeds
from ulna.campaign.plans.permutation import shuffled
from ulna.system import system_from_mapping

VARY = {"a": Uniform(low=-1, high=2), "b": Normal(mean=5, std=2, low=1, high=9), "c": LogUniform(low=1, high=100)}
FIVE = VARY | {"d": Choice(values=(1.0, 2.0, 5.0)), "e": stats.gamma(2.0)}
PLANS = {
    "random": Random(vary=FIVE, runs=300, seed=7),
    "latin": LatinHypercube(vary=FIVE, runs=300, seed=7),
    "sobol": Sobol(vary=FIVE, runs=300, seed=7),
    "together": LatinHypercube(vary=FIVE, correlations=(("a", "b", 0.8), ("c", "b", -0.5)), runs=300, seed=7),
    "saltelli": Saltelli(vary=FIVE, base=32, seed=7),
    "grid": Grid(axes={"a": np.linspace(0, 1, 7), "b": [1, 5, 2], "c": range(10)}, seed=7),
}


@pytest.mark.parametrize("name", PLANS)
@given(cuts=st.lists(st.integers(1, 199), max_size=6))
def test_the_values_of_a_run_do_not_depend_on_how_the_runs_are_cut(name: str, cuts: list[int]) -> None:
    plan = PLANS[name]
    whole = plan.values(0, 200)
    edges = sorted({0, 200, *cuts})
    parts = [plan.values(first, last) for first, last in pairwise(edges)]
    assert all(np.array_equal(np.concatenate([part[key] for part in parts]), whole[key]) for key in plan.names)
    noise = np.concatenate([seeds(plan, first, last) for first, last in pairwise(edges)])
    assert np.array_equal(noise, seeds(plan, 0, 200))


@pytest.mark.parametrize("name", PLANS)
def test_every_value_lies_in_the_support_it_announces(name: str) -> None:
    plan = PLANS[name]
    for key, values in plan.values(0, plan.count).items():
        low, high = plan.support(key)
        assert values.shape == (plan.count,)
        assert low <= values.min() <= values.max() <= high


@pytest.mark.parametrize("plan", [Random, LatinHypercube, Sobol])
def test_another_seed_gives_other_runs_and_the_same_seed_the_same(plan: type) -> None:
    one, same, other = (plan(vary=VARY, runs=64, seed=s) for s in (1, 1, 2))
    assert np.array_equal(one.values(0, 64)["a"], same.values(0, 64)["a"])
    assert not np.array_equal(one.values(0, 64)["a"], other.values(0, 64)["a"])
    assert not np.array_equal(seeds(one, 0, 64), seeds(other, 0, 64))


def test_random_draws_follow_their_distributions_and_are_independent() -> None:
    runs = 20_000
    values = Random(vary=VARY, runs=runs, seed=3).values(0, runs)
    truth = {
        "a": stats.uniform(-1, 3),
        "b": stats.truncnorm(-2, 2, loc=5, scale=2),
        "c": stats.loguniform(1, 100),
    }
    assert all(stats.kstest(values[name], law.cdf).pvalue > 0.01 for name, law in truth.items())
    ranks = stats.spearmanr(np.stack(list(values.values()), axis=1)).statistic
    assert np.abs(ranks - np.eye(3)).max() < 4 / math.sqrt(runs)


def test_a_latin_hypercube_meets_every_stratum_of_every_quantity_once() -> None:
    plan = LatinHypercube(vary={"a": Uniform(low=0, high=1), "b": Uniform(low=0, high=1)}, runs=500, seed=2)
    for values in plan.values(0, 500).values():
        assert sorted((values * 500).astype(int)) == list(range(500))


@given(count=st.integers(1, 300), seed=st.integers(0, 2**63 - 1), stream=st.integers(0, 50))
def test_a_shuffle_holds_every_number_once(count: int, seed: int, stream: int) -> None:
    assert sorted(shuffled(np.arange(count), count, seed=seed, stream=stream)) == list(range(count))


def test_a_shuffle_is_fair_and_its_streams_are_independent() -> None:
    """Over many seeds every number is as likely in every place; over many places columns do not follow each other."""
    tables = np.array([shuffled(np.arange(6), 6, seed=seed, stream=1) for seed in range(6000)])
    for place in range(6):
        assert stats.chisquare(np.bincount(tables[:, place], minlength=6)).pvalue > 1e-4
    runs = 20_000
    columns = [shuffled(np.arange(runs), runs, seed=3, stream=k) for k in range(3)] + [np.arange(runs)]
    assert np.abs(np.corrcoef(columns) - np.eye(4)).max() < 4 / math.sqrt(runs)
    steps = np.diff(columns[0]) % runs  # neighbours land anywhere
    assert stats.kstest(steps / runs, "uniform").pvalue > 1e-4


def test_a_latin_hypercube_is_as_even_as_scipys_and_evener_than_chance() -> None:
    def unevenness(values: dict[str, np.ndarray]) -> float:
        return float(qmc.discrepancy(np.stack(list(values.values()), axis=1), method="CD"))

    cube = {name: Uniform(low=0, high=1) for name in "abc"}
    ours = [unevenness(LatinHypercube(vary=cube, runs=128, seed=s).values(0, 128)) for s in range(40)]
    scipys = [unevenness(dict(enumerate(qmc.LatinHypercube(3, rng=s).random(128).T))) for s in range(40)]  # type: ignore[arg-type]
    chance = [unevenness(Random(vary=cube, runs=128, seed=s).values(0, 128)) for s in range(40)]
    assert stats.mannwhitneyu(ours, scipys).pvalue > 0.01
    assert np.mean(ours) < 0.5 * np.mean(chance)


@pytest.mark.parametrize("plan", [Random, LatinHypercube])
def test_the_last_runs_of_a_trillion_are_found_without_those_before(plan: type) -> None:
    """A table of all points would take 24 TB."""
    runs = 10**12
    values = plan(vary=VARY, runs=runs).values(runs - 3, runs)
    assert all(len(set(column)) == 3 for column in values.values())


def test_sobol_points_are_scipys() -> None:
    plan = Sobol(vary={"a": Uniform(low=0, high=1), "b": Uniform(low=0, high=1)}, runs=64, seed=5)
    expected = qmc.Sobol(2, rng=np.random.default_rng(5)).random_base2(6)
    assert np.abs(np.stack(list(plan.values(0, 64).values()), axis=1) - expected).max() <= 2.0**-30


def test_a_saltelli_plan_changes_one_column_at_a_time() -> None:
    plan = Saltelli(vary=VARY, base=16, seed=4)
    blocks = np.stack(list(plan.values(0, plan.count).values()), axis=1).reshape(5, 16, 3)
    first, second = blocks[0], blocks[1]
    for column in range(3):
        expected = first.copy()
        expected[:, column] = second[:, column]
        assert np.array_equal(blocks[2 + column], expected)
    assert not np.any(first == second)


def test_a_grid_holds_every_combination_once() -> None:
    plan = Grid(axes={"a": [1, 2, 3], "b": [10, 20]})
    values = plan.values(0, 6)
    assert list(zip(values["a"], values["b"], strict=True)) == [(a, b) for a in (1, 2, 3) for b in (10, 20)]


def test_no_two_runs_share_a_seed() -> None:
    plan = PLANS["random"]
    assert len(np.unique(seeds(plan, 0, 100_000))) == 100_000


@given(st.floats(1e-9, 1 - 1e-9))
def test_quantile_functions_invert_scipys_distribution_functions(p: float) -> None:
    pairs = (
        (Normal(mean=1, std=3), stats.norm(1, 3)),
        (Normal(mean=0, std=1, low=-0.5), stats.truncnorm(-0.5, math.inf)),
        (LogUniform(low=0.1, high=7), stats.loguniform(0.1, 7)),
        (as_probability_distribution(stats.weibull_min(1.5, scale=2)), stats.weibull_min(1.5, scale=2)),
    )
    for ours, theirs in pairs:
        assert theirs.cdf(ours.quantile(np.array([p]))[0]) == pytest.approx(p, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Random(vary=VARY, runs=0), "at least one"),
        (lambda: LatinHypercube(vary=VARY, runs=-5), "at least one"),
        (lambda: Sobol(vary={}, runs=5), "nothing is varied"),
        (lambda: Random(vary=VARY, runs=2**41), "at most 2"),
        (lambda: Sobol(vary=VARY, runs=2**31), "asked for, there are 1073741824"),
        (lambda: Saltelli(vary=VARY, base=100), "power of two"),
        (lambda: Random(vary={"a": 3.0}, runs=5), "a float is none"),
        (lambda: Random(vary={"a": stats.poisson(3)}, runs=5), "is none"),
        (lambda: Random(vary=VARY, runs=5, seed=-1), "seed"),
        (lambda: Uniform(low=2, high=1), "low is not below high"),
        (lambda: Uniform(low=0, high=math.inf), "finite"),
        (lambda: LogUniform(low=0, high=1), "positive low"),
        (lambda: Normal(mean=0, std=0), "must be positive"),
        (lambda: Normal(mean=0, std=1, low=2, high=1), "low is not below high"),
        (lambda: Normal(mean=0, std=1, low=50), "hardly ever"),
        (lambda: Choice(values=()), "at least one value"),
        (lambda: Grid(axes={}), "no axis"),
        (lambda: Grid(axes={"a": []}), "at least one value"),
        (lambda: Grid(axes={"a": [1, 1]}), "is given twice"),
        (lambda: as_probability_distribution(stats.gamma(-1.0)), "do not fit|out of range"),
    ],
)
def test_a_plan_that_makes_no_sense_is_one_clear_error(make, reason: str) -> None:
    with pytest.raises(CampaignError, match=reason):
        make()


def _known() -> Posterior:
    """A lag as a fit leaves it: a known to 0.1, b to 0.2 V, c not at all."""
    rows = {"a": {"value": 2, "std": 0.1}, "b": {"value": 5000, "std": 200, "unit": "mV"}, "c": 3}
    lag = {"name": "lag", "parameters": rows, "states": {"x": "-a*x + b*c"}, "correlation": {"b": {"a": -0.9}}}
    return posterior(system_from_mapping(lag | {"dimensions": "unchecked"}))


@pytest.mark.parametrize("kind", [Random, LatinHypercube, Sobol])
def test_draws_from_a_posterior_have_its_covariance(kind: Any) -> None:
    known = _known()
    vary = {**known.vary, "x": Uniform(low=0, high=1)}
    drawn = kind(vary=vary, correlations=known.correlations, runs=2**13).values(0, 2**13)
    assert [float(np.mean(drawn[name])) for name in "abx"] == pytest.approx([2, 5, 0.5], abs=0.01)
    due = np.array([[0.01, -0.018, 0], [-0.018, 0.04, 0], [0, 0, 1 / 12]])
    assert np.cov([drawn[name] for name in "abx"]) == pytest.approx(due, rel=0.06, abs=6e-4)
    assert list(vary) == ["a", "b", "x"]


def test_a_posterior_is_cut_at_the_range_of_its_plant() -> None:
    rows = {"a": {"value": 1, "std": 1, "range": [0.5, 9]}}
    known = posterior(system_from_mapping({"name": "lag", "parameters": rows, "states": {"x": "-a*x"}}))
    assert Random(vary=known.vary, runs=500).values(0, 500)["a"].min() >= 0.5
    assert known.box(2.0) == {"a": (0.5, 3.0)}
    assert _known().box(3.0)["b"] == pytest.approx((4.4, 5.6))


def test_parameters_that_move_as_one_are_drawn_so() -> None:
    pairs = (("a", "b", 1), ("b", "c", -1.0), ("a", "c", -1.0))
    vary = {name: Normal(mean=0, std=1) for name in "abc"}
    drawn = Random(vary=vary, correlations=pairs, runs=100).values(0, 100)
    assert drawn["a"] == pytest.approx(drawn["b"], abs=1e-9)
    assert drawn["a"] == pytest.approx(-drawn["c"], abs=1e-9)


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        ((("a", "k", 0.5),), "'k' does not vary"),
        ((("a", "b", 0.5), ("b", "a", 0.5)), "each pair once"),
        ((("a", "b", 1.5),), "between -1 and 1"),
        ((("a", "b", 0.9), ("b", "c", 0.9), ("a", "c", -0.9)), "no quantities can have them together"),
    ],
)
def test_correlations_that_cannot_be_are_refused(pairs: Any, said: str) -> None:
    with pytest.raises(CampaignError, match=said):
        Random(vary=VARY, correlations=pairs, runs=10)
    with pytest.raises(CampaignError, match="independent"):
        Saltelli(vary=VARY, correlations=(("a", "b", 0.5),), base=4)
    with pytest.raises(CampaignError, match="none of them has a standard deviation"):
        posterior(system_from_mapping({"name": "lag", "parameters": {"a": 1}, "states": {"x": "-a*x"}}))
