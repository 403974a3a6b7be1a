"""Many runs: the same bits whatever the block, the place in it and the threads; the same figures as one run."""

from __future__ import annotations

import math
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from sampled_loops import loop_of, run_loop

from ulna.base import SimulationError
from ulna.loop import TIME, ExactHold, Jitter, Loop, MeasurementNoise, MissedSamples, Quantiser, Saturation
from ulna.program.lowering import numba as cache
from ulna.sim import Crossing, Ends, Ensemble, Formula, Outcome, Settling, Taylor, metrics, simulate
from ulna.sim.sampled import ensemble as engine
from ulna.system import LinearInjection, System, system_from_mapping

ARM = system_from_mapping(
    {
        "name": "arm",
        "states": {"q": "v", "v": "u + d - k*sin(q) + 0*cos(q)"},
        "inputs": {"u": {}, "d": {}},
        "outputs": {"y": "q"},
        "parameters": {"k": {"value": 1}},
    }
)
CONTROLLER = system_from_mapping(
    {
        "name": "controller",
        "states": {"a": "b + 8*(y - a)", "b": "sin(a) - 4*(a - r) - 3*b - sin(y) + 20*(y - a)"},
        "inputs": {"y": {}, "r": {}},
        "outputs": {"u": "sin(a) - 4*(a - r) - 3*b"},
    }
)
ROUGH: dict[str, Any] = {
    "controller": CONTROLLER,
    "period": 0.01,
    "saturation": Saturation(lower=-3.0, upper=3.0),
    "sensors": Quantiser.encoder(bits=12),
    "noise": MeasurementNoise(std=1e-3),
    "clock": (Jitter(width=2e-3), MissedSamples(probability=0.05)),
    "references": {"r": 0.2},
    "bound": 20.0,
    "seed": 5,
}
RUNS = 37


def _random() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    initial = random.uniform(-1.0, 1.0, (RUNS, 2))
    # Some leave the bound: the pendulum runs away under a negative spring.
    return initial, np.where(np.arange(RUNS) % 5 == 0, -400.0, random.uniform(0.5, 1.5, RUNS))


def _same(one: Ensemble, other: Ensemble, rows: np.ndarray | slice = slice(None)) -> bool:
    arrays = [
        f.name
        for f in fields(Ensemble)
        if f.name not in {"system", "plant", "horizon", "input_names", "times", "paths"}
    ]
    return all(np.array_equal(getattr(one, name)[rows], getattr(other, name), equal_nan=True) for name in arrays)


def test_block_size_place_and_threads_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    initial, stiffness = _random()
    seeds = np.arange(100, 100 + RUNS)
    loop = loop_of(ARM, ROUGH)
    whole = run_loop(ARM, initial, 2.0, ROUGH, loop=loop, parameters={"k": stiffness}, seed=seeds, threads=1)
    assert {Outcome.FINISHED, Outcome.BLEW_UP} == {whole.outcome(k) for k in range(RUNS)}
    threads = run_loop(ARM, initial, 2.0, ROUGH, loop=loop, parameters={"k": stiffness}, seed=seeds, threads=3)
    assert _same(whole, threads)
    order = np.random.default_rng(0).permutation(RUNS)[:23]
    mixed = run_loop(ARM, initial[order], 2.0, ROUGH, parameters={"k": stiffness[order]}, seed=seeds[order], threads=2)
    assert _same(whole, mixed, order)
    many = engine.work
    monkeypatch.setattr(engine, "work", lambda *given, **named: many(*given, **named, lanes=1))
    single = run_loop(ARM, initial, 2.0, ROUGH, parameters={"k": stiffness}, seed=seeds)
    assert _same(whole, single)


def test_a_run_of_an_ensemble_is_replayed_by_simulate_bit_for_bit() -> None:
    initial, stiffness = _random()
    many = run_loop(ARM, initial, 2.0, ROUGH, parameters={"k": stiffness})
    for k in (0, 1, 17, RUNS - 1):
        one = run_loop(
            ARM,
            initial[k],
            2.0,
            dict(ROUGH, seed=ROUGH["seed"] + k),
            parameters={"k": stiffness[k]},
            throw=False,
        )
        assert one.outcome is many.outcome(k)
        assert np.array_equal(one.final_state, many.final_state[k])
        if one.outcome is Outcome.FINISHED:
            assert np.abs(one["u"][:-1]).max() == many.peak_input[k, 0]
            figures = metrics(one).outputs["y"]
            assert figures.overshoot == pytest.approx(many.overshoot[k, 0])
            assert figures.steady_error == many.steady_error[k, 0]
            assert figures.peak_error == many.peak_error[k, 0]
            assert figures.settling_time == pytest.approx(many.settling_time[k, 0])


