"""Many runs of a sampled loop: blocks of runs, blocks shared out to threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.job import Job
from ulna.sim.sampled.loop import LANES, Loop, as_rows, disturbance_table, loop_of, reference_table, samples_of
from ulna.sim.sampled.sampled import Sampled


def sampled_figures(job: Job, settings: Sampled, *, lanes: int = LANES) -> dict[str, Any]:
    """The fields of an `EnsembleResult`.

    Args:
        job: the runs. settings: the loop. lanes: runs of a block; changes the speed, not one bit of the result.

    Raises:
        SimulationError: names that fit nothing.
    """
    count = samples_of(settings, 0.0, job.horizon)
    loop = loop_of(job.plant, settings, job.inputs, lanes=lanes, recording=False)
    wiring = loop.layout.wiring
    runs = len(job.initial)
    _check_own(job, loop)
    # What each run has of its own takes the place of what all share.
    references = reference_table(settings, wiring, count)
    for k, signal in enumerate(wiring.references):
        if signal.name in job.references:
            references[:, k] = 0.0
    zeros = np.zeros(runs)
    own_references = [job.references.get(s.name, zeros) for s in wiring.references]
    own_others = [job.own_inputs.get(s.name, zeros) for s in wiring.others]
    known = {p.name: float(job.parameters[0, k]) for k, p in enumerate(job.plant.parameters)}
    results = np.zeros((runs, len(loop.layout.results())))
    shared = (
        np.ascontiguousarray(job.initial),
        np.ascontiguousarray(job.parameters),
        references,
        as_rows(runs, len(own_references), np.array(own_references).T if own_references else None),
        disturbance_table(job.inputs, settings, wiring, count, known),
        as_rows(runs, len(own_others), np.array(own_others).T if own_others else None),
        job.seeds,
        np.ascontiguousarray(job.targets),
        results,
        np.zeros((1, 1)),
    )

    def work(first: int, last: int) -> None:
        loop.run(first, last, count, loop.values, loop.held, loop.memory, *shared)

    _shared_out(work, runs, lanes, job.threads)
    return _figures(job, loop, results)


def _check_own(job: Job, loop: Loop) -> None:
    wiring = loop.layout.wiring
    names = {s.name for s in wiring.references}
    unknown = [name for name in job.references if name not in names]
    if unknown:
        raise SimulationError(
            "references of the ensemble",
            f"nothing reads {unknown[0]}.",
            f"Give them in Sampled first; known: {', '.join(sorted(names)) or 'none'}.",
        )
    both = [s.name for s in wiring.driven if s.name in job.inputs or s.name in job.own_inputs]
    if both:
        raise SimulationError(f"input '{both[0]}'", "the controller drives it already.", "Leave it out of `inputs`.")


def _shared_out(work: Any, runs: int, lanes: int, threads: int) -> None:
    """Blocks in chunks, more chunks than threads so that all end at about the same time."""
    blocks = -(-runs // lanes)
    threads = min(threads, blocks)
    if threads == 1:
        work(0, runs)
        return
    chunk = lanes * max(1, -(-blocks // (4 * threads)))
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(work, first, min(first + chunk, runs)) for first in range(0, runs, chunk)]:
            done.result()


def _figures(job: Job, loop: Loop, results: np.ndarray) -> dict[str, Any]:
    layout = loop.layout
    table = dict(zip(layout.results(), results.T, strict=True))
    inputs, outputs = range(len(layout.wiring.driven)), range(layout.outputs)
    end = table["end"]

    def columns(stem: str, places: range) -> np.ndarray:
        return np.stack([table[f"{stem}{k}"] for k in places], axis=1) if places else np.zeros((len(results), 0))

    code = table["code"].astype(np.int8)
    target = job.targets[:, : layout.outputs]
    first, last = columns("first", outputs), columns("last", outputs)
    least, most = columns("least", outputs), columns("most", outputs)
    way = target - first
    with np.errstate(divide="ignore", invalid="ignore"):
        progress = np.where(way > 0, (most - first) / way, (least - first) / way)
        rms = np.sqrt(columns("square", inputs) / end[:, None])
    settled = np.where(columns("outside", outputs) == 0.0, columns("settled", outputs), np.inf)
    settled = np.where((code == 0)[:, None], settled, np.inf)
    return {
        "input_names": tuple(s.name for s in layout.wiring.driven),
        "code": code,
        "end_time": end,
        "final_state": columns("x", range(layout.states)),
        "peak_input": columns("peak", inputs),
        "rms_input": rms,
        "settling_time": np.where(way == 0.0, np.nan, settled),
        "overshoot": np.where(way == 0.0, np.nan, np.maximum(0.0, progress - 1.0)),
        "steady_error": last - target,
        "peak_error": np.maximum(np.abs(least - target), np.abs(most - target)),
    }
