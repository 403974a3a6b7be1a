"""`Ensemble`: what many runs answer with: their figures and ends, and paths where asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ulna.base import SimulationError, html_table
from ulna.sim.figures import FIGURE_NAMES, ended_inside
from ulna.sim.outcome import Outcome
from ulna.sim.starts import Request
from ulna.system import System

CODES = tuple(Outcome)
"""Outcome of each code."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ensemble:
    """Figures of N runs, in SI. Names in the order of the system; rows are runs.

    Attributes:
        system: what was run; of a loop with a processor its plant. horizon: s.
        code: (N,) place in `CODES`: 0 finished, 1 blew up, 2 not finite, 3 ambiguous, 4 step limit,
            5 stopped, 6 at the edge of its domain, 7 steps too long, 8 switchings without end.
        end_time: (N,) s, where the run ended.
        final_state: (N, n).
        peak_input, rms_input: (N, m) of the driven inputs, by `input_names`; none of continuous runs.
        settling_time: (N, p) s from which each output stays in its 2 % band; infinite if it does not.
        overshoot: (N, p) farthest beyond the target as a fraction of the way from the start; NaN without a way.
        steady_error: (N, p) last value − target.
        peak_error: (N, p) largest |value − target|.
        times: (T,) s of the paths. paths: (N, T) by name; NaN after the end of a run.
        plant: of a continuous closed loop its plant; None where the system is the plant.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> many = ulna.simulate(spring, [[1, 0], [2, 0]], 60.0)
        >>> many.final_state.shape, many.settling_time.round(1)
        ((2, 2), array([[14.7],
               [14.7]]))
    """

    system: System
    horizon: float
    input_names: tuple[str, ...]
    code: np.ndarray
    end_time: np.ndarray
    final_state: np.ndarray
    peak_input: np.ndarray
    rms_input: np.ndarray
    settling_time: np.ndarray
    overshoot: np.ndarray
    steady_error: np.ndarray
    peak_error: np.ndarray
    times: np.ndarray = field(default_factory=lambda: np.zeros(0))
    paths: Mapping[str, np.ndarray] = field(default_factory=dict)
    plant: System | None = None

    @property
    def finished(self) -> np.ndarray:
        """(N,) whether the run reached the horizon."""
        return self.code == 0

    @property
    def settled(self) -> np.ndarray:
        """(N, p) whether the run reached the horizon with the output in its band."""
        return self.finished[:, None] & ended_inside(self)

    def outcome(self, run: int) -> Outcome:
        """How a run ended."""
        return CODES[int(self.code[run])]

    def __getitem__(self, name: str) -> np.ndarray:
        """(N, T) the paths of a signal."""
        if name not in self.paths:
            raise SimulationError(
                f"paths of '{name}'",
                f"this ensemble keeps those of {', '.join(self.paths) or 'no signal'}.",
                f"Ask for them: simulate(..., record=Paths('{name}')).",
            )
        return self.paths[name]

    def __len__(self) -> int:
        return len(self.code)

    def _repr_html_(self) -> str:
        """A table for notebooks: for each output and driven input what the runs say together."""
        rows = [
            (
                f"{output.label}: {name.replace('_', ' ')}",
                *_spread(getattr(self, name)[:, column]),
            )
            for column, output in enumerate(self.system.outputs)
            if self.plant is None or output in self.plant.outputs
            for name in FIGURE_NAMES
        ]
        rows += [
            (f"{name}: {figure.partition('_')[0]}", *_spread(getattr(self, f"{figure}_input")[:, column]))
            for column, name in enumerate(self.input_names)
            for figure in ("peak", "rms")
        ]
        count = self.settled.sum(axis=0)
        shares = [
            f"{o.name} settled in {n} of {len(self)} runs"
            for o, n in zip(self.system.outputs, count, strict=True)
            if self.plant is None or o in self.plant.outputs
        ]
        return html_table(rows, title=repr(self), headings=("", "smallest", "median", "largest"), below=tuple(shares))

    def __repr__(self) -> str:
        done = int(self.finished.sum())
        return f"Ensemble of '{self.system.name}': {len(self)} runs to {self.horizon:g} s, {done} finished"


def _spread(values: np.ndarray) -> tuple[float, float, float]:
    """Smallest, median and largest of the runs that have the figure; NaN where none has it."""
    known = np.sort(values[~np.isnan(values)])
    if not len(known):
        return np.nan, np.nan, np.nan
    # The lower of two middle runs: the mean of a finite and an infinite time says nothing.
    return float(known[0]), float(known[(len(known) - 1) // 2]), float(known[-1])


def empty_figures(asked: Request) -> dict[str, Any]:
    """The fields of an ensemble before its runs are known."""
    runs, outputs = len(asked.starts.initial), len(asked.system.outputs)
    figures: dict[str, Any] = {name: np.full((runs, outputs), np.nan) for name in FIGURE_NAMES}
    figures |= {
        "input_names": (),
        "peak_input": np.zeros((runs, 0)),
        "rms_input": np.zeros((runs, 0)),
        "code": np.zeros(runs, dtype=np.int8),
        "end_time": np.full(runs, float(asked.times[-1])),
        "final_state": np.empty_like(asked.starts.initial),
    }
    return figures
