"""Figures, and paths where asked for, of many runs of a loop with a processor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.sim.figures import output_figures
from ulna.sim.sampled.engine import FixedSteps
from ulna.sim.sampled.work import Worked, work
from ulna.sim.starts import Starts


def sampled_figures(
    loop: Loop, engine: FixedSteps, starts: Starts, end: float, *, paths: tuple[str, ...], threads: int
) -> dict[str, Any]:
    """The fields of an `Ensemble`.

    Args:
        loop: with a processor. engine: its settings. starts: what the runs begin with. end: s.
        paths: signals whose samples are kept. threads: how many to use.
    """
    slots = path_slots(loop, paths)
    done = work(loop, engine, starts, end, record=tuple(dict.fromkeys(slots.values())), threads=threads)
    found = _figures(loop, done, starts)
    found["paths"] = {name: done.record[done.made.rows[slot]] for name, slot in slots.items()}
    if paths:
        found["times"] = done.made.fitted.period * np.arange(done.record.shape[2])
    return found


def path_slots(loop: Loop, names: tuple[str, ...]) -> dict[str, str]:
    """The slot of each signal that a record can keep.

    Raises:
        SimulationError: a name that is none.
    """
    wiring = loop.wiring
    known: dict[str, str] = {s.name: f"x{k}" for k, s in enumerate(loop.plant.states)}
    groups: list[tuple[str, str, Any]] = [
        ("{}", "e{}", wiring.estimates),
        ("{}", "z{}", wiring.memory),
        ("{}", "ub{}", wiring.driven),
        ("{}_command", "c{}", wiring.driven),
        ("{}_limited", "h{}_0", wiring.driven),
        ("{}_cut", "cut{}", wiring.driven),
        ("{}_measured", "yn{}", wiring.measured),
        ("{}", "o{}", loop.plant.outputs),
    ]
    for label, slot, signals in groups:
        for k, signal in enumerate(signals):
            known.setdefault(label.format(signal.name), slot.format(k))
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SimulationError(f"Paths('{unknown[0]}')", "the loop has no such signal.", f"Known: {', '.join(known)}.")
    return {name: known[name] for name in names}


def _figures(loop: Loop, done: Worked, starts: Starts) -> dict[str, Any]:
    table: Mapping[str, np.ndarray] = done.made.columns(done.results)
    inputs, outputs = range(len(loop.wiring.driven)), range(len(loop.plant.outputs))

    def columns(stem: str, places: range) -> np.ndarray:
        return np.stack([table[f"{stem}{k}"] for k in places], axis=1) if places else np.zeros((len(done.results), 0))

    code, end = table["code"].astype(np.int8), table["end"]
    first, last, least, most, settled = (columns(s, outputs) for s in ("first", "last", "least", "most", "settled"))
    found = output_figures(starts.targets, first, last, least, most, settled, (code == 0)[:, None])
    return {
        "input_names": tuple(s.name for s in loop.wiring.driven),
        "code": code,
        "end_time": end,
        "final_state": columns("x", range(len(loop.plant.states))),
        "peak_input": columns("peak", inputs),
        "rms_input": np.sqrt(columns("square", inputs) / end[:, None]),
        "settling_time": found.settling_time,
        "overshoot": found.overshoot,
        "steady_error": found.steady_error,
        "peak_error": found.peak_error,
    }
