"""The arms to be driven by hand: every controller of a bench side by side, as tuned, on the nominal plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ulna.loop import Loop, parts_of
from ulna.page import live_blocks
from ulna.report import Block
from ulna.studies.prosthesis.comparison import Comparison
from ulna.studies.prosthesis.contender import Contender
from ulna.studies.prosthesis.demonstration import SHOWN
from ulna.studies.prosthesis.hardware import hardware_of
from ulna.studies.prosthesis.muscles import held_muscles
from ulna.studies.prosthesis.plant import Bench
from ulna.studies.prosthesis.tasks import Task
from ulna.studies.prosthesis.trial import control_numbers, first_memory, starts_at_rest
from ulna.symbolic.formulas import exact
from ulna.system import Signal, System


def drive_blocks(found: Comparison) -> tuple[Block, ...]:
    """The live page of a bench, without a recorded run to compare with: the comparison has run these loops already."""
    bench, held = found.bench, next(task for task in found.tasks if task.key == "hold")
    loops = [live_loop(bench, each, found.chosen[each.key]) for each in found.contenders]
    starts = [live_start(bench, each, found.chosen[each.key], held) for each in found.contenders]
    name = bench.preset.name.replace("_", " ")
    return live_blocks(
        *loops, title=f"The arms of {name}, to be driven by hand", names=[each.title for each in found.contenders],
        initial=starts, check=0.0, poles=False,
    )  # fmt: skip


def muscle_blocks(found: Comparison) -> tuple[Block, ...]:
    """The live page of a bench whose arm follows two muscles that a hand holds, under the load-robust compensator."""
    bench = found.bench
    contender = next(each for each in found.contenders if each.key == SHOWN)
    chosen, held = found.chosen[SHOWN], next(task for task in found.tasks if task.key == "hold")
    return live_blocks(
        live_loop(bench, contender, chosen), title="An arm that follows two muscles, to be held by hand",
        names=[contender.title], initial=live_start(bench, contender, chosen, held), check=0.0, poles=False,
        source=held_muscles(bench),
    )  # fmt: skip


def live_loop(bench: Bench, contender: Contender, chosen: Mapping[str, float]) -> Loop:
    """The loop of a trial with every number of the controller in its place."""
    numbers = control_numbers(bench, contender, chosen)
    parts = parts_of(contender.controller)
    law, observer = parts.law, parts.observer
    filled = replace(
        parts,
        system=_filled(parts.system, numbers),
        law=None if law is None else _filled(law, numbers),
        observer=_filled(observer, numbers) if isinstance(observer, System) else observer,
    )
    return Loop(plant=_within_reach(bench), controller=filled, hardware=hardware_of(bench))


def _within_reach(bench: Bench) -> System:
    """The plant with the ranges that a hand may ask for."""
    ends = {
        "y": (bench.motion.lower, bench.motion.upper),
        "load": (0.0, bench.extra_load),
        "push": (-0.5 * bench.moment, 0.5 * bench.moment),
    }

    def ranged(signals: Sequence[Signal]) -> tuple[Signal, ...]:
        rows = ((s, *ends.get(s.name, (None, None))) for s in signals)
        return tuple(s if low is None else replace(s, lower=exact(low), upper=exact(high)) for s, low, high in rows)

    plant, name = bench.plant, bench.preset.name.replace("_", " ")
    return replace(plant, name=name, inputs=ranged(plant.inputs), outputs=ranged(plant.outputs))


def live_start(bench: Bench, contender: Contender, chosen: Mapping[str, float], task: Task) -> dict[str, float]:
    """At rest, held by the drive, the controller's memory with it."""
    plant = {p.name: np.array([float(p.si_value or 0)]) for p in bench.plant.parameters}
    rest = {name: float(values[0]) for name, values in starts_at_rest(task, plant).items()}
    return rest | first_memory(bench, contender, chosen, task)


def _filled(system: System, numbers: Mapping[str, float]) -> System:
    return system.with_parameters({p.name: numbers[p.name] for p in system.parameters if p.name in numbers})
