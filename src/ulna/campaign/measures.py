"""`Measures`: what is kept of every run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ulna.campaign.errors import CampaignError


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """What is kept of every run: how each output settled, the effort, the final state, how it ended.

    Attributes:
        outputs: outputs that have to settle; empty: all that are not efforts.
        targets: by output name where it should end: a number in SI, or the name of a varied quantity or reference;
            0 where left out.
        effort: of a whole closed loop the outputs that drive the plant: of them only the peak is of interest.
        samples: intervals on which all this is looked at in continuous loops with jumps, limits or end stops; of others
            it is read off the steps of the integrator, to about its tolerance.

    Raises:
        CampaignError: fewer than one interval.
    """

    outputs: tuple[str, ...] = ()
    targets: Mapping[str, float | str] = field(default_factory=dict)
    effort: tuple[str, ...] = ()
    samples: int = 500

    def __post_init__(self) -> None:
        if self.samples < 1:
            raise CampaignError(f"Measures(samples={self.samples})", "at least one interval is needed.")


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
    def dtype(self) -> str:
        """NumPy's name of the type it is stored in (netCDF 3 is big-endian)."""
        return "i1" if self.whole else ">f8"
