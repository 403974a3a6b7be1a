"""The comparison: replays bit for bit on any number of threads; every measure against a case known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from processor import static
from scipy.integrate import solve_ivp

from ulna.base import DesignError, PlantError, SimulationError
from ulna.loop import Loop, applied
from ulna.plants import hold, preset, preset_from_mapping, steady_rise, voltage_range
from ulna.program import to_python
from ulna.sim import FixedSteps
from ulna.sim.references import minimum_jerk
from ulna.sim.sampled.prepared import Shape, prepared
from ulna.studies.prosthesis.baselines import pid
from ulna.studies.prosthesis.comparison import Comparison, compare, plain_results
from ulna.studies.prosthesis.contenders import contenders, tuned_numbers
from ulna.studies.prosthesis.designs import (
    coefficients,
    design_plant,
    gain_numbers,
    load_robust,
    reduced_compensator,
    state_law,
)
from ulna.studies.prosthesis.hardware import hardware_of
from ulna.studies.prosthesis.measures import UNITS, measure
from ulna.studies.prosthesis.plant import Bench, Draws, bench_of, draws_of
from ulna.studies.prosthesis.tasks import PERIOD, Task, tasks_of
from ulna.studies.prosthesis.trial import (
    ANGLE,
    CURRENT,
    LIMITED,
    VOLTAGE,
    Runs,
    control_numbers,
    loop_of,
    plant_steps,
    run_trial,
)

PRESETS = ("paper", "bench_servo", "transhumeral_elbow", "human_scale")


@pytest.fixture(scope="module")
def elbow() -> Bench:
    return bench_of(preset("transhumeral_elbow"))


@pytest.fixture(scope="module")
def found(elbow: Bench) -> Comparison:
    return compare(elbow, count=6, workers=2)


def _task(bench: Bench, key: str) -> Task:
    return next(t for t in tasks_of(bench) if t.key == key)


def _runs(angle: np.ndarray, current: float = 0.0, voltage: float = 0.0) -> Runs:
    values = {ANGLE: angle, CURRENT: current, VOLTAGE: voltage, LIMITED: 0.0}
    return {name: np.broadcast_to(value, angle.shape) for name, value in values.items()}


def test_the_comparison_replays_bit_for_bit_on_one_thread_and_on_two(elbow: Bench, found: Comparison) -> None:
    again = compare(elbow, count=6, workers=1)
    for key, entry in found.entries.items():
        for name in UNITS:
            assert np.array_equal(entry.measured[name], again.entries[key].measured[name], equal_nan=True)
        assert np.array_equal(entry.nominal[ANGLE], again.entries[key].nominal[ANGLE])


def test_another_seed_gives_other_plants_but_the_same_nominal_one(elbow: Bench) -> None:
    first, other = draws_of(elbow, 5, seed=1).parameters, draws_of(elbow, 5, seed=2).parameters
    assert np.array_equal(first[0], other[0])
    assert not np.array_equal(first[1:], other[1:])


def test_more_plants_do_not_change_the_first_ones(elbow: Bench) -> None:
    contender, task = pid(), _task(elbow, "push")
    few, many = (
        run_trial(elbow, contender, tuned_numbers(elbow, contender), task, draws_of(elbow, count)) for count in (3, 5)
    )
    assert np.array_equal(few[ANGLE], many[ANGLE][:3])


def test_all_arms_share_the_compiled_loop_of_a_contender() -> None:
    contender, shape, kept = pid(), Shape(paths=("noise0",)), ("x0", "x2", "ub0", "cut0")
    made = []
    for bench in (bench_of(preset(name)) for name in PRESETS):
        numbers = control_numbers(bench, contender, tuned_numbers(bench, contender))
        engine = FixedSteps(number=plant_steps(bench))
        made.append(prepared(loop_of(bench, contender), engine, shape, numbers, lanes=40, record=kept))
    assert len({each.run for each in made}) == 1
    assert len({each.numbers.tobytes() for each in made}) == len(PRESETS)


def test_finer_steps_of_the_plant_change_next_to_nothing(elbow: Bench) -> None:
    """The encoder's steps are made fine, so that no flipped code hides or inflates the difference."""
    fine = replace(elbow, step=1e-9)
    contender = load_robust(full=False)
    chosen, draws = tuned_numbers(elbow, contender), draws_of(elbow, 2)
    task = _task(elbow, "reach")
    coarse, finer = (run_trial(fine, contender, chosen, task, draws, finer=n) for n in (1, 4))
    assert np.abs(coarse[ANGLE] - finer[ANGLE]).max() < 1e-6


