"""MuJoCo and Pinocchio build the same arm from its parameters; the controller, unchanged, closes the loop on them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from independent_arm import Plant, mujoco_plant, mujoco_steps, pinocchio_plant
from processor import Processor

from ulna.plants import arm_with_drive, preset
from ulna.sim import simulate
from ulna.studies.prosthesis.contenders import contenders, tuned_numbers
from ulna.studies.prosthesis.plant import Bench, bench_of, draws_of
from ulna.studies.prosthesis.tasks import PERIOD, Task, tasks_of
from ulna.studies.prosthesis.trial import (
    ANGLE,
    control_numbers,
    encoder_noise,
    first_memory,
    inputs_of,
    loop_of,
    plant_steps,
    run_trial,
    starts_at_rest,
)

PRESETS = ("paper", "bench_servo", "transhumeral_elbow", "human_scale")
ENGINES = {"mujoco": mujoco_plant, "pinocchio": pinocchio_plant}


def _numbers(bench: Bench) -> dict[str, float]:
    return {p.name: float(p.si_value or 0) for p in bench.plant.parameters}


def _shorter(task: Task, count: int) -> Task:
    return Task(
        key=task.key,
        title=task.title,
        reference=np.ascontiguousarray(task.reference[:, : count + 1]),
        load=task.load[: count + 1],
        push=task.push[: count + 1],
        start=task.start,
        event=task.event,
        reaches=task.reaches,
    )


def _angle_with(plant: Plant, bench: Bench, key: str, task: Task) -> tuple[np.ndarray, np.ndarray]:
    """(N,) angles of the bench's own plant in its compiled loop, and of the other one around the processor's step."""
    contender = next(c for c in contenders(bench) if c.key == key)
    chosen, draws = tuned_numbers(bench, contender), draws_of(bench, 2)
    own = run_trial(bench, contender, chosen, task, draws)[ANGLE][0]
    loop = loop_of(bench, contender)
    begin = {name: value[:1] for name, value in zip(_numbers(bench), draws.parameters.T, strict=True)}
    start = {name: float(value[0]) for name, value in starts_at_rest(task, begin).items()}
    memory = first_memory(bench, contender, chosen, task)
    slots = {f"z{k}": memory.get(s.name, 0.0) for k, s in enumerate(loop.wiring.memory)}
    slots |= {f"plant_p{k}": float(value[0]) for k, value in enumerate(begin.values())}
    held = dict.fromkeys(("believed0", "ub0", "h0_0", "h0_1"), start["u"])
    processor = Processor(loop, control_numbers(bench, contender, chosen), **slots, **held)
    references = np.array([inputs_of(loop, task)[s.name].values for s in loop.references])
    noise = encoder_noise(bench.step, task.key, task.count, draws).values[0]
    state = np.array([start[s.name] for s in bench.plant.states])
    angles = []
    for k in range(task.count + 1):
        angles.append(state[0])
        seen = {"y": state[0] + noise[k], "omega": state[1], "i": state[2]}
        given = {f"y{j}": float(seen[s.name]) for j, s in enumerate(loop.wiring.measured)}
        given |= {f"x{j}": float(value) for j, value in enumerate(state)}
        given |= {f"r{j}": float(value) for j, value in enumerate(references[:, k])}
        applied = processor.sample(**given)["ub0"]
        state = _moved(plant, state, np.array([applied, task.load[k], task.push[k]]), plant_steps(bench))
    return own, np.array(angles)


def _moved(plant: Plant, state: np.ndarray, given: np.ndarray, steps: int) -> np.ndarray:
    """A period of classical Runge-Kutta steps."""

    def rates(at: np.ndarray) -> np.ndarray:
        found = np.empty(3)
        plant(at, given, np.zeros(1), found)
        return found

    h = PERIOD / steps
    for _ in range(steps):
        k1 = rates(state)
        k2 = rates(state + h / 2 * k1)
        k3 = rates(state + h / 2 * k2)
        k4 = rates(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("engine", ENGINES)
def test_the_rates_agree_at_random_states(name: str, engine: str) -> None:
    bench = bench_of(preset(name))
    plant = ENGINES[engine](_numbers(bench))
    symbols = [*bench.plant.state_symbols, *bench.plant.input_symbols, *bench.plant.parameter_symbols]
    generator = np.random.default_rng(5)
    found = np.empty(3)
    for _ in range(20):
        state = generator.uniform([-1.5, -4, -5], [1.5, 4, 5])
        given = np.array([generator.uniform(-6, 6), generator.uniform(0, 1), generator.uniform(-1, 1)])
        plant(state, given, np.zeros(1), found)
        at = dict(zip(symbols, [*state, *given, *_numbers(bench).values()], strict=True))
        wanted = [float(rate.xreplace(at)) for rate in bench.plant.inline(bench.plant.rates)]
        assert found == pytest.approx(wanted, rel=1e-11, abs=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("name", "key", "task"),
    [
        ("transhumeral_elbow", "load_robust", "reach"),
        ("transhumeral_elbow", "load_robust", "pick_up"),
        ("human_scale", "reduced", "push"),
        ("human_scale", "pid", "reach"),
        ("paper", "load_robust", "pick_up"),
        ("paper", "compensator", "reach"),
        ("paper", "state_feedback", "push"),
    ],
)
def test_the_controller_unchanged_moves_the_other_plant_the_same_way(
    engine: str, name: str, key: str, task: str
) -> None:
    bench = bench_of(preset(name))
    chosen = _shorter(next(t for t in tasks_of(bench) if t.key == task), 1500)
    own, other = _angle_with(ENGINES[engine](_numbers(bench)), bench, key, chosen)
    assert np.abs(own - other).max() < 1e-10
    assert np.ptp(own) > 1e-4


def test_an_arm_built_with_another_mass_is_noticed() -> None:
    bench = bench_of(preset("transhumeral_elbow"))
    numbers = {**_numbers(bench), "m1": 1.001 * bench.value("m1")}
    task = _shorter(tasks_of(bench)[0], 800)
    own, other = _angle_with(mujoco_plant(numbers), bench, "load_robust", task)
    assert np.abs(own - other).max() > 1e-6


def test_mujocos_own_steps_with_the_electrical_equation_inside_follow_the_equations() -> None:
    arm = preset("transhumeral_elbow")
    numbers = _numbers(bench_of(arm))
    start, voltage, seconds = np.array([0.8, 0.0, 0.0]), -3.0, 0.6
    times = np.linspace(0.0, seconds, 61)
    exact = simulate(arm_with_drive(arm), start.tolist(), times, inputs={"u": voltage})
    errors = []
    for timestep in (1e-4, 5e-5):
        rows = mujoco_steps(numbers, voltage, start, seconds=seconds, timestep=timestep)
        errors.append(float(np.abs(rows[:: round(0.01 / timestep), 0] - exact["theta"]).max()))
    assert errors[1] < 1e-9
    # Fourth order: half the step, a sixteenth of the error.
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def _errors_of_angle(name: str, voltage: float, seconds: float, timestep: float) -> tuple[float, float]:
    """Largest error in rad with the current's rate held over a mechanical step, and with it inside the step."""
    numbers = _numbers(bench_of(preset(name)))
    start, finer = np.array([0.8, 0.0, 0.0]), 8
    fine = mujoco_steps(numbers, voltage, start, seconds=seconds, timestep=timestep / finer)[::finer, 0]
    held, inside = (
        mujoco_steps(numbers, voltage, start, seconds=seconds, timestep=timestep, held=way)[:, 0]
        for way in (True, False)
    )
    return float(np.abs(held - fine).max()), float(np.abs(inside - fine).max())


