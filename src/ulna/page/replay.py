"""A recorded run as a page replays it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ulna.page.facts import parameter_facts, signal_facts
from ulna.page.payload import picture_data, plane_axes, shown_states, velocities
from ulna.page.vector import numbers
from ulna.sim import Outcome, Trajectory
from ulna.system import Signal, System

MOST = 20_000
"""Samples that a page holds; of longer runs every second one, every fifth, and so on."""
_SHOWN = 5.0
"""s of the wall clock that a page takes at least for a whole run, and a thousand times of it at most."""


def replay_data(run: Trajectory) -> dict[str, Any]:
    """States, outputs, inputs and further series of a run by name, as `ulnaReplay` reads them."""
    stride = max(1, -(-len(run.times) // MOST))
    rows = list(range(0, len(run.times), stride))
    if rows[-1] != len(run.times) - 1:
        rows.append(len(run.times) - 1)
    found = [(s, role, values[rows]) for s, role, values in _columns(run)]
    facts = [signal_facts(s, role=role, slot=k, value=float(values[0])) for k, (s, role, values) in enumerate(found)]
    roles = ("state", "output", "command", "estimate", "reference", "disturbance")
    return {
        "name": run.system.name,
        "text": run.system.text,
        "kind": "replay",
        "period": float(np.median(np.diff(run.times[rows]))) if len(rows) > 1 else 1.0,
        "speed": _speed(float(run.times[-1] - run.times[0])),
        "outcome": "finished" if run.outcome is Outcome.FINISHED else run.outcome.name.lower().replace("_", " "),
        "outcome_text": f"The run {run.outcome.text}." if run.outcome is Outcome.FINISHED else f"{run.outcome.text}.",
        "signals": facts,
        "columns": [numbers(values) for _, _, values in found],
        "times": numbers(run.times[rows]),
        "parameters": _parameters(run),
        "memory": [],
        "initial": [],
        "options": [],
        "limits": {},
        "stops": [],
        **{f"{role}s": [each for each in facts if each["role"] == role] for role in roles},
    }


def replay_payload(run: Trajectory, *, title: str, region: dict[str, Any] | None, paused: bool) -> dict[str, Any]:
    """What the view reads of a page that replays one run."""
    plant = plant_of(run)
    return {
        "title": plant.name,
        "text": plant.text,
        "hash": "",
        "replay": True,
        "loops": [{"title": title, "closed": True, "poles": [], "facts": replay_data(run)}],
        "picture": picture_data(plant),
        "velocities": velocities(plant),
        "shows": shown_states(plant),
        "plane": plane_axes(plant),
        "equilibria": [],
        "region": region,
        "paused": paused,
    }


def plant_of(run: Trajectory) -> System:
    """The plant of a run, whose states are drawn."""
    return run.system if run.plant is None else run.plant


def _columns(run: Trajectory) -> list[tuple[Signal, str, np.ndarray]]:
    """Every series of the run with its role in the loop; of equal names the first one counts."""
    plant, system = plant_of(run), run.system
    states, outputs, inputs = ({s.name for s in row} for row in (plant.states, plant.outputs, plant.inputs))
    estimated = {f"{name}_hat" for name in states | outputs}
    found = [
        (s, "state" if s.name in states else "estimate" if s.name in estimated else "memory", run.states[:, k])
        for k, s in enumerate(system.states)
    ]
    for k, s in enumerate(system.outputs):
        role = "output" if s.name in outputs else "command" if s.name in inputs else "estimate"
        found.append((s, role, run.outputs[:, k]))
    for k, s in enumerate(system.inputs):
        role = "command" if run.plant is None else "disturbance" if s.name in inputs else "reference"
        found.append((s, role, run.inputs[:, k]))
    # The command before its limit stands in the curves only by its own name, the input is what the plant got.
    found += [(each.signal, each.role.replace("command", "wanted"), each.values) for each in run.further.values()]
    return list({s.name: (s, role, values) for s, role, values in reversed(found)}.values())[::-1]


def _parameters(run: Trajectory) -> list[dict[str, Any]]:
    """The plant's parameters with the numbers of this run: a picture has lengths among them."""
    plant = plant_of(run)
    rows = [(p, run.parameters.get(p.name, p.si_value)) for p in plant.parameters]
    return [parameter_facts(p, float(value), owner="plant", slot="") for p, value in rows if value is not None]


def _speed(duration: float) -> float:
    """Time of the run in a second of the wall clock: 1, or a power of ten where it would take or last too long."""
    speed = 1.0
    while duration > 1000.0 * _SHOWN * speed:
        speed *= 10.0
    while 0.0 < duration < 0.1 * _SHOWN * speed:
        speed /= 10.0
    return speed
