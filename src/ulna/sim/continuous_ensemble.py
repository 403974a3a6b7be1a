"""Many runs of a continuous loop through one batch integrator of heyoka."""

from __future__ import annotations

from typing import Any

from ulna.base import SimulationError
from ulna.sim.continuous import Continuous
from ulna.sim.job import Job


def continuous_figures(job: Job, settings: Continuous) -> dict[str, Any]:
    """The fields of an `EnsembleResult`."""
    raise SimulationError(f"ensemble of '{job.plant.name}'", f"{settings} is not there yet.")
