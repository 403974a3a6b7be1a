"""Runs of a loop with a processor: blocks of runs, blocks shared out to threads or handed to a GPU."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.sim.sampled.engine import FixedSteps
from ulna.sim.sampled.enough import refine
from ulna.sim.sampled.gpu import run_on_gpu
from ulna.sim.sampled.prepared import HEAD, LANES, Prepared, prepared
from ulna.sim.sampled.tables import begin_table, path_table, samples_of, shape_of, shared_table
from ulna.sim.starts import Starts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Worked:
    """What a compiled loop answers.

    Attributes:
        made: the loop. results: (N, columns), see `Prepared.columns`. record: (rows, N, samples) of `made.record`.
        last: number of the last sample of a lone run. steps: (N,) of each stretch of constant input.
    """

    made: Prepared
    results: np.ndarray
    record: np.ndarray
    last: int
    steps: np.ndarray


def work(
    loop: Loop,
    engine: FixedSteps,
    starts: Starts,
    end: float,
    *,
    record: tuple[str, ...] | None = (),
    threads: int = 1,
    lanes: int | None = None,
) -> Worked:
    """The runs from 0 to the end.

    Args:
        loop: with a processor. engine: its settings. starts: what the runs begin with. end: s.
        record: slots to keep at every sample, None for all of interest. threads: how many to use.
        lanes: runs of a block; changes the speed, not one bit of the result. By default 1 for a lone run.

    Raises:
        SimulationError: names that fit nothing, a GPU that is not there.
    """
    runs = len(starts.initial)
    period = loop.fit(starts.controller).period
    count = samples_of(period, 0.0, end)
    _check_driven(loop, starts)
    side = lanes or (1 if runs == 1 or engine.device is not None else LANES)
    made = prepared(loop, engine, shape_of(loop, starts.inputs), starts.controller, lanes=side, record=record)
    results = np.zeros((runs, len(HEAD) + len(made.results)))
    kept = np.empty((len(made.record), runs, count + 1) if made.record else (1, 1, 1))
    if runs > 1:
        kept.fill(np.nan)
    arrays = (
        made.numbers,
        begin_table(loop, made, starts),
        shared_table(loop, made, starts, count),
        path_table(loop, made, starts, count),
        starts.seeds,
    )
    last = _run(made, engine, count, arrays, results, kept, (side, threads))

    def again(rows: np.ndarray, steps: int) -> None:
        nonlocal last
        numbers, begin, shared, paths, seeds = arrays
        numbers = numbers.copy()
        numbers[made.steps] = steps
        own = np.ascontiguousarray(paths[:, :, rows]) if made.blocks.paths else paths
        answer = np.zeros((len(rows), results.shape[1]))
        path = np.full((kept.shape[0], len(rows), kept.shape[2]), np.nan) if made.record else kept
        some = (numbers, begin[rows], shared, own, seeds[rows])
        last = _run(made, engine, count, some, answer, path, (side, threads))
        results[rows] = answer
        if made.record:
            kept[:, rows] = path

    steps = refine(made, engine, results, again)
    return Worked(made=made, results=results, record=kept, last=last, steps=steps)


def _run(
    made: Prepared,
    engine: FixedSteps,
    count: int,
    arrays: tuple[np.ndarray, ...],
    results: np.ndarray,
    kept: np.ndarray,
    shares: tuple[int, int],
) -> int:
    """Fill results and record; the number of the last sample of a lone run. shares: lanes and threads."""
    if engine.device is not None:
        run_on_gpu(made.run, engine.device, count, arrays, results)
        return count
    last = count

    def part(first: int, until: int) -> None:
        nonlocal last
        last = made.run(first, until, count, *arrays, results, kept)

    _shared_out(part, len(results), *shares)
    return last


def _check_driven(loop: Loop, starts: Starts) -> None:
    both = [s.name for s in loop.wiring.driven if s.name in starts.inputs or s.name in starts.own]
    if both:
        raise SimulationError(f"input '{both[0]}'", "the controller drives it already.", "Leave it out of `inputs`.")
    missing = [name for name in loop.required if name not in starts.inputs and name not in starts.own]
    if missing:
        raise SimulationError(
            f"input '{missing[0]}' of '{loop.wiring.name}'",
            "nothing in the loop feeds it.",
            f"Give it: inputs={{'{missing[0]}': ...}}; the plant measures "
            f"{', '.join(s.name for s in loop.plant.outputs) or 'nothing'}.",
        )


def _shared_out(part: Callable[[int, int], None], runs: int, lanes: int, threads: int) -> None:
    """Blocks in chunks, more chunks than threads so that all end at about the same time."""
    blocks = -(-runs // lanes)
    threads = min(threads, blocks)
    if threads == 1:
        part(0, runs)
        return
    chunk = lanes * max(1, -(-blocks // (4 * threads)))
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(part, first, min(first + chunk, runs)) for first in range(0, runs, chunk)]:
            done.result()
