"""`bode` and `step_response` of a linearisation, by python-control."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ulna.sim.python_control import linear_to_control
from ulna.system import Linearisation, SystemLike, linearise


def step_response(given: Linearisation | SystemLike, times: float | Sequence[float] | np.ndarray | None = None) -> Any:
    """The answer of each output to a unit step of each input, as python-control's `TimeResponseData`.

    It is in deviations from the point of the linearisation, in SI. `t, y = response`; `response.plot()` draws.

    Args:
        given: a linearisation; a system, a law's loop or what has a system stands for that at its operating point.
        times: final time or instants in s; python-control chooses where left out.

    Raises:
        OptionalDependencyError: without python-control.
        PlantError: parameters without a value.
        SimulationError: no inputs or no outputs.

    Examples:
        >>> t, y = ulna.step_response(ulna.linearise(ulna.model("mass_spring_damper")), 40.0)
        >>> print(t.shape == y.shape, y[0])
        True 0.0
    """
    linear = _linear(given)
    from control import step_response as respond

    return respond(linear, times)


def bode(given: Linearisation | SystemLike, frequencies: Sequence[float] | np.ndarray | None = None) -> Any:
    """The frequency response from each input to each output, as python-control's `FrequencyResponseData`.

    `response.magnitude`, `response.phase` (rad) and `response.frequency` (rad/s) are its numbers; `response.plot()`
    draws the Bode plot.

    Args:
        given: as in `step_response`.
        frequencies: (N,) rad/s; python-control chooses where left out.

    Raises:
        OptionalDependencyError: without python-control.
        PlantError: parameters without a value.
        SimulationError: no inputs or no outputs.

    Examples:
        >>> response = ulna.bode(ulna.linearise(ulna.model("mass_spring_damper")), [0.1, 1.0, 10.0])
        >>> response.magnitude.shape
        (3,)
    """
    linear = _linear(given)
    from control import frequency_response

    return frequency_response(linear, frequencies)


def _linear(given: Linearisation | SystemLike) -> Any:
    return linear_to_control(given if isinstance(given, Linearisation) else linearise(given))
