"""A system without states along the time: its outputs are functions of its inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.sim.inputs import Input
from ulna.sim.outcome import Outcome
from ulna.sim.parameters import default_values, parameter_values
from ulna.sim.trajectory import Trajectory
from ulna.system import System


def run_static(
    system: System, times: np.ndarray, inputs: Mapping[str, Input], parameters: Mapping[str, Any] | None
) -> Trajectory:
    """The outputs at the times.

    Raises:
        SimulationError: parameters without a value; an output that is not a finite number at one of the times.
    """
    run = Trajectory(
        system=system,
        parameters=parameter_values(default_values(system), parameters, system.name),
        drive=inputs,
        times=times,
        states=np.zeros((len(times), 0)),
        outcome=Outcome.FINISHED,
    )
    bad = ~np.isfinite(run.outputs)
    if bad.any():
        row, column = (int(each) for each in np.argwhere(bad)[0])
        raise SimulationError(
            f"simulation of '{system.name}'",
            f"its output {system.outputs[column].name} is not a finite number at {times[row]:g} s.",
            "Look for a division by zero, a root or a logarithm of a negative number.",
        )
    return run
