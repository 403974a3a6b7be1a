"""One run of a campaign again: the same figures bit for bit, and its path in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.campaign.batch import versions
from ulna.campaign.errors import CampaignError
from ulna.campaign.experiment import Experiment
from ulna.campaign.result import CampaignResult
from ulna.campaign.runs import run_batch
from ulna.sim import Trajectory, simulate


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replay:
    """A run computed anew.

    Attributes:
        number: of the run.
        stored, again: all its columns by name, as the campaign has them and as they came out now.
        trajectory: its path. Of a continuous loop it comes from the integrator for single runs, which agrees with
            the one for many to rounding; of a sampled loop it is the very run.
        versions: libraries that differ from those of the campaign, by name: (then, now).
    """

    number: int
    stored: Mapping[str, float]
    again: Mapping[str, float]
    trajectory: Trajectory
    versions: Mapping[str, tuple[str, str]]

    @property
    def differing(self) -> tuple[str, ...]:
        """Columns that are not the same bit for bit."""
        return tuple(name for name, value in self.stored.items() if not _same(value, self.again[name]))

    @property
    def identical(self) -> bool:
        """Whether every column is the same bit for bit."""
        return not self.differing


def replay(result: CampaignResult, number: int) -> Replay:
    """Run number `number` of a campaign again.

    Raises:
        CampaignError: a number that is none of the runs.
    """
    stored = result.run(number)
    experiment = result.experiment
    again = {name: float(values[0]) for name, values in run_batch(experiment, number, number + 1).items()}
    then, now = result.store.manifest.versions, versions()
    return Replay(
        number=number,
        stored=stored,
        again=again,
        trajectory=path(experiment, number),
        versions={name: (then[name], now.get(name, "")) for name in then if then[name] != now.get(name)},
    )


def path(experiment: Experiment, number: int) -> Trajectory:
    """The path of one run; one that blows up ends where it does.

    Raises:
        CampaignError: a number that is none of the runs.
    """
    if not 0 <= number < experiment.plan.count:
        raise CampaignError(f"run {number}", f"the campaign has the runs 0 to {experiment.plan.count - 1}.")
    _, given = experiment.arguments(number, number + 1)
    samples = np.linspace(0.0, experiment.horizon, experiment.measures.samples + 1)
    return simulate(
        experiment.loop,
        times=experiment.horizon if experiment.loop.sampled else samples,
        engine=experiment.engine,
        initial=_alone(given["initial"]),
        inputs=_alone(given["inputs"]),
        parameters=_alone(given["parameters"]),
        targets=_alone(given["targets"]),
        seed=int(given["seed"][0]),
        throw=False,
    )


def _alone(table: Mapping[str, Any]) -> dict[str, Any]:
    """Of a batch of one run what belongs to it."""
    return {name: _first(value) for name, value in table.items()}


def _first(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return float(value[0])
    if np.ndim(getattr(value, "values", 0.0)) == 2:
        return type(value).known(times=value.times, values=value.values[0])
    return value


def _same(one: float, other: float) -> bool:
    return one == other or (one != one and other != other)  # noqa: PLR0124 (NaN)