@pytest.mark.parametrize("name", PRESETS)
def test_the_lumped_design_plant_is_the_benchs_nominal_plant_at_rest(name: str) -> None:
    """Everywhere but for the gear, which a moving arm may drive back."""
    bench = bench_of(preset(name))
    values = {p.symbol: p.si_value for p in bench.plant.parameters}
    values |= {sp.Symbol("load", real=True): sp.Integer(0), sp.Symbol("push", real=True): sp.Integer(0)}
    lumps = {sp.Symbol(k, real=True): v for k, v in bench.lumps.items()}
    at = {"theta": 0.3, "omega": 0.0, "i": 0.7, "u": 2.5}

    def rates() -> tuple[list[float], list[float]]:
        point = {sp.Symbol(k, real=True): v for k, v in at.items()}
        own = [float(r.xreplace(values).xreplace(point)) for r in bench.plant.inline(bench.plant.rates)]
        return own, [float(r.xreplace(lumps).xreplace(point)) for r in design_plant().rates]

    own, lumped = rates()
    assert own == pytest.approx(lumped, rel=1e-12)
    # The current pushes down, the arm goes up: it drives the gear, which then gives more than η times the torque.
    at["omega"] = -10.0
    own, lumped = rates()
    lossless = bench.value("eta") == 1
    more = (1 / bench.value("eta_b") - bench.value("eta")) * bench.value("N") * bench.value("km") * 0.7
    inertia = bench.value("eta") * bench.value("N") * bench.value("km") / bench.lumps["c3"]
    assert own[1] - lumped[1] == pytest.approx(more / inertia, rel=0.2, abs=1e-12)
    assert lossless or own[1] > lumped[1]


@pytest.mark.parametrize("name", PRESETS)
def test_the_nominal_plant_at_rest_is_held_with_the_current_known_by_hand(name: str) -> None:
    bench = bench_of(preset(name))
    contender = next(c for c in contenders(bench) if c.key == "load_robust")
    task = _task(bench, "push")
    runs = run_trial(bench, contender, tuned_numbers(bench, contender), task, draws_of(bench, 2))
    still = runs[CURRENT][0, 500:990].mean()
    assert -still == pytest.approx(hold(bench.preset).current, rel=0.02)


def test_the_load_robust_contender_forgets_the_load_and_the_reduced_one_does_not(elbow: Bench) -> None:
    """With the same poles; the offset of the reduced one is where its spring balances the weight it does not know."""
    chosen, task, draws = {"law_pole": 20.0, "observer_pole": 100.0}, _task(elbow, "pick_up"), draws_of(elbow, 6)
    robust, reduced = (
        measure(elbow, task, run_trial(elbow, contender, chosen, task, draws))["steady_error"]
        for contender in (load_robust(full=False), reduced_compensator())
    )
    assert robust.max() < 0.2
    assert reduced.min() > 1.0


def test_a_common_controller_can_win(found: Comparison) -> None:
    """Ranking looks at numbers alone: with the others' numbers made bad, the PID is the best."""
    entries = {
        key: replace(e, measured={m: v + (0.0 if e.contender.key == "pid" else 1e3) for m, v in e.measured.items()})
        for key, e in found.entries.items()
    }
    best = replace(found, entries=entries).best("reach", "rms_error", 0.95)
    assert best is not None
    assert best.key == "pid"


def test_an_arm_that_lies_on_its_stop_without_a_tremor_wins_nothing(found: Comparison) -> None:
    still = {**found.entries["pid", "hold"].measured, "rms_error": np.full(6, 50.0), "ripple": np.zeros(6)}
    entries = {**found.entries, ("pid", "hold"): replace(found.entries["pid", "hold"], measured=still)}
    ranked = replace(found, entries=entries).ranked("hold", "ripple", 0.95)
    assert "pid" not in {contender.key for contender, _ in ranked}
    assert [value for _, value in ranked] == sorted(value for _, value in ranked)


def test_plain_results_hold_every_task_contender_and_measure(found: Comparison) -> None:
    tasks = plain_results(found)["tasks"]
    assert isinstance(tasks, dict)
    assert {len(of_task) for of_task in tasks.values()} == {7}
    assert set(tasks["hold"]["pid"]) == set(UNITS)
    assert tasks["hold"]["pid"]["rise"]["nominal"] is None
    values = [v for of_task in tasks.values() for c in of_task.values() for m in c.values() for v in m.values()]
    assert all(v is None or math.isfinite(v) for v in values)


