"""Which parameters are looked for: their names, where they begin, bounds and priors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from ulna.base import unit
from ulna.identification.errors import IdentificationError
from ulna.identification.fitting.prior import bounds_of, prior_of
from ulna.identification.fitting.problem import Free
from ulna.symbolic.compiling import rounded
from ulna.system import Parameter, System, declared_range


def free_parameters(
    plant: System, free: Sequence[str] | str, priors: Mapping[str, Any], bounds: Mapping[str, Any]
) -> tuple[Free, ...]:
    """The parameters that are looked for, with their starts, bounds and priors.

    Raises:
        IdentificationError: names that nothing has, one that is given twice, no value to start at, bounds that leave
            it out.
    """
    entries = free.split(",") if isinstance(free, str) else list(free)
    known = {p.name: p for p in plant.parameters}
    chosen: list[tuple[str, ...]] = []
    for entry in entries:
        names = [part.strip() for part in str(entry).split("=")]
        rows = [tuple(names)] if len(names) > 1 else [(name,) for name in _meant(plant, names[0])]
        chosen += rows
    if not chosen or not any(name for row in chosen for name in row):
        found = f"Known: {', '.join(known)}."
        raise IdentificationError(f"identification of '{plant.name}'", "no parameter is free.", found)
    flat = [name for row in chosen for name in row]
    for name in (*flat, *bounds):
        if name not in known:
            _meant(plant, name)
        if flat.count(name) > 1:
            raise IdentificationError(f"free '{name}'", "it is given twice.", "Name it once.")
    for name in (*bounds, *priors):
        if name not in flat and name not in [s.name for s in plant.states]:
            what = "bounds" if name in bounds else "prior"
            raise IdentificationError(f"{what} of '{name}'", "it is not free.", f"Free are: {', '.join(flat)}.")
    return tuple(_free(plant, known[row[0]], row[1:], priors, bounds) for row in chosen)


def _meant(plant: System, name: str) -> list[str]:
    """The parameters that a name or a word of their descriptions means."""
    known = [p.name for p in plant.parameters]
    if name in known:
        return [name]
    described = [p.name for p in plant.parameters if name and name.lower() in p.text.lower().split()]
    if described:
        return described
    near = get_close_matches(name, known, n=3, cutoff=0.4)
    guess = f"Did you mean {' or '.join(near)}? " if near else ""
    hint = f"{guess}Known: {', '.join(known) or 'none'}."
    raise IdentificationError(f"free '{name}'", f"'{plant.name}' has no parameter of this name.", hint)


def _free(
    plant: System,
    parameter: Parameter,
    followers: tuple[str, ...],
    priors: Mapping[str, Any],
    bounds: Mapping[str, Any],
) -> Free:
    name, exact = parameter.name, parameter.si_value
    value = None if exact is None else rounded(exact, plant.name)
    prior = None
    if name in priors:
        prior = prior_of(priors[name], f"prior of '{name}'", value=value, unit_text=parameter.unit)
    if name in bounds:
        lower, upper = bounds_of(bounds[name], f"bounds of '{name}'", unit_text=parameter.unit)
    else:
        lower, upper = _declared(parameter)
    begin = prior.mean if prior is not None else value
    if begin is None:
        if not (math.isfinite(lower) and math.isfinite(upper)):
            hint = f"Give a prior \"5 ± 50%\", or bounds of '{name}'."
            raise IdentificationError(f"free '{name}'", "it has no value from which the search can start.", hint)
        begin = math.sqrt(lower * upper) if lower > 0 else 0.5 * (lower + upper)
    if not lower <= begin <= upper:
        found = f"[{lower:g}, {upper:g}] does not contain {begin:g}, where the search starts."
        raise IdentificationError(f"bounds of '{name}'", found, "Widen them, or give a prior inside.")
    return Free(
        name=name,
        followers=followers,
        start=begin,
        lower=lower,
        upper=upper,
        prior=prior,
        unit=_si_unit(parameter),
    )


def _declared(parameter: Parameter) -> tuple[float, float]:
    found = declared_range(parameter)
    return (-math.inf, math.inf) if found is None else (float(found[0]), float(found[1]))


def _si_unit(parameter: Parameter) -> str:
    """The unit of its SI value: its own where that is coherent."""
    return parameter.unit if unit(parameter.unit).coherent else f"SI, {parameter.unit} in the plant"
