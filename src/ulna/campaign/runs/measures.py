"""`Measures`: what is kept of every run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.loop import Loop
from ulna.sim import Constant, rest_values
from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """A signal within a span of time: its least, most and mean value at the samples in it.

    NaN of a run that ended before the window does. A continuous loop is looked at on `Measures(samples=...)`
    intervals, and its runs go one by one.

    Args:
        signal: state, output, estimate, command (`u_command`), measured value (`y_measured`) and so on.
        begin, end: s, both included.
        name: its columns are `least_<signal>_<name>` and so on.

    Raises:
        CampaignError: an end that does not lie behind the begin.
    """

    signal: str
    begin: float
    end: float
    name: str = ""

    def __post_init__(self) -> None:
        if not (0 <= self.begin < self.end < math.inf):
            raise CampaignError(f"Window(begin={self.begin}, end={self.end})", "expected 0 <= begin < end.")

    @property
    def label(self) -> str:
        """What its columns are called after."""
        return f"{self.signal}_{self.name}" if self.name else self.signal

    def holds(self, times: np.ndarray) -> np.ndarray:
        """(T,) which of the times lie in it, to rounding."""
        slack = 1e-9 * self.end
        return (times >= self.begin - slack) & (times <= self.end + slack)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """What is kept of every run: how each output settled, the effort, the final state, how it ended.

    Attributes:
        outputs: outputs whose figures are kept, besides those with a target; empty: of a loop those of its
            plant, else all that are not efforts.
        targets: by output name where it should end: a number in SI, or the name of a varied quantity or reference.
            A run has settled when all outputs named here have. Where none is named, `sweep` takes those of `completed`;
            of a plant alone all outputs have to settle, each at 0.
        effort: of a whole closed loop the outputs that drive the plant: of them only the peak is of interest.
        windows: signals within spans of time.
        samples: intervals on which all this is looked at in continuous loops with jumps, limits or end stops; of others
            it is read off the steps of the integrator, to about its tolerance.

    Raises:
        CampaignError: fewer than one interval.

    Examples:
        >>> measures = ulna.Measures(outputs=("y",), targets={"y": 0.5}, effort=("u",))
        >>> measures.targets
        {'y': 0.5}
    """

    outputs: tuple[str, ...] = ()
    targets: Mapping[str, float | str] = field(default_factory=dict)
    effort: tuple[str, ...] = ()
    windows: tuple[Window, ...] = ()
    samples: int = 500

    def __post_init__(self) -> None:
        labels = [window.label for window in self.windows]
        twice = [label for label in labels if labels.count(label) > 1]
        if twice:
            raise CampaignError(
                f"two windows of '{twice[0]}'", "they have the same name.", "Give Window(..., name='late')."
            )
        if self.samples < 1:
            raise CampaignError(f"Measures(samples={self.samples})", "expected at least one interval.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One number of every run.

    Attributes:
        name: of the variable. unit, text: what people read. varied: whether the plan chose it.
        whole: whether it is a small whole number.
    """

    name: str
    unit: str
    text: str
    varied: bool = False
    whole: bool = False

    @property
    def heading(self) -> str:
        """Name and unit, for tables."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def dtype(self) -> str:
        """NumPy's name of the type it is stored in (netCDF 3 is big-endian)."""
        return "i1" if self.whole else ">f8"


def completed(measures: Measures | None, loop: Loop, inputs: Mapping[str, Any]) -> Measures:
    """The measures with what they leave open: of a loop its plant's outputs and where these should end.

    An output ends at its constant reference `<output>_ref`, else where the plant rests at its operating point; what the
    controller drives is an effort and has nowhere to settle. Of a plant alone nothing is added.
    """
    given = measures or Measures()
    if loop.controller is None:
        return given
    outputs = given.outputs or tuple(s.name for s in loop.plant.outputs)
    constant = {s.name for s in loop.references if isinstance(inputs.get(s.name, 0.0), int | float | Constant)}
    driven = () if loop.sampled else tuple(s.name for s in loop.wiring.driven if s.name not in outputs)
    return replace(
        given,
        outputs=outputs,
        effort=given.effort or driven,
        targets=given.targets or _targets(loop.plant, outputs, constant),
    )


def _targets(plant: System, outputs: tuple[str, ...], references: set[str]) -> dict[str, float | str]:
    rest = rest_values(plant)
    return {
        name: f"{name}_ref" if f"{name}_ref" in references else rest[name]
        for name in outputs
        if f"{name}_ref" in references or name in rest
    }