def test_tasks_stay_inside_the_range_of_motion_and_speed() -> None:
    for name in PRESETS:
        bench = bench_of(preset(name))
        for task in tasks_of(bench):
            assert task.reference[0].min() >= bench.motion.lower
            assert task.reference[0].max() <= bench.motion.upper
            assert np.abs(task.reference[1]).max() <= bench.motion.speed * (1 + 1e-9)


def test_a_set_point_outside_the_range_of_motion_is_refused(elbow: Bench) -> None:
    with pytest.raises(SimulationError, match="range of motion"):
        minimum_jerk(0.0, math.radians(80), limits=elbow.motion)


def test_a_preset_that_cannot_lift_its_load_is_refused_with_its_torque_margin() -> None:
    weak = preset("bench_servo")
    data = {
        "parameters": {p.name: {"value": p.value, "unit": p.unit} for p in weak.parameters},
        "limits": {"voltage": {"value": 6.0, "unit": "V"}},
    }
    data["parameters"]["m2"] = {"value": 5, "unit": "kg"}
    with pytest.raises(PlantError, match="N m"):
        bench_of(preset_from_mapping("weak", data))


def test_a_preset_that_was_never_tuned_is_refused(elbow: Bench) -> None:
    other = replace(elbow, preset=replace(elbow.preset, name="nobody"))
    with pytest.raises(DesignError, match="tuning"):
        tuned_numbers(other, pid())


def test_measures_of_a_reach_made_of_straight_lines(elbow: Bench) -> None:
    task = _task(elbow, "reach")
    start, target = task.reference[0, 0], task.reference[0, -1]
    times = task.times
    # From start to 10 % beyond the target between 0.2 s and 1.2 s, back on it at 1.4 s.
    progress = np.interp(times, [0.2, 1.2, 1.4], [0.0, 1.1, 1.0])
    found = measure(elbow, task, _runs((start + progress * (target - start))[None, :]))
    assert found["overshoot"][0] == pytest.approx(10.0, abs=0.01)
    assert found["rise"][0] == pytest.approx(0.8 / 1.1, abs=2e-3)
    way = abs(math.degrees(target - start))
    assert found["settling"][0] == pytest.approx(1.2 - 0.2 * (1.0 / way) / 0.1, abs=2e-3)
    assert found["steady_error"][0] == pytest.approx(0.0, abs=1e-9)


def test_a_motion_that_never_arrives_never_settles(elbow: Bench) -> None:
    task = _task(elbow, "reach")
    stuck = np.full((1, task.count + 1), task.reference[0, 0])
    lost = np.full((1, task.count + 1), math.nan)
    for angle in (stuck, lost):
        found = measure(elbow, task, _runs(angle))
        assert math.isinf(found["settling"][0])
        assert math.isinf(found["rise"][0])


def test_energy_power_and_heat_of_a_constant_current(elbow: Bench) -> None:
    task = _task(elbow, "hold")
    still = np.zeros((1, task.count + 1))
    found = measure(elbow, task, _runs(still, 1.5, 2.0))
    assert found["energy"][0] == pytest.approx(30.0, rel=1e-3)
    assert found["power"][0] == pytest.approx(3.0)
    assert found["rms_current"][0] == pytest.approx(1.5)
    # Settled from the start: a brake takes over after half a second.
    assert found["power_with_brake"][0] == pytest.approx(0.15, rel=0.01)
    heating = elbow.preset.heating
    assert heating is not None
    without_copper = replace(heating, copper=sp.Integer(0))
    final = steady_rise(without_copper, elbow.value("Ra"), 1.5)
    assert 0 < found["warming"][0] < final
    r_wh, r_ha, c_w, c_h = (
        float(v)
        for v in (
            heating.winding_to_housing,
            heating.housing_to_ambient,
            heating.winding_capacity,
            heating.housing_capacity,
        )
    )
    loss = elbow.value("Ra") * 1.5**2

    def flow(_time: float, rise: np.ndarray) -> list[float]:
        across = (rise[0] - rise[1]) / r_wh
        return [(loss - across) / c_w, (across - rise[1] / r_ha) / c_h]

    solved = solve_ivp(flow, (0.0, 10.0), [0.0, 0.0], rtol=1e-10, atol=1e-12)
    assert found["warming"][0] == pytest.approx(solved.y[0, -1], rel=1e-6)


