"""Tuning of every contender by the same search on the same cost: `python -m ulna.studies.prosthesis.tuning`.

Cost: the mean over tasks and plants of RMS error in degrees + 10 · ripple in degrees + 10 · chatter / voltage scale,
each run at most 90. Five tasks (all but the long hold), the nominal plant and `PLANTS` − 1 random ones from a seed the
comparison does not use. Search in the logarithm of the numbers: `PROBES` random points and the start, then Nelder and
Mead's simplex from the best, at most `EVALUATIONS` evaluations; the seed is fixed, the result the same each time.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ulna.plants import hold, preset, presets
from ulna.studies.prosthesis.contender import Contender
from ulna.studies.prosthesis.contenders import TUNED_FILE, contenders
from ulna.studies.prosthesis.measures import measure
from ulna.studies.prosthesis.plant import Bench, Draws, bench_of, draws_of
from ulna.studies.prosthesis.tasks import Task, tasks_of
from ulna.studies.prosthesis.trial import run_trial

PLANTS = 40
PROBES = 16
EVALUATIONS = 60
SEED = 20
WORST = 90.0


def cost(bench: Bench, contender: Contender, chosen: dict[str, float], tasks: Iterable[Task], draws: Draws) -> float:
    """The cost of the module's docstring, in degrees."""
    scale = bench.voltage if np.isfinite(bench.voltage) else 2 * hold(bench.preset).voltage
    costs = []
    for task in tasks:
        found = measure(bench, task, run_trial(bench, contender, chosen, task, draws))
        each = found["rms_error"] + 10 * found["ripple"] + 10 * found["chatter"] / scale
        costs.append(np.minimum(np.nan_to_num(each, nan=WORST), WORST))
    return float(np.mean(costs))


def tune(bench: Bench, contender: Contender) -> tuple[dict[str, float], float]:
    """The best numbers found, four digits, and their cost."""
    from scipy.optimize import minimize

    tasks = [task for task in tasks_of(bench) if task.key != "hold"]
    draws = draws_of(bench, PLANTS, seed=SEED)
    names = [entry.name for entry in contender.tuned]
    low = np.log([entry.lower for entry in contender.tuned])
    high = np.log([entry.upper for entry in contender.tuned])
    start = np.log([entry.start for entry in contender.tuned])

    def numbers(point: np.ndarray) -> dict[str, float]:
        return {n: float(f"{v:.4g}") for n, v in zip(names, np.exp(np.clip(point, low, high)), strict=True)}

    def value(point: np.ndarray) -> float:
        return cost(bench, contender, numbers(point), tasks, draws)

    generator = np.random.default_rng(SEED)
    probes = [start, *(generator.uniform(low, high) for _ in range(PROBES))]
    best = min(probes, key=value)
    simplex = np.vstack([best, *(best + 0.4 * row for row in np.eye(len(best)))])
    settings = {"maxfev": EVALUATIONS, "xatol": 0.01, "fatol": 1e-3, "initial_simplex": simplex}
    found = minimize(value, best, method="Nelder-Mead", options=settings)
    return numbers(found.x), float(found.fun)


def tuned_text(names: Iterable[str]) -> str:
    """The file of tuned numbers for the presets of these names."""
    lines = [
        "# Written by: python -m ulna.studies.prosthesis.tuning (cost and search: its docstring). cost: degrees.",
    ]
    for name in names:
        bench = bench_of(preset(name))
        for contender in contenders(bench):
            chosen, reached = tune(bench, contender)
            lines += ["", f"[{name}.{contender.key}]", *(f"{key} = {number!r}" for key, number in chosen.items())]
            lines.append(f"cost = {reached:.4g}")
            print(*lines[-2 - len(chosen) :], sep="\n", file=sys.stderr, flush=True)  # noqa: T201 (a program's progress)
    return "\n".join(lines) + "\n"


def main() -> None:
    """Renew the file of tuned numbers beside this module."""
    text = tuned_text([entry.name for entry in presets()])
    target = Path(__file__).with_name("data") / TUNED_FILE
    target.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
