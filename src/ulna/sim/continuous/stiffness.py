"""Whether a decay that has long died away holds explicit steps short."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ulna.base import UlnaError
from ulna.program import Kernel, restricted, tangents, to_python
from ulna.sim.continuous.layout import Layout

APPROACH = 2000
"""Steps after which a run is looked at."""

SHORT = 0.5
"""Steps of this many time constants of the fastest decay are as long as that decay lets them be."""


class Stiffness:
    """The slopes of the rates of a kernel, compiled when first asked for."""

    def __init__(self, kernel: Kernel, layout: Layout) -> None:
        self._kernel = kernel
        self._layout = layout

    @cached_property
    def _slopes(self) -> object:
        states = self._layout.states
        try:
            return to_python(tangents(restricted(self._kernel, self._kernel.outputs[: len(states)]), states))
        except UlnaError:
            return None

    def slopes(self, arguments: list[float]) -> np.ndarray | None:
        """(n, n) ∂rate/∂state at the kernel's inputs; None of a kernel that has none."""
        count = len(self._layout.states)
        if not callable(self._slopes):
            return None
        return np.array(self._slopes(*arguments)).reshape(count, count).T

    def holds(self, arguments: list[float], step: float, ahead: float, steps: int) -> bool:
        """Whether steps are short for the sake of a fast decay, and too many of them lie ahead.

        Args:
            arguments: the kernel's inputs. step: s, the present steps. ahead: s, to the end. steps: that are left.
        """
        if not step > 0.0 or ahead <= steps * step:
            return False
        slopes = self.slopes(arguments)
        if slopes is None or not np.isfinite(slopes).all():
            return False
        return float(-np.linalg.eigvals(slopes).real.min()) * step >= SHORT
