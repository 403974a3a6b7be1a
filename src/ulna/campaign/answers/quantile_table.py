"""Quantiles of the figures of a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ulna.campaign.answers.order_statistics import order_statistics
from ulna.campaign.errors import CampaignError
from ulna.campaign.store import CampaignResult

LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


def quantiles(result: CampaignResult, figures: Sequence[str] = (), *, levels: Sequence[float] = LEVELS) -> Any:
    """An `xarray.Dataset` of each figure over `level`: the least value that a part `level` of the runs does not exceed.

    Values are those of runs, never between two, so that "settled never" (infinity) can be a quantile. NaN is left
    out: a figure that does not apply, or of a run that blew up. `counted` in the attributes says how many were left.
    They are exact, and found in four passes over the store, in memory that does not grow with the number of runs.

    Args:
        result: of the campaign.
        figures: names of columns; all figures where left out.
        levels: between 0 and 1.

    Raises:
        CampaignError: an unknown figure, a level outside [0, 1].

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> result = ulna.sweep(spring, ulna.Grid(axes={"p": [1, 2, 3]}), horizon=60.0)
        >>> ulna.quantiles(result, ["final_p"], levels=(0.5, 0.95)).sizes["level"]
        2
    """
    import xarray as xr

    if not all(0 <= level <= 1 for level in levels):
        raise CampaignError(f"quantiles(levels={tuple(levels)})", "expected levels between 0 and 1.")
    known = {column.name: column for column in result.columns}
    wanted = list(figures) or [c.name for c in result.columns if not c.varied and not c.whole]
    found = order_statistics(lambda: result.blocks(wanted), wanted, levels)
    variables = {}
    for name, (values, counted) in found.items():
        attributes = {"units": known[name].unit, "long_name": known[name].text, "counted": counted}
        variables[name] = ("level", values, attributes)
    return xr.Dataset(variables, coords={"level": list(levels)})
