"""`posterior`: how surely a fitted plant's parameters are known, as what a plan varies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans.probability import Normal
from ulna.system import SystemLike, as_system, declared_range


@dataclass(frozen=True, slots=True, kw_only=True)
class Posterior:
    """The chances that records, or data sheets, leave the parameters of a plant.

    Attributes:
        vary: by name a normal distribution about the plant's value, cut at its declared range; SI.
        correlations: (name, name, number) of those that are uncertain together.
    """

    vary: Mapping[str, Normal]
    correlations: tuple[tuple[str, str, float], ...]

    def box(self, sigmas: float = 2.0) -> dict[str, tuple[float, float]]:
        """(lower, upper) by name, so many standard deviations either side but within the declared range; SI."""
        return {
            name: (max(each.low, each.mean - sigmas * each.std), min(each.high, each.mean + sigmas * each.std))
            for name, each in self.vary.items()
        }


def posterior(plant: SystemLike) -> Posterior:
    """What a plan varies so that it draws a plant's parameters from how surely they are known.

    They are the parameters with a standard deviation, `std` in the plant file, and its `[correlation]`: those that a
    fit wrote. One that the fit did not tell has none and stays at its value.

    Args:
        plant: a system, or what holds one, as a `Fit` does.

    Raises:
        CampaignError: no parameter has a standard deviation.

    Examples:
        >>> from ulna import posterior, system_from_mapping
        >>> known = {"m": {"value": 2, "std": 0.1}, "k": {"value": 5, "std": 1, "range": [0, 9]}}
        >>> lag = {"name": "lag", "parameters": known, "states": {"x": "-k*x/m"}, "correlation": {"k": {"m": 0.8}}}
        >>> told = posterior(system_from_mapping(lag))
        >>> told.box(2.0), told.correlations
        ({'m': (1.8, 2.2), 'k': (3.0, 7.0)}, (('k', 'm', 0.8),))
    """
    system = as_system(plant)
    found = {}
    for parameter in system.parameters:
        value, std = parameter.si_value, parameter.si_std
        if value is None or std is None:
            continue
        low, high = declared_range(parameter) or (-float("inf"), float("inf"))
        found[parameter.name] = Normal(mean=float(value), std=float(std), low=low, high=high)
    if not found:
        raise CampaignError(
            f"how surely the parameters of '{system.name}' are known",
            "none of them has a standard deviation.",
            "Fit them to a record (`ulna identify ... --out fitted.toml`), or write std = ... beside their values.",
        )
    pairs = tuple((a, b, float(r)) for a, b, r in system.correlations if a in found and b in found)
    return Posterior(vary=found, correlations=pairs)
