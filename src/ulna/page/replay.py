"""A recorded run as a page replays it."""

from __future__ import annotations

import numpy as np

from ulna.page.facts import signal_facts
from ulna.page.vector import numbers
from ulna.sim import Outcome, Trajectory
from ulna.system import Signal

MOST = 20_000
"""Samples that a page holds; of longer runs every second one, every fifth, and so on."""


def replay_data(run: Trajectory) -> dict[str, object]:
    """States, outputs, inputs and further series of a run by name, as `ulnaReplay` reads them."""
    stride = max(1, -(-len(run.times) // MOST))
    rows = list(range(0, len(run.times), stride))
    if rows[-1] != len(run.times) - 1:
        rows.append(len(run.times) - 1)
    groups: list[tuple[str, tuple[Signal, ...], np.ndarray]] = [
        ("state", run.system.states, run.states),
        ("output", run.system.outputs, run.outputs),
        ("input", run.system.inputs, run.inputs),
    ]
    found = [(s, role, table[rows, k]) for role, signals, table in groups for k, s in enumerate(signals)]
    found += [(each.signal, each.role, each.values[rows]) for each in run.further.values()]
    facts = [signal_facts(s, role=role, slot=k) for k, (s, role, _) in enumerate(found)]
    by_role = {"states": "state", "outputs": "output", "commands": "input", "estimates": "estimate"}
    return {
        "name": run.system.name,
        "text": run.system.text,
        "kind": "replay",
        "period": float(np.median(np.diff(run.times[rows]))) if len(rows) > 1 else 1.0,
        "outcome": "finished" if run.outcome is Outcome.FINISHED else run.outcome.name.lower().replace("_", " "),
        "outcome_text": f"The run {run.outcome.text}." if run.outcome is Outcome.FINISHED else f"{run.outcome.text}.",
        "signals": facts,
        "columns": [numbers(values) for _, _, values in found],
        "times": numbers(run.times[rows]),
        **{name: [each for each in facts if each["role"] == role] for name, role in by_role.items()},
    }
