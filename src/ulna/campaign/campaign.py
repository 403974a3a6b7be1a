"""`campaign`: many runs of one loop, by a plan, kept in a folder that survives anything."""

from __future__ import annotations

import os
import shutil
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from ulna.campaign.crew import Crew, Local
from ulna.campaign.encoding import to_text
from ulna.campaign.errors import CampaignError
from ulna.campaign.experiment import Experiment
from ulna.campaign.grid import Grid
from ulna.campaign.measures import Measures
from ulna.campaign.part import experiment_of, versions
from ulna.campaign.result import CampaignResult
from ulna.campaign.runs import columns
from ulna.campaign.sampling import LatinHypercube, Random, Saltelli, Sobol
from ulna.campaign.store import Folder, Manifest, Memory, claimed
from ulna.sim import Continuous
from ulna.sim.sampled import Sampled
from ulna.system import System, equilibrium

CONTINUOUS = Continuous()


@runtime_checkable
class Loop(Protocol):
    """A plant and what was made of it with a controller: `ulna.design.ClosedLoop`."""

    @property
    def plant(self) -> System:
        """What is controlled."""
        ...

    @property
    def system(self) -> System:
        """The whole loop."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a campaign is. done, total: runs. fresh: of the done, those of this call. seconds: since it began."""

    done: int
    total: int
    fresh: int
    seconds: float

    @property
    def rate(self) -> float:
        """Runs per second."""
        return self.fresh / self.seconds if self.seconds > 0 else 0.0

    @property
    def time_left(self) -> float:
        """s until the end at this rate; infinite before the first part."""
        return (self.total - self.done) / self.rate if self.rate > 0 else float("inf")


def campaign(
    loop: Loop | System,
    plan: Grid | LatinHypercube | Sobol | Random | Saltelli,
    measures: Measures | None = None,
    *,
    horizon: float,
    time: Continuous | Sampled = CONTINUOUS,
    initial: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    store: str | os.PathLike[str] | None = None,
    part: int | None = None,
    crew: Crew | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignResult:
    """All runs of the plan, each reduced to its figures.

    Run k depends on the loop, the plan and k alone: neither on `part` nor on who computes it. Killed at any moment
    and called again with the same arguments, it goes on with what is missing. A run that blows up is one result.

    Args:
        loop: with `Continuous` a closed loop (or any system), with `Sampled` the plant.
        plan: what varies: initial states, parameters, constant inputs and references, by name.
        measures: what is kept; of a `Loop` by default how the plant's outputs settle (at a set point
            `<output>_ref`, else at the operating point) and the peaks of its inputs.
        horizon: length of each run, s.
        time: how time passes.
        initial: SI values of states that do not vary; others start at 0.
        parameters: SI values in place of the loop's own.
        inputs: constant inputs in SI, set points among them; others are 0.
        store: folder for the results; without one they are kept in memory.
        part: runs that are computed, stored and, after an interruption, repeated together; by default the crew knows.
        crew: who computes: `Local()` or `Cluster(address=...)`.
        progress: is told after every part.

    Raises:
        CampaignError: unknown names, values out of bounds, a folder that holds something else, a full disk, a
            scheduler that does not answer.
        SimulationError: settings of the loop that contradict each other.

    Example:
        >>> campaign(loop, Random(vary={"m2": Uniform(low=0, high=5)}, runs=10_000), horizon=5)  # doctest: +SKIP
    """
    if part is not None and part < 1:
        raise CampaignError(f"campaign(part={part})", "a part has at least one run.")
    system = loop.system if isinstance(loop, Loop) else loop
    experiment = Experiment(
        system=system,
        horizon=float(horizon),
        time=time,
        plan=plan,
        initial=dict(initial or {}),
        parameters=dict(parameters or {}),
        inputs=dict(inputs or {}),
        measures=measures or _measures(loop, time),
    )
    crew = crew or Local()
    size = part or crew.part_size(plan.count)
    manifest = Manifest(settings=to_text(experiment), versions=versions(), runs=plan.count, size=size)
    # From here on the text alone counts: it is what workers and a later replay read.
    experiment = experiment_of(manifest.settings)
    if store is None:
        memory = Memory(manifest)
        _work(memory, crew, progress)
        return CampaignResult(store=memory)
    with claimed(Path(store), manifest) as folder:
        folder.drop_damaged()
        _check_room(folder, experiment)
        _work(folder, crew, progress)
    return CampaignResult(store=folder)


def _work(store: Folder | Memory, crew: Crew, progress: Callable[[Progress], None] | None) -> None:
    manifest = store.manifest
    there = store.done()
    missing = [span for span in manifest.spans if span not in there]
    done = sum(last - first for first, last in there)
    begun, before = clock.monotonic(), done

    def tell() -> None:
        if progress is not None:
            progress(Progress(done=done, total=manifest.runs, fresh=done - before, seconds=clock.monotonic() - begun))

    tell()
    if not missing:
        return
    for span, data in crew.parts(manifest.settings, manifest.versions, missing):
        store.put(span, data)
        done += span[1] - span[0]
        tell()


def _measures(loop: Loop | System, time: Continuous | Sampled) -> Measures:
    if isinstance(loop, Loop):
        shown = {s.name for s in loop.system.outputs}
        outputs = tuple(s.name for s in loop.plant.outputs if s.name in shown)
        return Measures(
            outputs=outputs,
            effort=tuple(s.name for s in loop.plant.inputs if s.name in shown),
            targets=_targets(loop.plant, outputs, {s.name for s in loop.system.inputs}),
        )
    if isinstance(time, Sampled):
        constant = {name for name, value in time.references.items() if isinstance(value, int | float)}
        return Measures(targets=_targets(loop, tuple(s.name for s in loop.outputs), constant))
    return Measures()


def _targets(plant: System, outputs: tuple[str, ...], references: set[str]) -> dict[str, float | str]:
    """Where outputs should end: at their set point, else where the plant rests at its operating point."""
    valued = plant.with_values()
    point = equilibrium(valued)
    readouts = dict(zip((s.name for s in plant.outputs), valued.inline(valued.readouts), strict=True))
    found: dict[str, float | str] = {}
    for name in outputs:
        if f"{name}_ref" in references:
            found[name] = f"{name}_ref"
        else:
            value = readouts[name].subs({**point.states, **point.inputs})
            found[name] = float(value) if value.is_real and value.is_number else 0.0
    return found


def _check_room(folder: Folder, experiment: Experiment) -> None:
    """Refuse now what the disk cannot hold, rather than after hours."""
    each = sum(1 if column.whole else 8 for column in columns(experiment))
    missing = folder.manifest.runs - sum(last - first for first, last in folder.done())
    free = shutil.disk_usage(folder.path).free
    if each * missing > free:
        raise CampaignError(
            f"the result folder '{folder.path}'",
            f"{missing} runs take {_size(each * missing)}, {_size(free)} are free there.",
            "Make room, or ask for fewer runs.",
        )


def _size(amount: float) -> str:
    """As people read it: 2.12 MB."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if amount < 1000:
            return f"{amount:.3g} {unit}"
        amount /= 1000
    return f"{amount:.3g} TB"
