"""The bench's own loop against the general sampled loop, and its parts against what they must do."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy as sp
from ulna.studies.prosthesis.lanes import LANES, block

from ulna.plants import preset
from ulna.sim import Quantiser, Sampled, Saturation, simulate
from ulna.studies.prosthesis.designs import joined
from ulna.studies.prosthesis.load_robust_designs import load_robust_design
from ulna.studies.prosthesis.plant import Bench, bench_of
from ulna.studies.prosthesis.tasks import PERIOD, Task
from ulna.studies.prosthesis.trial import compiled_plant, plant_steps, run_loop

COUNT = 1200
SET_POINT = 0.9


def _nominal(bench: Bench) -> np.ndarray:
    return np.array([[float(p.si_value or 0) for p in bench.plant.parameters]])


def _in_the_bench(bench: Bench, *, volts: float, step: float, load: float) -> np.ndarray:
    """(N,) angles of the load-robust design in the bench's loop, from rest in the horizontal without current."""
    design = load_robust_design(bench.preset).compensator
    system = joined("load-robust", design.law, design.observer)
    plant = compiled_plant(bench.plant)
    wall, free = math.inf, bench.value("N") * bench.value("kb")
    hardware = np.array([[step, volts, math.inf, 0.0, math.inf, bench.value("Ra"), free, -wall, wall, 1.0, 1.0]])
    rows = np.zeros((4, COUNT + 1))
    rows[0] = SET_POINT
    nothing = np.zeros(COUNT + 1)
    task = Task(key="x", title="", reference=rows, load=nothing + load, push=nothing, start=0.0, event=0.0)
    none = np.zeros(0)
    memory, start = np.zeros(len(system.states)), np.zeros((1, 3))
    runs = run_loop(
        plant.function,
        plant.numbers(_nominal(bench)),
        system,
        none,
        memory,
        plant_steps(bench),
        start,
        np.zeros(1),
        task,
        np.zeros((1, COUNT + 1)),
        hardware,
    )
    return runs.angle[0]


def _in_general(bench: Bench, *, volts: float, step: float, load: float, delay: float = PERIOD) -> np.ndarray:
    """The same in the loop of `ulna.sim`."""
    design = load_robust_design(bench.preset).compensator
    clock = Sampled(
        controller=design.law.system,
        estimator=design.observer.system,
        period=PERIOD,
        delay=delay,
        plant_steps=plant_steps(bench),
        saturation=Saturation(lower=-volts, upper=volts),
        sensors=Quantiser(step=step),
        references={"y_ref": SET_POINT},
    )
    run = simulate(bench.plant, [0.0] * 3, COUNT * PERIOD, time=clock, inputs={"load": load, "push": 0.0})
    return np.asarray(run["theta"])


@pytest.mark.parametrize("name", ["paper", "bench_servo", "transhumeral_elbow", "human_scale"])
def test_the_benchs_loop_and_the_general_one_move_the_arm_the_same_way(name: str) -> None:
    """Same controller, plant, encoder, limit and delay. The encoder is fine, so that no flipped code parts them."""
    bench = bench_of(preset(name))
    settings = {"volts": 60.0 if math.isinf(bench.voltage) else bench.voltage, "step": 1e-9, "load": 0.0}
    own, general = _in_the_bench(bench, **settings), _in_general(bench, **settings)
    assert np.abs(own - general).max() < 1e-8
    assert np.ptp(own) > 0.5


def test_they_agree_with_a_coarse_encoder_until_the_first_code_that_flips() -> None:
    bench = bench_of(preset("transhumeral_elbow"))
    settings = {"volts": bench.voltage, "step": bench.step, "load": 0.2}
    own, general = _in_the_bench(bench, **settings), _in_general(bench, **settings)
    assert np.abs(own - general)[:200].max() < 1e-10
    assert np.abs(own - general).max() < 4 * bench.step


def test_the_comparison_notices_another_limit_and_another_delay() -> None:
    bench = bench_of(preset("transhumeral_elbow"))
    own = _in_the_bench(bench, volts=6.0, step=1e-9, load=0.0)
    assert np.abs(own - _in_general(bench, volts=6.0, step=1e-9, load=0.0)).max() < 1e-8
    assert np.abs(own - _in_general(bench, volts=7.0, step=1e-9, load=0.0)).max() > 1e-3
    assert np.abs(own - _in_general(bench, volts=6.0, step=1e-9, load=0.0, delay=0.0)).max() > 1e-4


def test_elementary_functions_of_a_block_are_exact_to_a_few_last_bits() -> None:
    x = sp.Symbol("x", real=True)
    made = block("functions", [x], [], [], {"t": sp.tanh(x), "c": sp.cos(x), "s": sp.sin(x)})
    at = np.concatenate([np.logspace(-12, 1.4, 18), -np.logspace(-12, 1.4, 18), [0.0, math.inf, -math.inf, math.nan]])
    out = np.empty(3 * LANES)
    made.function(at, np.empty(0), np.empty(0), out)
    tangent, cosine, sine = out.reshape(3, LANES)
    assert tangent[:36] == pytest.approx([float(mpmath.tanh(v)) for v in at[:36]], rel=2e-15, abs=0)
    assert tangent[36:39].tolist() == [0.0, 1.0, -1.0]
    assert math.isnan(tangent[39])
    assert cosine[:36] == pytest.approx(np.cos(at[:36]), abs=1e-15)
    assert sine[:36] == pytest.approx(np.sin(at[:36]), abs=1e-15)


def test_a_plant_moves_the_same_in_every_place_of_a_block() -> None:
    bench = bench_of(preset("bench_servo"))
    rates = compiled_plant(bench.plant)
    generator = np.random.default_rng(3)
    state, given = np.repeat(generator.normal(size=3), LANES), np.repeat(generator.normal(size=3), LANES)
    numbers = np.repeat(rates.numbers(_nominal(bench))[0], LANES)
    out = np.empty(3 * LANES)
    rates.function(state, given, numbers, out)
    assert (np.ptp(out.reshape(3, LANES), axis=1) == 0).all()
    values = dict(zip(bench.plant.parameter_symbols, _nominal(bench)[0], strict=True))
    values |= dict(zip(bench.plant.state_symbols, state[::LANES], strict=True))
    values |= dict(zip(bench.plant.input_symbols, given[::LANES], strict=True))
    assert out[::LANES] == pytest.approx([float(r.xreplace(values)) for r in bench.plant.inline(bench.plant.rates)])
