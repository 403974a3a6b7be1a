"""`compare`: the C of a folder, compiled here, against the simulator, sample by sample."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ulna.deploy.design_file import read_design
from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import Firmware, controllers_part, firmware
from ulna.deploy.fixed_firmware import FixedFirmware, fixed_firmware
from ulna.deploy.library import library
from ulna.loop import Loop
from ulna.program import Precision
from ulna.sim import Trajectory, as_input, input_values, simulate
from ulna.system import starting_point

REPLAYED = 5000
"""Samples of a folder in single precision that NumPy computes, too: the simulator has double precision only."""

INTEGERS = 10_000
"""Samples of a folder in fixed point that Python computes, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The commands of the C beside those of a simulated run.

    Attributes:
        samples: how many were compared bit for bit. against: what with.
        first_difference: the first sample that differs, None where none does.
        commands: (C, expected) at that sample.
        largest: the largest difference from the commands of the simulation in double precision, SI.
    """

    samples: int
    against: str
    first_difference: int | None
    commands: tuple[tuple[float, ...], tuple[float, ...]] | None
    largest: float

    @property
    def equal(self) -> bool:
        """Whether every bit is the same."""
        return self.first_difference is None

    def __str__(self) -> str:
        if self.commands is None:
            text = f"bit-equal to {self.against} in all {self.samples} samples"
            return (
                text if self.largest == 0.0 else f"{text}; at most {self.largest:.3g} from the run in double precision"
            )
        found, expected = (", ".join(f"{value!r}" for value in row) for row in self.commands)
        return f"sample {self.first_difference} differs from {self.against}: {found} instead of {expected}"


def compare(
    folder: str | os.PathLike[str],
    loop: Loop,
    *,
    samples: int = 100_000,
    initial: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    compiler: str = "cc",
) -> Comparison:
    """The commands of a folder's C, compiled here and fed with what was measured along a run, beside the run's own.

    In double precision every command is compared with that of `simulate`, in single precision with the same step in
    NumPy's.

    Args:
        folder: written by `c_project`. loop: what it was written from.
        samples: of the run.
        initial, inputs: of the run, SI by name; states of the plant left out begin at its operating point.
        compiler: a C compiler for this machine.

    Raises:
        DeployError: no compiler, C that does not compile, a folder that `c_project` did not write, a loop with missed
            samples, which no record tells.
        SimulationError, OptionalDependencyError: as `simulate`.
    """
    place = Path(folder)
    written = read_design(place)
    precision = written.precision
    own = controllers_part(loop, initial or {})
    fixed = None if written.fixed is None else fixed_firmware(loop, written.fixed, name=written.name, initial=own)
    made = firmware(loop, name=written.name, precision=precision, initial=own)
    if made.hardware.missed is not None:
        raise DeployError(
            "a comparison", "the loop has missed samples, which a record does not show.", "Leave them out."
        )
    double = firmware(loop, precision=Precision.DOUBLE)
    period = double.loop.fit({}).period
    point = starting_point(loop.plant).numbers
    start = {s.name: float(point[s.name]) for s in loop.plant.states} | dict(initial or {})
    run = simulate(double.loop, start, samples * period, inputs=inputs or {}, throw=False)
    rows = _given(made, run, inputs or {})
    rows = np.pad(rows, ((0, 0), (0, int(made.missed))))
    simulated = np.column_stack([run[f"{port.signal.name}_limited"] for port in made.commands])
    if fixed is not None:
        return _of_integers(fixed, place, rows[:INTEGERS], simulated, compiler)
    against = "the simulation"
    expected = simulated
    if precision is Precision.SINGLE:
        rows = rows[:REPLAYED]
        expected, against = made.run(rows)[:, : len(made.commands)], "the same step in single precision"
    found = _by_c(made, place, rows, compiler, precision.value, precision.dtype)
    bits = precision.dtype().dtype.str.replace("f", "u")
    left = np.ascontiguousarray(found, dtype=precision.dtype).view(bits)
    right = np.ascontiguousarray(expected[: len(rows)], dtype=precision.dtype).view(bits)
    differs = np.flatnonzero((left != right).any(axis=1))
    first = int(differs[0]) if len(differs) else None
    return Comparison(
        samples=len(rows),
        against=against,
        first_difference=first,
        commands=None if first is None else (tuple(found[first].tolist()), tuple(expected[first].tolist())),
        largest=float(np.max(np.abs(found - simulated[: len(rows)]), initial=0.0)),
    )


def _given(made: Firmware, run: Trajectory, inputs: Mapping[str, Any]) -> np.ndarray:
    """(N, inputs) measured values and references along a run."""
    columns = []
    for port in made.inputs:
        name = port.signal.name
        if port.slot.startswith("y"):
            columns.append(run[f"{name}_measured"])
        elif port.slot == "elapsed":
            columns.append(np.diff(run.times, prepend=run.times[0] - (made.hardware.period or 0.0)))
        elif port.slot.startswith("believed"):
            columns.append(_applied(made, run, name))
        else:
            columns.append(input_values(as_input(name, inputs.get(name, 0.0), run.times), run.times, run.parameters))
    return np.column_stack(columns) if columns else np.zeros((len(run.times), 0))


def _applied(made: Firmware, run: Trajectory, name: str) -> np.ndarray:
    """(N,) the mean of what the drive applied over the period before each sample."""
    fitted = made.loop.fit({})
    values = np.asarray(run.drive[name].values)  # type: ignore[union-attr] - samples of a sampled run
    late = values[1::2] if fitted.split else values
    mean = late + fitted.fraction * (values[0::2] - late) if fitted.split else late
    return np.concatenate([[0.0], mean[:-1]])


def _of_integers(
    fixed: FixedFirmware, place: Path, rows: np.ndarray, simulated: np.ndarray, compiler: str
) -> Comparison:
    """The C in fixed point beside the same integers in Python, and how far it is from the simulation."""
    made, given = fixed.made, fixed.integers(rows)
    count = len(made.commands)
    expected = np.array(fixed.run_integers(given))[:, :count]
    found = _by_c(made, place, np.array(given), compiler, "int32_t", np.int32)
    differs = np.flatnonzero((found != expected).any(axis=1))
    first = int(differs[0]) if len(differs) else None
    units = np.array([2.0 ** -fixed.program.outputs[port.slot].point for port in made.commands])
    return Comparison(
        samples=len(rows),
        against="the same integers in Python",
        first_difference=first,
        commands=None if first is None else (tuple(found[first].tolist()), tuple(expected[first].tolist())),
        largest=float(np.max(np.abs(found * units - simulated[: len(rows)]), initial=0.0)),
    )


def _by_c(made: Firmware, place: Path, rows: np.ndarray, compiler: str, name: str, real: Any) -> np.ndarray:
    """(N, commands) of the C, compiled into a library that this process loads; `name` of its numbers and their type."""
    given = np.ascontiguousarray(rows, dtype=real)
    answer = np.zeros((len(rows), len(made.commands)), dtype=real)
    run = library(place, made.name, _harness(made, name), compiler).ulna_replay
    run.argtypes, run.restype = [ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p], None
    run(len(rows), given.ctypes.data, answer.ctypes.data)
    return answer


def _harness(made: Firmware, real: str) -> str:
    """A function that takes all samples at once."""
    name = made.name
    width, commands = len(made.inputs) + made.missed, len(made.commands)
    taken = "".join(f"        input.{port.name} = given[k * {width} + {j}];\n" for j, port in enumerate(made.inputs))
    taken += "        input.missed = 0;\n" if made.missed else ""
    shown = "".join(
        f"        answer[k * {commands} + {j}] = output.{port.name};\n" for j, port in enumerate(made.commands)
    )
    return (
        f"#include <stddef.h>\n"
        f"void ulna_replay(size_t count, const {real} *given, {real} *answer)\n{{\n"
        f"    {name}_memory memory;\n    {name}_input input;\n    {name}_output output;\n    {name}_init(&memory);\n"
        f"    for (size_t k = 0; k < count; k++)\n    {{\n{taken}"
        f"        {name}_step(&memory, &input, &output);\n{shown}    }}\n}}\n"
    )
