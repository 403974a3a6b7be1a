"""What `ulna sweep` varies, and the plan of its runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from ulna.cli.typed_values import number_list

if TYPE_CHECKING:
    from ulna.system import System

POSTERIOR = "posterior"
"""What stands for all parameters of a plant that have a standard deviation."""

_VARY = re.compile(r"\s*([^\W\d]\w*)\s*=\s*(\w+)\((.*)\)\s*")
_MOST_STEPS = 100_000
"""Of one axis of a grid, whose values all stand in the settings of the campaign."""


class Sampling(StrEnum):
    """How the runs are drawn from the distributions."""

    random = "random"
    latin = "latin"
    sobol = "sobol"
    indices = "indices"


def plan_of(plant: System, vary: Sequence[str], runs: int, seed: int, sampling: Sampling) -> Any:
    """The plan of a campaign that entries like `m2=uniform(0,5)` or, throughout, `m2=steps(0,5,21)` ask for.

    Raises:
        UlnaError: an entry that cannot be read, a name that is given twice, a grid mixed with chance.
    """
    from ulna.campaign import CampaignError, Grid, LatinHypercube, Random, Saltelli, Sobol, posterior

    fitted = posterior(plant) if any(text.strip() == POSTERIOR for text in vary) else None
    read = [_varied(text) for text in vary if text.strip() != POSTERIOR]
    read += list(fitted.vary.items()) if fitted is not None else []
    together = fitted.correlations if fitted is not None else ()
    names = [name for name, _ in read]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise CampaignError(f"--vary {min(twice)}", "it is given twice.", "Vary a quantity once.")
    axes = {name: found for name, found in read if isinstance(found, list)}
    if axes:
        if len(axes) < len(read):
            drawn = next(name for name, found in read if not isinstance(found, list))
            raise CampaignError(
                f"--vary {drawn}", "it is random, while others are on a grid.", "Give steps(...) or values(...)."
            )
        return Grid(axes=axes, seed=seed)
    spread: dict[str, Any] = dict(read)
    match sampling:
        case Sampling.random:
            return Random(vary=spread, runs=runs, seed=seed, correlations=together)
        case Sampling.latin:
            return LatinHypercube(vary=spread, runs=runs, seed=seed, correlations=together)
        case Sampling.sobol:
            return Sobol(vary=spread, runs=runs, seed=seed, correlations=together)
        case Sampling.indices:
            return Saltelli(vary=spread, base=runs, seed=seed, correlations=together)


def map_axes(text: str, varied: tuple[str, ...]) -> tuple[str, ...]:
    """What the map is drawn over: two of the varied quantities, the first two where the text is empty.

    Raises:
        UlnaError: others, or not two.
    """
    from ulna.campaign import CampaignError

    if not text:
        return varied[:2]
    names = tuple(name.strip() for name in text.split(","))
    if len(set(names)) != 2 or not set(names) <= set(varied):
        found = f"expected two of the varied quantities; varied: {', '.join(varied)}."
        raise CampaignError(f"--map '{text}'", found, "Write --map m2,theta.")
    return names


def _varied(text: str) -> tuple[str, Any]:
    """Name, and a distribution or the values of a grid's axis."""
    import numpy as np

    from ulna.campaign import CampaignError

    match = _VARY.fullmatch(text)
    if match is None:
        raise CampaignError(f"--vary '{text}'", "it cannot be read.", "Write --vary 'm2=uniform(0,5)'.")
    name, kind, inside = match.groups()
    numbers = number_list(inside, f"--vary {name}")
    counts = {"uniform": (2,), "loguniform": (2,), "normal": (2, 4), "steps": (3,), "choice": None, "values": None}
    if kind not in counts:
        raise CampaignError(f"--vary '{text}'", f"'{kind}' is unknown.", f"Known: {', '.join(counts)}.")
    wanted = counts[kind]
    if wanted is not None and len(numbers) not in wanted:
        due = " or ".join(map(str, wanted))
        raise CampaignError(f"--vary '{text}'", f"it has {len(numbers)} numbers, {kind} takes {due}.")
    if kind == "values":
        return name, numbers
    if kind != "steps":
        try:
            return name, _distribution(kind, numbers)
        except CampaignError as error:
            raise CampaignError(f"--vary '{text}'", error.found, error.hint) from None
    if not (1 <= numbers[2] <= _MOST_STEPS and numbers[2] == int(numbers[2])):
        raise CampaignError(
            f"--vary '{text}'",
            f"{numbers[2]:g} is not a number of steps from 1 to {_MOST_STEPS}.",
            "Write steps(0,5,21).",
        )
    return name, [float(v) for v in np.linspace(numbers[0], numbers[1], int(numbers[2]))]


def _distribution(kind: str, numbers: Sequence[float]) -> Any:
    from ulna.campaign import Choice, LogUniform, Normal, Uniform

    if kind == "choice":
        return Choice(values=tuple(numbers))
    if kind == "normal":
        low, high = numbers[2:] or (float("-inf"), float("inf"))
        return Normal(mean=numbers[0], std=numbers[1], low=low, high=high)
    return (Uniform if kind == "uniform" else LogUniform)(low=numbers[0], high=numbers[1])