def test_the_ripple_hears_eight_hertz_and_not_one(elbow: Bench) -> None:
    task = _task(elbow, "hold")
    tremor, slow = (np.radians(np.sin(2 * np.pi * f * task.times))[None, :] for f in (8.0, 0.5))
    assert measure(elbow, task, _runs(tremor))["ripple"][0] == pytest.approx(1 / math.sqrt(2), rel=0.05)
    assert measure(elbow, task, _runs(slow))["ripple"][0] < 0.02


def test_the_drive_gives_no_more_than_its_limits(elbow: Bench) -> None:
    contender = pid()
    hard = {"pid_p": 3000.0, "pid_i": 1.0, "pid_d": 0.1}
    runs = run_trial(elbow, contender, hard, _task(elbow, "reach"), draws_of(elbow, 4))
    assert np.abs(runs[VOLTAGE]).max() <= elbow.voltage
    assert np.abs(runs[CURRENT][:, 1:]).max() <= 1.02 * elbow.current
    assert runs[LIMITED].any()


@pytest.mark.parametrize("name", PRESETS)
def test_the_drives_bounds_are_those_of_its_battery_then_of_its_current_limit(name: str) -> None:
    """As an electrician counts: no more than supply and cells give behind their resistance; then no current beyond."""
    bench = bench_of(preset(name))
    plant = {p.name: float(p.si_value or 0) for p in bench.plant.parameters}
    loop = Loop(plant=bench.plant, controller=static("follow", ["y"], {"u": "y"}), hardware=hardware_of(bench))
    drive = applied(loop.fit({}))
    evaluate, numbers = to_python(drive), dict(loop.fit({}).numbers)
    numbers |= {f"plant_p{k}": value for k, value in enumerate(plant.values())}
    generator = np.random.default_rng(3)
    cut = 0
    for omega, current, wanted in generator.uniform([-4, -6, -40], [4, 6, 40], (200, 3)):
        low, high = -bench.voltage, bench.voltage
        if bench.preset.battery is not None:
            lowest, highest = voltage_range(bench.preset.battery, current)
            low, high = max(low, lowest), min(high, highest)
        emf, most = plant["N"] * plant["kb"] * omega, plant["Ra"] * bench.current
        high, low = min(high, max(low, emf + most)), max(low, min(high, emf - most))
        known = {**numbers, "x0": 0.0, "x1": omega, "x2": current, "late0": wanted, "early0": wanted}
        found = dict(zip(drive.outputs, evaluate(*(known[n] for n in drive.inputs)), strict=True))
        assert found["ub0"] == pytest.approx(min(max(wanted, low), high), rel=1e-12)
        assert found["cut0"] == (found["ub0"] != wanted)
        cut += found["cut0"]
    assert cut == 0 if name == "paper" else 20 < cut < 200


def test_a_controller_that_loses_itself_gives_nothing(elbow: Bench) -> None:
    lost = {"law_scale": 60.0, "law_third": 30000.0}
    runs = run_trial(elbow, state_law(), lost, _task(elbow, "push"), draws_of(elbow, 2))
    assert np.isfinite(runs[ANGLE]).all()
    assert runs[ANGLE].min() >= elbow.walls[0]
    assert runs[ANGLE].max() <= elbow.walls[1]


def test_named_gains_place_the_poles_that_were_chosen() -> None:
    numbers = gain_numbers(state_law(), {"law_scale": 1.0, "law_third": 8.0})
    assert [numbers[f"k{k}"] for k in range(3)] == pytest.approx([128.0, 48.0, 12.0])
    robust = gain_numbers(load_robust(full=False), {"law_pole": 10.0, "observer_pole": 50.0})
    assert sorted(np.roots([1, robust["k1"], robust["k0"]]).real) == pytest.approx([-9.0, -9.0])
    observer = np.roots([1, robust["l2"], robust["l1"], robust["l0"]])
    assert sorted(observer.real) == pytest.approx([-55.0, -50.0, -45.0])
    assert coefficients([-9.0, -10.0, -11.0]) == pytest.approx([990.0, 299.0, 30.0])


def test_the_plants_steps_are_short_enough_for_the_current() -> None:
    for name in PRESETS:
        bench = bench_of(preset(name))
        warmest: Draws = draws_of(bench, 50)
        resistance = warmest.parameters[:, [p.name for p in bench.plant.parameters].index("Ra")].max()
        assert PERIOD / plant_steps(bench) * resistance / bench.value("La") < 2.78
