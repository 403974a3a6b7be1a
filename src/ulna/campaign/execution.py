"""`sweep`: many runs of one loop, by a plan, kept in a folder that survives anything."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans import Plan
from ulna.campaign.runs import Experiment, Measures, columns, completed, experiment_of, to_text
from ulna.campaign.store import CampaignResult, FolderStore, Manifest, MemoryStore, Store, claimed, versions
from ulna.campaign.workers import LocalWorkers, Workers
from ulna.loop import Loop
from ulna.sim import FixedSteps, Implicit, Taylor
from ulna.system import as_system


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


def sweep(
    loop: Any,
    plan: Plan,
    measures: Measures | None = None,
    *,
    horizon: float,
    engine: Taylor | Implicit | FixedSteps | None = None,
    initial: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    store: str | os.PathLike[str] | None = None,
    batch_size: int | None = None,
    workers: Workers | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignResult:
    """All runs of the plan, each reduced to its figures.

    Run k depends on the loop, the plan and k alone: neither on `batch_size` nor on who computes it. Killed at any
    moment and called again with the same arguments, it goes on with what is missing. A run that blows up is one result.

    Args:
        loop: a `Loop`, a `System`, or what has one as its `.system`.
        plan: what varies: initial states, parameters, constant references and disturbances, by name.
        measures: what is kept; what they leave open is, of a loop, how the plant's outputs settle (at a constant
            reference `<output>_ref`, else at the operating point) and the effort on its inputs.
        horizon: length of each run, s.
        engine: `FixedSteps(...)` of a loop with a processor, else `Taylor(...)` or `Implicit(...)`.
        initial: SI values of states that do not vary; others start at 0.
        parameters: SI values in place of the loop's own.
        inputs: references and disturbances that do not vary, as `simulate` takes them; disturbances left out are 0.
        store: folder for the results; without one they are kept in memory.
        batch_size: runs that are computed, stored and, after an interruption, repeated together; by default what suits
            the workers.
        workers: who computes: `LocalWorkers()` or `DaskWorkers(address=...)`.
        progress: is told after every batch.

    Raises:
        CampaignError: unknown names, values out of bounds, a reference without a value, a folder that holds something
            else, a full disk, a scheduler that does not answer.
        SimulationError: settings of the loop that contradict each other.

    Examples:
        >>> sweep(loop, Random(vary={"m2": Uniform(low=0, high=5)}, runs=10_000), horizon=5)  # doctest: +SKIP
    """
    if batch_size is not None and batch_size < 1:
        raise CampaignError(f"sweep(batch_size={batch_size})", "expected at least one run in a batch.")
    subject = _loop(loop)
    experiment = Experiment(
        loop=subject,
        horizon=float(horizon),
        engine=engine,
        plan=plan,
        initial=dict(initial or {}),
        parameters=dict(parameters or {}),
        inputs=dict(inputs or {}),
        measures=completed(measures, subject, inputs or {}),
    )
    workers = workers or LocalWorkers()
    manifest = Manifest(
        settings=to_text(experiment),
        versions=versions(),
        runs=plan.count,
        batch_size=batch_size or workers.batch_size(plan.count),
    )
    # From here on the text alone counts: it is what workers and a later replay read.
    experiment = experiment_of(manifest.settings)
    if store is None:
        memory = MemoryStore(manifest)
        _work(memory, workers, progress)
        return CampaignResult(store=memory)
    with claimed(Path(store), manifest) as folder:
        folder.drop_damaged()
        _check_room(folder, experiment)
        _work(folder, workers, progress)
    return CampaignResult(store=folder)


def _work(store: Store, workers: Workers, progress: Callable[[Progress], None] | None) -> None:
    manifest = store.manifest
    there, done = store.done(), store.runs_done
    missing = [batch for batch in manifest.batches if batch not in there]
    begun, before = time.monotonic(), done

    def tell() -> None:
        if progress is not None:
            progress(Progress(done=done, total=manifest.runs, fresh=done - before, seconds=time.monotonic() - begun))

    tell()
    if not missing:
        return
    for batch, data in workers.compute(manifest.settings, manifest.versions, missing):
        store.put(batch, data)
        done += batch[1] - batch[0]
        tell()


def _loop(given: Any) -> Loop:
    """The loop that is meant; any other system is one without a controller."""
    return given if isinstance(given, Loop) else Loop(plant=as_system(given))


def _check_room(folder: FolderStore, experiment: Experiment) -> None:
    """Refuse now what the disk cannot hold, rather than after hours."""
    each = sum(1 if column.whole else 8 for column in columns(experiment))
    missing = folder.manifest.runs - folder.runs_done
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
