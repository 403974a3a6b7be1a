"""One run of a campaign again: the same figures bit for bit, and its path in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ulna.campaign.runs import path, run_batch
from ulna.campaign.store import CampaignResult, changed_versions
from ulna.sim import Trajectory


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

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> result = ulna.sweep(spring, ulna.Grid(axes={"p": [1, 3, 2]}), horizon=5.0)
        >>> run = ulna.replay(result, 1).trajectory
        >>> run.x[:, 0]
        array([3., 0.])
    """
    stored = result.run(number)
    experiment = result.experiment
    again = {name: float(values[0]) for name, values in run_batch(experiment, number, number + 1).items()}
    return Replay(
        number=number,
        stored=stored,
        again=again,
        trajectory=path(experiment, number),
        versions=changed_versions(result.store.manifest.versions),
    )


def _same(one: float, other: float) -> bool:
    return one == other or (one != one and other != other)  # noqa: PLR0124 (NaN)
