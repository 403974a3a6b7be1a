"""Many runs of a sampled loop: blocks of runs, blocks shared out to threads or handed to a GPU."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.job import Job
from ulna.sim.sampled.constants import memory_rows
from ulna.sim.sampled.gpu import Gpu, run_on_gpu
from ulna.sim.sampled.loop import LANES, Loop, loop_of
from ulna.sim.sampled.sampled import Sampled
from ulna.sim.sampled.tables import Tables, as_rows, disturbance_table, reference_table, samples_of
from ulna.system import Signal


def sampled_figures(job: Job, settings: Sampled, *, lanes: int = LANES, device: Gpu | None = None) -> dict[str, Any]:
    """The fields of an `EnsembleResult`.

    Args:
        job: the runs. settings: the loop. lanes: runs of a block; changes the speed, not one bit of the result.
        device: run there instead of on the processors.

    Raises:
        SimulationError: names that fit nothing, a GPU that is not there.
    """
    count = samples_of(settings, 0.0, job.horizon)
    loop = loop_of(job.plant, settings, job.inputs, lanes=1 if device else lanes, gpu=device is not None)
    _check_own(job, loop)
    tables = _tables(job, settings, loop, count)
    results = np.zeros((len(job.initial), len(loop.results)))
    if device is not None:
        run_on_gpu(loop, device, count, tables, results)
        return _figures(job, loop, results)

    nothing = np.zeros((1, 1))

    def work(first: int, last: int) -> None:
        loop.run(first, last, count, *tables.all(), results, nothing)

    _shared_out(work, len(job.initial), lanes, job.threads)
    return _figures(job, loop, results)


def _tables(job: Job, settings: Sampled, loop: Loop, count: int) -> Tables:
    wiring, runs = loop.layout.wiring, len(job.initial)
    references = reference_table(settings, wiring, count)
    # What each run has of its own takes the place of what all share.
    replaced = [k for k, signal in enumerate(wiring.references) if signal.name in job.references]
    if replaced:
        references = references.copy()
        references[:, replaced] = 0.0
    known = {p.name: float(job.parameters[0, k]) for k, p in enumerate(job.plant.parameters)}
    return Tables(
        settings=loop.values,
        held=loop.held,
        memory=memory_rows(settings, wiring, job.controller, runs),
        initial=as_rows(runs, loop.layout.states, job.initial),
        parameters=np.ascontiguousarray(job.parameters),
        references=references,
        own_references=_own(runs, wiring.references, job.references),
        others=disturbance_table(job.inputs, settings, wiring, count, known),
        own_others=_own(runs, wiring.others, job.own_inputs),
        seeds=job.seeds,
        targets=np.ascontiguousarray(job.targets),
    )


def _own(runs: int, signals: tuple[Signal, ...], given: Mapping[str, np.ndarray]) -> np.ndarray:
    """(runs, signals) what each run adds, 0 where it adds nothing."""
    table = np.zeros((runs, max(1, len(signals))))
    for k, signal in enumerate(signals):
        table[:, k] = given.get(signal.name, 0.0)
    return table


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
    table = dict(zip(loop.results, results.T, strict=True))
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