def test_the_electrical_equation_held_over_a_mechanical_step_is_wrong_to_first_order() -> None:
    """On the paper's arm, La/Ra = 100 ms: 2e-2 rad at steps of 10 ms, and in proportion to the step below."""
    errors = {step: _errors_of_angle("paper", -15.0, 1.0, step) for step in (1e-2, 5e-3, 1e-3)}
    assert errors[1e-2][0] == pytest.approx(2e-2, rel=0.1)
    assert errors[1e-2][0] / errors[5e-3][0] == pytest.approx(2.0, rel=0.02)
    assert errors[1e-2][0] / errors[1e-3][0] == pytest.approx(10.0, rel=0.05)
    assert errors[1e-2][1] < 2e-7
    assert errors[1e-3][1] < 1e-10


def test_on_a_real_motor_the_held_equation_is_wrong_earlier_and_blows_up_from_twice_the_electrical_time_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log of the blow-up where it runs
    """La/Ra is 0.2 ms: at 0.1 ms held is thousands of times worse than inside; at 1 ms it gives no answer."""
    held, inside = _errors_of_angle("transhumeral_elbow", -3.0, 0.3, 1e-4)
    assert held > 1000 * inside
    numbers = _numbers(bench_of(preset("transhumeral_elbow")))
    rows = mujoco_steps(numbers, -3.0, np.array([0.8, 0.0, 0.0]), seconds=0.02, timestep=1e-3, held=True)
    assert np.abs(rows[:, 1]).max() > 1e3
