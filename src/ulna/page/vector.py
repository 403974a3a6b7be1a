"""A recorded run of `simulate`, which the page runs again to show that it computes the same."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ulna.base import SimulationError, UlnaError
from ulna.deploy import Compiled, c_project
from ulna.loop import Loop
from ulna.program import Plain, Precision
from ulna.sim import Held, Trajectory, simulate
from ulna.system import System

MOST_SAMPLES = 1_000_000
ROWS = 200
"""Samples at most that are compared one by one; all of them enter the sum."""
CLOSE = 1e-4
"""Relative to a signal's largest value: without a processor the page integrates by other steps than `simulate`."""

FAR = 100.0
"""Times the size at the start beyond which a run without a processor is not compared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Begin:
    """What a recorded run begins with: SI values by name.

    Attributes:
        states: of the plant, of a continuous loop all. memory: of the controller; driven inputs.
        inputs: references and disturbances. parameters: of the plant.
    """

    states: Mapping[str, float]
    memory: Mapping[str, float]
    inputs: Mapping[str, float]
    parameters: Mapping[str, float]


def numbers(values: Any) -> str:
    """Doubles as text: base64 of their bytes, the lowest first."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")


def summed(rows: np.ndarray) -> int:
    """Σ word · (2654435761 · place | 1) modulo 2³² over the 32-bit words of all numbers, row after row."""
    words = np.ascontiguousarray(rows, dtype="<f8").view("<u4").ravel().astype(np.uint64)
    places = np.arange(1, len(words) + 1, dtype=np.uint64)
    factors = (places * np.uint64(0x9E3779B1) & np.uint64(0xFFFFFFFF)) | np.uint64(1)
    return int((words * factors & np.uint64(0xFFFFFFFF)).sum() & np.uint64(0xFFFFFFFF))


def sampled_vector(loop: Loop, places: Mapping[str, int], begin: Begin, seconds: float) -> dict[str, Any]:
    """The recorded run of a loop with a processor in plain arithmetic.

    Raises:
        UlnaError: what `simulate` raises.
    """
    period = loop.fit({}).period
    if seconds / period > MOST_SAMPLES:
        found = f"{seconds:g} s are {seconds / period:.3g} samples; at most {MOST_SAMPLES:.0e} are recorded."
        raise SimulationError("the recorded run of a page", found, "Sample more slowly, or record less.")
    samples = max(1, round(seconds / period))
    noise = _noise(loop, samples)
    inputs: dict[str, Any] = dict(begin.inputs)
    at = period * np.arange(samples + 1)
    inputs |= {f"{loop.wiring.measured[k].name}_noise": Held(times=at, values=row) for k, row in noise.items()}
    run = _run(loop, begin, inputs, period * samples)
    slots = {f"x{k}": run.states[:, k] for k in range(len(loop.plant.states))}
    # Of compiled C the commands before their limits are not known to the bit.
    single = loop.fit({}).hardware.arithmetic.precision is Precision.SINGLE
    slot, role = ("h{}_0", "limited") if single else ("c{}", "command")
    for k, signal in enumerate(loop.wiring.driven):
        slots[slot.format(k)] = run.further[f"{signal.name}_{role}"].values
    # What ended early has a row of its own at the end, on no sample.
    whole = len(run.times) if run.outcome.name == "FINISHED" else len(run.times) - 2
    ones = [[f"std{k}", 1.0] for k in noise if f"std{k}" in places]
    return {
        **_rows(slots, max(1, min(whole - 1, samples))),
        "steps": run.steps,
        "noise": {f"noise{k}": numbers(row) for k, row in noise.items() if f"noise{k}" in places},
        "begin": ones,
        "off": [],
        "inputs": [],
        "tolerance": 0.0,
    }


def _noise(loop: Loop, samples: int) -> dict[int, np.ndarray]:
    """SI values for each noisy sensor: the recorded run draws them once and for all."""
    random = np.random.default_rng(1)
    found = {k: each for k, each in enumerate(loop.fit({}).noises) if each is not None}
    return {k: each.std * random.standard_normal(samples + 1) for k, each in found.items()}


def _run(loop: Loop, begin: Begin, inputs: Mapping[str, Any], end: float) -> Trajectory:
    initial = {**begin.states, **begin.memory}
    drive: dict[str, Any] = {"inputs": inputs, "parameters": begin.parameters, "seed": 1, "throw": False}
    arithmetic = loop.fit({}).hardware.arithmetic
    if arithmetic.precision is Precision.DOUBLE:
        return simulate(loop, initial, end, **drive)
    doubles = replace(loop, hardware=replace(loop.fit({}).hardware, arithmetic=Plain()))
    with tempfile.TemporaryDirectory(prefix="ulna-") as work:
        place = Path(work) / "step"
        c_project(doubles, place, precision=Precision.SINGLE)
        engine = Compiled(place)
        return simulate(doubles, initial, end, engine=engine, **drive)


def continuous_vector(system: System, loop: Loop | None, begin: Begin, period: float, seconds: float) -> dict[str, Any]:
    """The recorded run of a loop without a processor, or of a plant alone.

    Raises:
        UlnaError: what `simulate` raises.
    """
    if seconds / period > MOST_SAMPLES:
        found = f"{seconds:g} s are {seconds / period:.3g} samples; at most {MOST_SAMPLES:.0e} are recorded."
        raise SimulationError("the recorded run of a page", found, "Sample more slowly, or record less.")
    samples = max(1, round(seconds / period))
    times = period * np.arange(samples + 1)
    run = simulate(loop or system, begin.states, times, inputs=begin.inputs, parameters=begin.parameters, throw=False)
    if len(run.times) < 2:
        raise UlnaError(f"a recorded run of '{system.name}'", "it ends at its start.")
    slots = {f"x{k}": run.states[:, k] for k in range(len(system.states))}
    last = len(run.times) - 1 if run.outcome.name == "FINISHED" else max(1, len(run.times) - 2)
    # What runs away doubles every difference, too.
    sizes = np.abs(run.states).max(axis=1)
    far = np.flatnonzero(sizes > FAR * (1.0 + sizes[0]))
    last = max(1, min(last, int(far[0]) - 1)) if far.size else last
    tolerance = 0.0 if system.discrete else CLOSE
    return {**_rows(slots, last), "begin": [], "off": [], "inputs": [], "tolerance": tolerance}


def _rows(slots: Mapping[str, np.ndarray], last: int) -> dict[str, Any]:
    table = np.stack([values[: last + 1] for values in slots.values()], axis=1)
    stride = max(1, -(-last // ROWS))
    return {
        "slots": list(slots),
        "samples": last,
        "stride": stride,
        "rows": numbers(table[::stride]),
        "sum": summed(table),
    }
