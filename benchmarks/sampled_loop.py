"""The paper's loop on a processor at 1 kHz, 5 s, ±24 V, 12-bit encoder: time and error, all contenders interleaved.

Peers stand in `sampled_peers.py`. Errors of one run are against the C loop up to the first encoder code that differs,
after which two engines part; with pulses they are against eight steps for each pulse and each pause. Times are those
of the process: other work on the machine counts little.

    python benchmarks/sampled_loop.py [--rounds 10] [--runs 10000]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from sampled_peers import END, LANES, PERIOD, SAMPLES, STEP, casadi_loop, compiled_c, control_loop, scipy_loop

import ulna
from ulna import FixedSteps, Hardware, Loop, Pwm, Quantiser, Saturation, simulate

CARRIERS = 20
START = np.array([1.0, 0.0, 0.0])


def interleaved(tasks: dict[str, Callable[[], Any]], rounds: int) -> dict[str, np.ndarray]:
    """(rounds,) seconds of each task; every round times all of them."""
    for task in tasks.values():
        task()
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            begun = time.process_time()
            task()
            seconds[name].append(time.process_time() - begun)
    return {name: np.array(times) for name, times in seconds.items()}


def shown(title: str, seconds: dict[str, np.ndarray], runs: int, errors: dict[str, str]) -> None:
    base = next(iter(seconds.values()))
    print(f"\n{title:44} {'us a run':>10} {'best':>10} {'ratio':>8}  error")
    for name, spent in seconds.items():
        # Contenders of one round are compared; the slow ones have fewer rounds.
        ratio = np.median(spent / base[: len(spent)])
        each = spent / runs * 1e6
        print(f"{name:44} {np.median(each):10.1f} {each.min():10.1f} {ratio:7.2f}x  {errors.get(name, '')}")


def until_flip(readings: np.ndarray, reference: np.ndarray, states: np.ndarray, truth: np.ndarray) -> str:
    """The largest difference of states up to the first code that differs."""
    same = np.rint(readings / STEP) == np.rint(reference / STEP)
    if same.all():
        return f"{np.abs(states - truth).max():.1e}, no code flipped"
    last = int(np.argmin(same))
    worst = np.abs(states[:last] - truth[:last]).max()
    return (
        f"{worst:.1e} up to the first flipped code at {last * PERIOD:.3f} s, {np.abs(states - truth).max():.1e} in all"
    )


def side_by_side(run: Callable[..., None], initial: np.ndarray, carried: np.ndarray) -> Callable[[], Any]:
    """All runs through a C function that takes `LANES` at a time: (final states, peak inputs)."""
    count = len(initial)
    padded = -(-count // LANES) * LANES
    inertia = 0.09 * carried + 0.06
    rows = [initial[:, 0], (carried + 1.0) / 6.0 * 0.51 / inertia, 0.51 / inertia]
    start, gravity, torque = (np.ascontiguousarray(np.resize(row, padded)) for row in rows)
    ends, peaks = np.zeros((padded, 3)), np.zeros(padded)

    def work() -> Any:
        for first in range(0, padded, LANES):
            chosen = slice(first, first + LANES)
            run(start[chosen], gravity[chosen], torque[chosen], SAMPLES, ends[chosen], peaks[chosen], None)
        return ends[:count], peaks[:count]

    return work


def one_run(loop: Loop, folder: Path, rounds: int) -> None:
    """Every sample kept."""
    alone = compiled_c(folder, 1)
    record, final, peak, one = np.zeros((SAMPLES + 1, 4)), np.zeros((1, 3)), np.zeros(1), np.ones(1)

    def by_hand() -> Any:
        alone(np.ones(1), one, one, SAMPLES, final, peak, record.ctypes.data)

    casadi, controlled = casadi_loop(), control_loop()
    tasks = {
        "C, one run": by_hand,
        "ulna.simulate": lambda: simulate(loop, START, END),
        "CasADi mapaccum": casadi,
    }
    seconds = interleaved(tasks, rounds) | interleaved(
        {"python-control input_output_response": controlled, "SciPy odeint, a period at a time": scipy_loop}, 2
    )
    ours = simulate(loop, START, END)
    errors = {"ulna.simulate": until_flip(ours["y_measured"], record[:, 3], ours.states, record[:, :3])}
    peers = {
        "CasADi mapaccum": casadi,
        "python-control input_output_response": controlled,
        "SciPy odeint, a period at a time": scipy_loop,
    }
    for name, task in peers.items():
        path = task()
        errors[name] = until_flip(path[:, 3], record[:-1, 3], path[:, :3], record[:-1, :3])
    shown("one run", seconds, 1, errors)


def many_runs(loop: Loop, folder: Path, initial: np.ndarray, carried: np.ndarray, rounds: int) -> None:
    """Ends and peak inputs only; random start and load."""
    values = {"m2": carried}
    by_hand = side_by_side(compiled_c(folder, LANES), initial, carried)
    seconds = interleaved(
        {
            f"C, {LANES} runs side by side, one core": by_hand,
            "ulna.simulate, one core": lambda: simulate(loop, initial, END, parameters=values, threads=1),
            "ulna.simulate, all cores": lambda: simulate(loop, initial, END, parameters=values),
        },
        rounds,
    )
    _, peaks = by_hand()
    mine = simulate(loop, initial, END, parameters=values)
    gap = np.abs(mine.peak_input[:, 0] - peaks)
    text = f"peak input: median {np.median(gap):.1e} V, largest {gap.max():.1e} V"
    shown(f"{len(initial)} runs, sampled", seconds, len(initial), {"ulna.simulate, one core": text})


def pulses(loop: Loop, folder: Path, initial: np.ndarray, carried: np.ndarray, rounds: int) -> None:
    """A bridge at 20 kHz: every pulse integrated, or second-order averaging."""
    switched = _with(loop, drive=Pwm(frequency=CARRIERS / PERIOD, supply=24.0, switched=True))
    averaged = _with(loop, drive=Pwm(frequency=CARRIERS / PERIOD, supply=24.0, ripple=True))
    fourth, midpoint = FixedSteps(), FixedSteps(order=2)
    alone = compiled_c(folder, 1, CARRIERS)
    record, final, peak, one = np.zeros((SAMPLES + 1, 4)), np.zeros((1, 3)), np.zeros(1), np.ones(1)
    seconds = interleaved(
        {
            "C, one run": lambda: alone(np.ones(1), one, one, SAMPLES, final, peak, record.ctypes.data),
            "ulna.simulate": lambda: simulate(switched, START, END),
            "ulna.simulate, order 2": lambda: simulate(switched, START, END, engine=midpoint),
            "ulna.simulate, ripple averaged": lambda: simulate(averaged, START, END),
        },
        rounds,
    )
    tight = simulate(switched, START, END, engine=FixedSteps(number=8))
    errors = {}
    contenders = {"": (switched, fourth), ", order 2": (switched, midpoint), ", ripple averaged": (averaged, fourth)}
    for name, (chosen, engine) in contenders.items():
        run = simulate(chosen, START, END, engine=engine)
        errors[f"ulna.simulate{name}"] = until_flip(run["y_measured"], tight["y_measured"], run.states, tight.states)
    errors["C, one run"] = until_flip(record[:, 3], tight["y_measured"], record[:, :3], tight.states)
    shown("one run, 20 kHz pulses", seconds, 1, errors)

    def together(chosen: Loop, engine: FixedSteps) -> Callable[[], Any]:
        return lambda: simulate(chosen, initial, END, engine=engine, parameters={"m2": carried}, threads=1)

    tasks = {f"C, {LANES} runs side by side": side_by_side(compiled_c(folder, LANES, CARRIERS), initial, carried)}
    tasks |= {f"ulna.simulate{name}": together(*each) for name, each in contenders.items()}
    seconds = interleaved(tasks, max(2, rounds // 4))
    shown(f"{len(initial)} runs, 20 kHz pulses, one core", seconds, len(initial), {})


def _with(loop: Loop, **parts: Any) -> Loop:
    """The loop with other hardware."""
    return replace(loop, hardware=replace(loop.hardware, **parts))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--runs", type=int, default=10_000)
    options = parser.parse_args()
    runs, rounds = options.runs, options.rounds
    arm = ulna.model("one_link_arm")
    exact = arm.with_values()
    law = ulna.state_feedback(ulna.controller_form(exact), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(exact), ulna.Poles(-9, -10, -11))
    chip = Hardware(period=PERIOD, saturation=Saturation(lower=-24.0, upper=24.0), sensors=Quantiser(step=STEP))
    loop = Loop(plant=arm, controller=ulna.compensator(law, observer), hardware=chip)
    random = np.random.default_rng(0)
    initial = np.zeros((runs, 3))
    initial[:, 0] = random.uniform(-1.0, 1.0, runs)
    carried = random.uniform(4.5, 5.5, runs)
    few = max(2, rounds // 4)
    with tempfile.TemporaryDirectory() as folder:
        one_run(loop, Path(folder), rounds)
        many_runs(loop, Path(folder), initial, carried, few)
        pulses(loop, Path(folder), initial[: 10 * LANES], carried[: 10 * LANES], rounds)


if __name__ == "__main__":
    main()
