"""`Step`: what the processor does once a period, as kernels over named slots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ulna.loop.advance import advance
from ulna.loop.command import command
from ulna.loop.fitted import Fitted
from ulna.program import Kernel, chained


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """The processor's sample: slots of memory, measured values and references in, slots and commands out.

    Slots: `y<k>` measured value k as the sensor gives it, `r<k>` reference k; `z<k>` states of estimator and
    controller, `yn<k>` measured values after the quantiser, `e<k>` estimates, `c<k>` commands, `h<k>_<j>` limited
    commands, j samples old, `late<k>` what the drive gets from `delay` on, `early<k>` before; `believed<k>` what the
    estimator takes for the input; `fault` 0, or NaN where a number was not finite; `code` the sum of the bits of
    `Fault`. With faults to watch for: `rn<k>` references after the check of their range, `elapsed` seconds since the
    last call, `missed` whether there is no new sample, and the counters `absent`, `astray`, `calm` and `lost`.

    Attributes:
        stages: kernels, one after the other: read and advance, then command.
        numbers: values of the inputs that hold forever: limits, steps, coefficients.
    """

    stages: tuple[Kernel, ...]
    numbers: Mapping[str, float]

    @property
    def kernel(self) -> Kernel:
        """All stages as one kernel."""
        return chained("step", self.stages)

    @property
    def memory(self) -> tuple[str, ...]:
        """Slots that a sample hands to the next one; all begin at 0 unless told otherwise."""
        whole = self.kernel
        return tuple(name for name in whole.inputs if name in whole.outputs)


def step(fitted: Fitted) -> Step:
    """The step of a loop with a processor."""
    return Step(stages=tuple(map(fitted.finished, (advance(fitted), command(fitted)))), numbers=fitted.numbers)
