"""The path of one run of a campaign in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.runs.experiment import Experiment
from ulna.sim import Trajectory, simulate


def path(experiment: Experiment, number: int) -> Trajectory:
    """The path of one run; one that blows up ends where it does.

    Raises:
        CampaignError: a number that is none of the runs.
    """
    if not 0 <= number < experiment.plan.count:
        raise CampaignError(f"run {number}", f"the campaign has the runs 0 to {experiment.plan.count - 1}.")
    _, given = experiment.arguments(number, number + 1)
    return simulate(
        experiment.loop,
        times=experiment.horizon if experiment.loop.sampled else experiment.sample_times,
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