def test_references_disturbances_and_targets_may_differ_from_run_to_run() -> None:
    calm = {"controller": CONTROLLER, "period": 0.01, "references": {"r": 0.0}}
    goals, pushes = np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.05, -0.05])
    many = run_loop(
        ARM,
        [0.0, 0.0],
        12.0,
        calm,
        inputs={"r": goals, "d": pushes},
        targets={"y": goals},
    )
    for k in range(3):
        lone = dict(calm, references={"r": goals[k]})
        one = run_loop(ARM, [0.0, 0.0], 12.0, lone, inputs={"d": pushes[k]})
        assert np.array_equal(one.final_state, many.final_state[k])
    assert many.steady_error[0, 0] == pytest.approx(0.0, abs=1e-3)
    assert math.isfinite(many.settling_time[0, 0])


def test_estimator_and_controller_may_start_differently_in_each_run() -> None:
    calm = {"controller": CONTROLLER, "period": 0.01, "references": {"r": 0.0}, "initial": {"b": 0.3}}
    starts = np.array([0.0, 0.4, -0.7])
    many = run_loop(ARM, [0.5, 0.0], 1.0, calm, start={"a": starts})
    assert len(many) == 3
    assert len(set(many.final_state[:, 0])) == 3
    for k, start in enumerate(starts):
        one = run_loop(ARM, [0.5, 0.0], 1.0, dict(calm, initial={"a": start, "b": 0.3}))
        assert np.array_equal(one.final_state, many.final_state[k])


def test_estimates_of_an_injected_observer_may_start_differently_in_each_run() -> None:
    y, u = sp.symbols("y u", real=True)
    q, v = sp.symbols("q_hat v_hat", real=True)
    observer = system_from_mapping(
        {
            "name": "observer",
            "states": {"a": "b + 8*(y - a)", "b": "u - sin(y) + 20*(y - a)"},
            "inputs": {"u": {}, "y": {}},
            "outputs": {"q_hat": "a", "v_hat": "b - sin(a)"},
        }
    )
    parts = LinearInjection(
        system=observer,
        matrix=sp.ImmutableDenseMatrix([[-8, 1], [-20, 0]]),
        injection=(8 * y, u - sp.sin(y) + 20 * y),
        start=(q, v + sp.sin(q)),
    )
    law = system_from_mapping(
        {"name": "law", "states": {"n": "0"}, "inputs": {"q": {}, "v": {}}, "outputs": {"u": "-4*q - 3*v"}}
    )
    calm = {"controller": law, "estimator": parts, "period": 0.01, "discretisation": ExactHold()}
    guesses = np.array([0.1, 0.7, -0.3])
    many = run_loop(ARM, [0.5, 0.0], 1.0, calm, start={"q_hat": guesses})
    for k, guess in enumerate(guesses):
        one = run_loop(ARM, [0.5, 0.0], 1.0, dict(calm, initial={"q_hat": guess}))
        assert one["q_hat"][0] == pytest.approx(guess)
        assert np.array_equal(one.final_state, many.final_state[k])


def test_states_that_a_loop_does_not_have_are_named() -> None:
    with pytest.raises(SimulationError, match="unknown: c"):
        simulate(Loop(plant=ARM, controller=CONTROLLER), {"q": 0.5, "v": [0.0, 1.0], "c": 1.0}, 1.0)


def test_a_shared_disturbance_may_be_a_formula() -> None:
    calm = {"controller": CONTROLLER, "period": 0.01, "references": {"r": 0.0}}
    push = {"d": Formula(expression=TIME / 10)}
    many = run_loop(ARM, [[0.1, 0.0], [0.2, 0.0]], 1.0, calm, inputs=push)
    assert np.array_equal(run_loop(ARM, [0.2, 0.0], 1.0, calm, inputs=push).final_state, many.final_state[1])


