"""Campaigns in memory: figures against closed forms, and the same bits however the work is cut."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from campaign_loops import RUNAWAY, SAMPLED, SPRING

from ulna.campaign import (
    CampaignError,
    CampaignResult,
    Grid,
    LatinHypercube,
    LocalWorkers,
    Measures,
    Normal,
    Random,
    Uniform,
    Window,
    replay,
    sweep,
)
from ulna.campaign.plans import seeds
from ulna.loop import Hardware, Loop
from ulna.sim import TIME, Crossing, FixedSteps, Held, Settling, Taylor, simulate
from ulna.system import system_from_mapping

SPREAD = Random(vary={"x": Uniform(low=-1, high=1), "k": Uniform(low=1, high=9), "r": Uniform(low=-1, high=1)}, runs=70)
SPRINGS = Measures(outputs=("y",), targets={"y": "r"}, effort=("u",))
MASSES = Random(
    vary={"x": Uniform(low=-1, high=1), "m": Normal(mean=1, std=0.2, low=0.5), "goal": Uniform(low=-1, high=1)}, runs=70
)


def springs(**how) -> CampaignResult:
    return sweep(SPRING, SPREAD, SPRINGS, horizon=6.0, **how)


def masses(**how) -> CampaignResult:
    measures = Measures(outputs=("x",), targets={"x": "goal"})
    return sweep(SAMPLED, MASSES, measures, horizon=2.0, **how)


@pytest.mark.parametrize("make", [springs, masses])
@pytest.mark.parametrize(("size", "threads"), [(1, 1), (7, 2), (64, 1), (1000, 2)])
def test_the_size_of_batches_and_the_number_of_threads_change_no_bit(make, size: int, threads: int) -> None:
    whole, cut = make(), make(batch_size=size, workers=LocalWorkers(threads=threads))
    for column in whole.columns:
        assert whole[column.name].tobytes() == cut[column.name].tobytes(), column.name


@pytest.mark.parametrize("make", [springs, masses])
def test_a_replayed_run_is_the_stored_one_bit_for_bit(make) -> None:
    result = make(batch_size=16)
    for number in (0, 15, 16, 69):
        again = replay(result, number)
        assert again.identical, again.differing
        varied = {name: again.stored[name] for name in result.varied if name in again.trajectory.parameters}
        assert varied.items() <= again.trajectory.parameters.items()


def test_figures_are_those_of_single_simulations() -> None:
    result = springs()
    for number in range(0, 70, 9):
        run = result.run(number)
        path = simulate(
            SPRING,
            [run["x"], 0.0],
            6.0,
            parameters={"k": run["k"]},
            inputs={"r": run["r"]},
            events=(Settling(output="y", target=run["r"]), Crossing(name="turn", expression="v")),
        )
        # Extremes of x, and of u with it, are where it starts and where v passes zero.
        turns = np.array([run["x"], *(event.state[0] for event in path.events if event.signal == "turn")])
        (settled,) = [event.time for event in path.events if event.signal == "y"] or [math.inf]
        assert run["settling_time_y"] == pytest.approx(settled, abs=1e-11)
        way = run["r"] - run["x"]
        assert run["overshoot_y"] == pytest.approx(max(0.0, ((turns - run["r"]) / way).max()), abs=1e-12)
        assert run["peak_u"] == pytest.approx(run["k"] * np.abs(run["r"] - turns).max(), abs=1e-12)
        assert run["settled"] == math.isfinite(run["settling_time_y"])
        assert [run["final_x"], run["final_v"]] == pytest.approx(path.final_state, abs=1e-11)


def test_a_sampled_run_is_bit_for_bit_what_simulate_gives() -> None:
    result = masses()
    run = result.run(11)
    path = simulate(
        SAMPLED,
        [run["x"], 0.0],
        2.0,
        parameters={"m": run["m"]},
        inputs={"goal": run["goal"]},
        seed=int(seeds(MASSES, 11, 12)[0]),
    )
    assert list(path.final_state) == [run["final_x"], run["final_v"]]
    assert list(replay(result, 11).trajectory.final_state) == list(path.final_state)


def test_references_that_change_with_time_may_differ_from_run_to_run() -> None:
    times = np.linspace(0.0, 2.0, 21)
    rows = np.outer([0.5, -1.0, 2.0], np.minimum(times, 1.0))
    plan = Grid(axes={"m": [1.0, 1.5, 2.0]})
    given = {"goal": Held(times=times, values=rows)}
    measures = Measures(outputs=("x",))
    result = sweep(SAMPLED, plan, measures, horizon=2.0, inputs=given, batch_size=2)
    for number in range(3):
        own = {"goal": Held(times=times, values=rows[number])}
        path = simulate(
            SAMPLED,
            [0.0, 0.0],
            2.0,
            parameters={"m": result["m"][number]},
            inputs=own,
            seed=int(seeds(plan, 0, 3)[number]),
        )
        assert result["final_x"][number] == path.final_state[0]
        assert replay(result, number).identical
        assert replay(result, number).trajectory.final_state[0] == path.final_state[0]


def test_a_reference_that_is_a_formula_of_what_varies_is_each_runs_own() -> None:
    given = {"goal": sp.Symbol("m", real=True) * sp.sin(3 * TIME)}
    result = sweep(SAMPLED, Grid(axes={"m": [1.0, 2.0, 3.0]}), Measures(outputs=("x",)), horizon=1.0, inputs=given)
    for number, mass in enumerate((1.0, 2.0, 3.0)):
        own = {"goal": mass * sp.sin(3 * TIME)}
        seed = int(seeds(result.experiment.plan, number, number + 1)[0])
        path = simulate(SAMPLED, [0.0, 0.0], 1.0, parameters={"m": mass}, inputs=own, seed=seed)
        assert result["final_x"][number] == pytest.approx(path.final_state[0], rel=1e-12)
        assert replay(result, number).identical


def test_only_outputs_with_a_target_count_as_settled() -> None:
    """x goes to the goal and v, which has no target, ends at rest; with a target elsewhere it has not settled."""
    vary = Grid(axes={"goal": [0.5, -0.5]})
    loop = replace(SAMPLED, hardware=Hardware(period=0.01))
    for targets, expected in (({"x": "goal"}, 1), ({"x": "goal", "v": 1.0}, 0), ({"v": 1.0}, 0), ({}, 0)):
        result = sweep(loop, vary, Measures(targets=targets), horizon=8.0)
        assert result["settled"].tolist() == [expected] * 2, targets
    watched = sweep(loop, vary, Measures(outputs=("v",), targets={"x": "goal"}), horizon=8.0)
    assert {"steady_error_x", "steady_error_v"} <= {c.name for c in watched.columns}
    assert watched["settled"].tolist() == [1, 1]


@pytest.mark.parametrize("measures", [Measures(samples=40), Measures(targets={"x": "x_ref"}), None])
def test_what_the_controller_drives_need_not_settle(measures: Measures | None) -> None:
    """u = -2 (x - x_ref) + x_ref holds a pull of x_ref: it has nowhere to settle, least of all at 0."""
    plant = system_from_mapping({"states": {"x": "u - x"}, "inputs": {"u": {}}, "outputs": {"x": "x"}})
    law = system_from_mapping(
        {"inputs": {"x": {}, "x_ref": {}}, "outputs": {"u": "x_ref - 2*(x - x_ref)"}, "states": {}}
    )
    result = sweep(Loop(plant=plant, controller=law), Grid(axes={"x_ref": [0.5, -2.0]}), measures, horizon=4.0)
    assert result["settled"].tolist() == [1, 1]
    assert result["peak_u"] == pytest.approx([1.5, 6.0])
    assert result["settling_time_x"] == pytest.approx([math.log(50) / 3] * 2, rel=1e-3)
    assert "settling_time_u" not in {c.name for c in result.columns}


@pytest.mark.parametrize("kind", ["sampled", "continuous"])
def test_windows_hold_the_least_the_most_and_the_mean_of_a_signals_path(kind: str, monkeypatch) -> None:
    monkeypatch.setattr("ulna.campaign.runs.figures.MOST_NUMBERS", 1500)
    windows = (Window(signal="v", begin=0.5, end=1.0), Window(signal="u", begin=0.0, end=1.9, name="whole"))
    plan = Random(vary={"x": Uniform(low=1, high=2)}, runs=9, seed=3)
    measures = Measures(outputs=("x",) if kind == "sampled" else ("y",), windows=windows, samples=190)
    loop, inputs = (SAMPLED, {"goal": 0.0}) if kind == "sampled" else (SPRING, {})
    result = sweep(loop, plan, measures, horizon=1.9, inputs=inputs, batch_size=5)
    for number in (0, 4, 8):
        path = replay(result, number).trajectory
        late = (path.times >= 0.5 - 1e-9) & (path.times <= 1.0 + 1e-9)
        assert late.sum() == 51
        assert result["least_v"][number] == path["v"][late].min()
        assert result["most_v"][number] == path["v"][late].max()
        assert result["mean_v"][number] == pytest.approx(path["v"][late].mean(), rel=1e-13)
        assert result["most_u_whole"][number] == path["u"].max()
        assert replay(result, number).identical
    units = {c.name: c.unit for c in result.columns}
    assert (units["least_v"], units["mean_u_whole"]) == ("m/s", "N" if kind == "sampled" else "m/s^2")


def test_a_run_that_ends_before_a_window_has_no_value_in_it() -> None:
    measures = Measures(windows=(Window(signal="x", begin=0.0, end=5.0),), samples=50)
    result = sweep(RUNAWAY, Grid(axes={"x": [0.5, 1.5]}), measures, horizon=5.0)
    assert result["most_x"][0] == 0.5
    assert np.isnan(result["most_x"][1])


def test_a_target_may_be_the_name_of_whatever_has_one_value() -> None:
    loop = Loop(plant=SPRING)
    for name, value in (("x", 0.5), ("d", 2.0), ("k", 4.0), ("r", 0.25)):
        measures = Measures(outputs=("y",), targets={"y": name})
        result = sweep(loop, Grid(axes={"v": [0.0]}), measures, horizon=1.0, initial={"x": 0.5}, inputs={"r": 0.25})
        assert result["steady_error_y"][0] == pytest.approx(result["final_x"][0] - value, abs=1e-12), name


def test_the_noise_of_each_run_is_its_own() -> None:
    result = sweep(SAMPLED, Grid(axes={"m": [1.0, 1.0 + 1e-15]}), horizon=2.0, initial={"x": 1.0}, inputs={"goal": 0.0})
    assert abs(np.diff(result["final_v"])[0]) > 1e-6


def test_runs_that_blow_up_are_results_with_the_exact_time() -> None:
    result = sweep(RUNAWAY, Grid(axes={"x": [0.5, 1.5, 2.0, -1.0], "c": [1.0, 0.0]}), horizon=5.0)
    assert result["outcome"].tolist() == [0, 0, 1, 0, 1, 0, 0, 0]
    assert result["settled"][[1, 2, 4]].tolist() == [1, 0, 0]
    assert result["end_time"][[2, 4]] == pytest.approx([math.log(3), math.log(2)], abs=1e-9)
    assert result["final_x"][1] == pytest.approx(0.5 * math.exp(-5), rel=1e-10)


def test_an_output_that_starts_on_its_target_settles_where_it_comes_back() -> None:
    result = sweep(SPRING, Grid(axes={"v": [1.0], "d": [2.0, 0.0]}), Measures(outputs=("y",)), horizon=6.0)
    assert result["settled"].tolist() == [1, 0]


def test_results_are_labelled_with_units_and_values_load_when_used() -> None:
    data = springs(batch_size=16).to_xarray()
    assert data["final_v"].attrs["units"] == "m/s"
    assert data["k"].attrs["units"] == "1/s^2"
    assert set(data.coords) == {"run", "x", "k", "r"}
    assert not data["final_v"].variable._in_memory
    whole = data["final_v"].values
    for key in (slice(3, 60, 7), slice(None, None, -1), slice(50, 10, -4), 5, [1, 33, 2]):
        assert np.array_equal(springs(batch_size=16).to_xarray()["final_v"][key].values, whole[key])


def test_tables_and_files_hold_the_same_numbers(tmp_path) -> None:
    import pandas as pd
    import xarray as xr

    result = springs(batch_size=16)
    frame = result.to_pandas()
    read = pd.read_csv(result.to_csv(tmp_path / "runs.csv"), index_col="run")
    pd.testing.assert_frame_equal(read.astype(float), frame.astype(float))
    with xr.open_dataset(result.to_netcdf(tmp_path / "runs.nc"), engine="scipy") as stored:
        assert np.array_equal(stored["peak_u"].values, result["peak_u"])
        assert "settings" in stored.attrs


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Window(signal="x", begin=2.0, end=1.0), "expected 0 <= begin < end"),
        (lambda: Window(signal="x", begin=math.nan, end=1.0), "expected 0 <= begin < end"),
        (
            lambda: Measures(windows=(Window(signal="x", begin=0, end=1), Window(signal="x", begin=1, end=2))),
            "the same name",
        ),
        (lambda: Measures(samples=0), "at least one interval"),
    ],
)
def test_measures_that_make_no_sense_are_one_clear_error(make, reason: str) -> None:
    with pytest.raises(CampaignError, match=reason):
        make()


def plan_of(**vary) -> LatinHypercube:
    return LatinHypercube(vary=vary, runs=4)


ONE = Uniform(low=1, high=2)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"plan": plan_of(kk=ONE)}, "Did you mean k"),
        ({"plan": plan_of(k=Uniform(low=0.5, high=2))}, r"reach from 0.5 to 2, its range is \[1, 9\]"),
        ({"plan": plan_of(k=Normal(mean=4, std=1))}, r"reach from -inf to inf"),
        ({"plan": plan_of(u=ONE)}, "no initial state or parameter"),
        ({"horizon": 0.0}, "positive time"),
        ({"horizon": math.nan}, "positive time"),
        ({"batch_size": 0}, "at least one run"),
        ({"initial": {"y": 1.0}}, "no initial state"),
        ({"initial": {"x": math.nan}}, "finite"),
        ({"parameters": {"k": 20.0}}, "its range"),
        ({"parameters": {"z": 1.0}}, "no parameter"),
        ({"inputs": {"q": 1.0}}, "no constant input"),
        ({"measures": Measures(outputs=("x",))}, "no output"),
        ({"measures": Measures(targets={"y": "goal"})}, "target 'goal'"),
        ({"inputs": {"r": Held(times=np.zeros(1), values=np.ones((1, 1)))}}, "samples for 1 runs, the plan has 4"),
        ({"measures": Measures(windows=(Window(signal="x", begin=0.5, end=3.0),))}, "ends after the run of 1 s"),
        ({"measures": Measures(windows=(Window(signal="x", begin=0.1, end=0.2),), samples=3)}, "no sample lies in it"),
        ({"engine": FixedSteps()}, "a loop without a processor is run by Taylor"),
    ],
)
def test_a_campaign_that_makes_no_sense_is_one_clear_error(arguments: dict, reason: str) -> None:
    given = {"plan": plan_of(k=ONE), "horizon": 1.0, "measures": None} | arguments
    with pytest.raises(CampaignError, match=reason):
        sweep(SPRING, given.pop("plan"), given.pop("measures"), **given)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({}, "references without a value: goal.*inputs={'goal': ...}"),
        ({"inputs": {"goal": 0.0}, "horizon": 0.001}, "the period is longer than the run"),
        ({"inputs": {"goal": 0.0}, "engine": Taylor()}, "a loop with a processor is run by FixedSteps"),
        ({"inputs": {"goal": 0.0, "u": 1.0}}, "no constant input"),
        ({"inputs": {"goal": sp.sin(TIME)}, "measures": Measures(targets={"x": "goal"})}, "it changes with time"),
    ],
)
def test_a_sampled_campaign_that_makes_no_sense_is_one_clear_error(arguments: dict, reason: str) -> None:
    given: dict = {"horizon": 1.0} | arguments
    with pytest.raises(CampaignError, match=reason):
        sweep(SAMPLED, plan_of(m=ONE), **given)


def test_parameters_without_a_value_are_named() -> None:
    open_loop = system_from_mapping({"states": {"x": "-a*x"}, "parameters": {"a": {}}})
    with pytest.raises(CampaignError, match="parameters without a value: a"):
        sweep(open_loop, plan_of(x=ONE), horizon=1.0)
    assert sweep(open_loop, plan_of(a=ONE), horizon=1.0).runs == 4
