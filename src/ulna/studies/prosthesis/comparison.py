"""The comparison: every contender at every task on the same plants with the same noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ulna.studies.prosthesis.contender import Contender
from ulna.studies.prosthesis.contenders import contenders, tuned_numbers
from ulna.studies.prosthesis.measures import UNITS, measure
from ulna.studies.prosthesis.plant import Bench, draws_of
from ulna.studies.prosthesis.tasks import Task, tasks_of
from ulna.studies.prosthesis.trial import Runs, run_trial

WORKERS = 2
EQUAL = 0.05
"""Share by which two values must differ for one of them to be better."""
LOST = 10.0
"""RMS error in degrees from which a controller does not do its task: an arm that lies on its stop wins nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Entry:
    """A contender at a task.

    Attributes:
        measured: (D,) of every measure, the nominal plant first.
        nominal: the trajectory of the nominal plant, arrays of one row.
    """

    contender: Contender
    task: Task
    measured: Mapping[str, np.ndarray]
    nominal: Runs

    def nominal_value(self, measure: str) -> float:
        """The measure on the nominal plant."""
        return float(self.measured[measure][0])

    def quantile(self, measure: str, share: float) -> float:
        """The value that this share of the plants stays below; infinite where too few succeed, else NaN."""
        values = self.measured[measure]
        if np.isnan(values).any():
            return math.nan
        return float(np.quantile(values, share, method="higher"))

    def lost(self, share: float) -> bool:
        """Whether the error at this quantile is too large to speak of doing the task."""
        return not self.quantile("rms_error", share) < LOST


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """All contenders at all tasks on one bench.

    Attributes:
        chosen: the tuned numbers by contender.
        entries: by (contender key, task key).
        count: plants, the nominal one included.
    """

    bench: Bench
    contenders: tuple[Contender, ...]
    tasks: tuple[Task, ...]
    chosen: Mapping[str, Mapping[str, float]]
    entries: Mapping[tuple[str, str], Entry]
    count: int
    seed: int

    def best(self, task: str, measure: str, share: float) -> Contender | None:
        """Who has the least of a measure at this quantile; None where nobody has a finite value."""
        ranked = self.ranked(task, measure, share)
        return ranked[0][0] if ranked else None

    def leaders(self, task: str, measure: str, share: float) -> tuple[Contender, ...]:
        """Who has the least of a measure at this quantile, and all within `EQUAL` of it, least first."""
        ranked = self.ranked(task, measure, share)
        return tuple(c for c, value in ranked if value <= ranked[0][1] + EQUAL * abs(ranked[0][1]))

    def ranked(self, task: str, measure: str, share: float) -> list[tuple[Contender, float]]:
        """Contenders and values of a measure at this quantile, least first; those that are lost stay out."""
        entries = [self.entries[c.key, task] for c in self.contenders]
        values = [(e.contender, e.quantile(measure, share)) for e in entries if not e.lost(share)]
        return sorted(((c, v) for c, v in values if math.isfinite(v)), key=lambda pair: pair[1])


def compare(bench: Bench, *, count: int = 200, seed: int = 1, workers: int = WORKERS) -> Comparison:
    """Run everything; the same numbers for the same arguments, whatever the number of threads.

    Args:
        count: plants, the nominal one included. seed: of plants and noise. workers: threads.

    Raises:
        OptionalDependencyError: without Numba; DesignError: for a preset that was never tuned.
    """
    rivals, tasks, draws = contenders(bench), tasks_of(bench), draws_of(bench, count, seed=seed)
    chosen = {c.key: tuned_numbers(bench, c) for c in rivals}

    def entry(job: tuple[Contender, Task]) -> Entry:
        contender, task = job
        runs = run_trial(bench, contender, chosen[contender.key], task, draws)
        # A copy, so that the others can go.
        nominal = {name: rows[:1].copy() for name, rows in runs.items()}
        return Entry(contender=contender, task=task, measured=measure(bench, task, runs), nominal=nominal)

    # Task by task: a contender's loop is compiled once, by its first task.
    jobs = [(contender, task) for task in tasks for contender in rivals]
    with ThreadPoolExecutor(max_workers=workers) as pool:
        entries = list(pool.map(entry, jobs))
    return Comparison(
        bench=bench,
        contenders=rivals,
        tasks=tasks,
        chosen=chosen,
        entries={(e.contender.key, e.task.key): e for e in entries},
        count=count,
        seed=seed,
    )


def plain_results(found: Comparison) -> dict[str, object]:
    """The comparison as plain data; null where a motion never settles or a measure does not apply."""
    return {
        "preset": found.bench.preset.name,
        "plants": found.count,
        "seed": found.seed,
        "extra_load_kg": found.bench.extra_load,
        "tuned": {key: dict(values) for key, values in found.chosen.items()},
        "units": dict(UNITS),
        "tasks": {
            task.key: {
                contender.key: {measure: _summary(found.entries[contender.key, task.key], measure) for measure in UNITS}
                for contender in found.contenders
            }
            for task in found.tasks
        },
    }


def _summary(entry: Entry, measure: str) -> dict[str, float | None]:
    values = entry.measured[measure]
    numbers = {
        "nominal": float(values[0]),
        "median": entry.quantile(measure, 0.5),
        "p95": entry.quantile(measure, 0.95),
        "worst": float(values.max()),
    }
    return {name: value if math.isfinite(value) else None for name, value in numbers.items()}