def _stepped(initial: tuple[float, float], count: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """The same loop written by hand in plain Python with the library's sine: (states, codes)."""
    h, q, v, a, b, u, y_old = 0.01, *initial, 0.0, 0.0, 0.0, 0.0

    def rk4(f, x):
        k1 = f(x, 0.0)
        k2 = f([s + h / 2 * d for s, d in zip(x, k1, strict=True)], 0.5)
        k3 = f([s + h / 2 * d for s, d in zip(x, k2, strict=True)], 0.5)
        k4 = f([s + h * d for s, d in zip(x, k3, strict=True)], 1.0)
        return [s + h / 6 * (c + 2 * d + 2 * e + g) for s, c, d, e, g in zip(x, k1, k2, k3, k4, strict=True)]

    def law(a, b):
        return math.sin(a) - 4 * a - 3 * b

    states, codes = [], []
    for k in range(count + 1):
        code = math.floor(q / step + 0.5)
        y = step * code
        if k:
            old, new = y_old, y

            def seen(x, c, old=old, new=new):
                at = old + c * (new - old)
                return [x[1] + 8 * (at - x[0]), law(*x) - math.sin(at) + 20 * (at - x[0])]

            a, b = rk4(seen, [a, b])
        y_old, u = y, min(3.0, max(-3.0, law(a, b)))
        states.append((q, v))
        codes.append(code)
        q, v = rk4(lambda x, _, u=u: [x[1], u - math.sin(x[0])], [q, v])
    return np.array(states), np.array(codes)


def test_two_engines_agree_up_to_the_first_code_that_flips() -> None:
    sensor = Quantiser.encoder(bits=12)
    loop = {
        "controller": CONTROLLER,
        "period": 0.01,
        "saturation": Saturation(lower=-3.0, upper=3.0),
        "sensors": sensor,
        "references": {"r": 0.0},
    }
    run = run_loop(ARM, [1.0, 0.0], 10.0, loop)
    states, codes = _stepped((1.0, 0.0), 1000, sensor.step)
    same = np.rint(run["y_measured"] / sensor.step) == codes
    until = len(same) if same.all() else int(np.argmin(same))
    assert until > 150
    np.testing.assert_allclose(run.states[:until], states[:until], atol=1e-12)


def test_a_continuous_ensemble_has_the_ends_and_figures_of_single_runs() -> None:
    loop = system_from_mapping(
        {
            "name": "loop",
            "states": {"q": "v", "v": "-k*sin(q) - v"},
            "outputs": {"y": "q", "w": "v"},
            "parameters": {"k": {"value": 4}},
        }
    )
    random = np.random.default_rng(1)
    initial, stiffness = random.uniform(0.3, 1.0, (21, 2)), random.uniform(3.0, 5.0, 21)
    taylor = Taylor(tolerance=1e-10)
    many = simulate(loop, initial, 10.0, engine=taylor, parameters={"k": stiffness}, threads=2)
    bare = simulate(loop, initial, 10.0, engine=taylor, parameters={"k": stiffness}, record=Ends())
    np.testing.assert_allclose(bare.final_state, many.final_state, atol=1e-9)
    assert np.isnan(bare.peak_error).all()
    for k in (0, 7, 20):
        turn = Crossing(name="turn", expression="v")
        one = simulate(loop, initial[k], 10.0, parameters={"k": stiffness[k]}, events=(Settling(output="y"), turn))
        np.testing.assert_allclose(many.final_state[k], one.final_state, atol=1e-9)
        turns = np.array([initial[k, 0], *(event.state[0] for event in one.events if event.signal == "turn")])
        (settled,) = [event.time for event in one.events if event.signal == "y"]
        assert many.settling_time[k, 0] == pytest.approx(settled, abs=1e-8)
        assert many.overshoot[k, 0] == pytest.approx(max(0.0, -turns.min() / turns[0]), abs=1e-9)
        assert many.peak_error[k, 0] == pytest.approx(np.abs(turns).max(), abs=1e-9)
        assert many.steady_error[k, 0] == pytest.approx(one.final_state[0], abs=1e-9)


def test_a_continuous_run_that_blows_up_is_one_result_among_others() -> None:
    wild = system_from_mapping({"name": "wild", "states": {"x": "x**2"}, "outputs": {"y": "x"}})
    many = simulate(wild, [[-1.0], [2.0], [-3.0]], 1.0, engine=Taylor(bound=1e6), record=Ends())
    assert many.finished.tolist() == [True, False, True]
    assert many.outcome(1) is Outcome.BLEW_UP
    assert many.end_time[1] == pytest.approx(0.5, abs=1e-5)
    np.testing.assert_allclose(many.final_state[[0, 2], 0], [-0.5, -0.75], rtol=1e-12)


def _tiny() -> tuple[System, dict[str, Any]]:
    plant = system_from_mapping({"name": "tiny", "states": {"x": "u"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    law = system_from_mapping(
        {"name": "tiny law", "states": {"z": "y - z"}, "inputs": {"y": {}}, "outputs": {"u": "-z"}}
    )
    return plant, {"controller": law, "period": 0.1}


def test_a_loop_is_kept_on_disk_and_a_damaged_cache_is_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    cache.compiled.cache_clear()
    plant, loop = _tiny()
    first = run_loop(plant, [1.0], 1.0, loop).final_state
    folder = cache.cache_folder()
    kept = [path for path in folder.rglob("*") if path.is_file()]
    assert folder.is_relative_to(tmp_path)
    assert {path.suffix for path in kept} >= {".py", ".nbi", ".nbc"}
    for path in kept:
        if path.suffix in {".nbi", ".nbc"}:
            path.write_bytes(b"damaged")
    cache.compiled.cache_clear()
    plant, loop = _tiny()
    assert np.array_equal(run_loop(plant, [1.0], 1.0, loop).final_state, first)


def test_a_cache_folder_that_cannot_be_made_is_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", os.fspath(blocked))
    cache.compiled.cache_clear()
    plant, loop = _tiny()
    assert np.isfinite(run_loop(plant, [1.0], 1.0, loop).final_state).all()
