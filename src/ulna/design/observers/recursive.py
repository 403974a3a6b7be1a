"""Parameters estimated while the plant moves: they join the states, and a Kalman filter follows all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import sympy as sp

from ulna.base import DesignError, unit
from ulna.design.observers.extended_kalman import KalmanNoise, extended_kalman_filter
from ulna.design.observers.observer import Observer
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.formulas import exact
from ulna.system import Parameter, Signal, System, require_continuous

USUAL = sp.Rational(1, 2)
"""Share of its value by which a parameter may be wrong where nothing says how sure it is."""


def with_unknowns(system: PlantLike, free: Sequence[str]) -> System:
    """The plant with parameters as further states that keep still, p' = 0, the others at their values.

    Args:
        system: in continuous time. free: names of the parameters.

    Raises:
        DesignError: no name, an unknown one, or one without a value to start at.
    """
    plant = as_plant(system)
    require_continuous(plant)
    known = {p.name: p for p in plant.parameters}
    asked = f"unknown parameters of '{plant.name}'"
    for name in free:
        if name not in known:
            raise DesignError(asked, f"there is no '{name}'.", f"Known: {', '.join(known) or 'none'}.")
        if known[name].value is None:
            raise DesignError(asked, f"'{name}' has no value to start at.", "Give it one in the plant.")
    if not free:
        raise DesignError(asked, "none is named.", f"Known: {', '.join(known) or 'none'}.")
    fixed = plant.with_values({n: p.si_value for n, p in known.items() if p.si_value is not None and n not in free})
    chosen = [known[name] for name in free]
    return replace(
        fixed,
        name=f"{plant.name}, with {', '.join(free)} unknown",
        states=(*fixed.states, *(Signal(name=p.name, unit=_si(p), text=p.text) for p in chosen)),
        rates=(*fixed.rates, *([sp.S.Zero] * len(chosen))),
        parameters=tuple(p for p in fixed.parameters if p.name not in free),
        operating_point=(*fixed.operating_point, *((p.name, exact(p.si_value)) for p in chosen)),
        correlations=(),
    )


def recursive_estimator(
    system: PlantLike,
    free: Sequence[str],
    *,
    noise: KalmanNoise | None = None,
    spread: Mapping[str, Any] | None = None,
    drift: Mapping[str, Any] | None = None,
) -> Observer:
    """An observer of states and parameters: what the plant is made of becomes known while it moves.

    It is the recursive form of a prediction-error fit (`identify`): an extended Kalman filter of the plant with the
    parameters as states. Its outputs are `<state>_hat` and `<parameter>_hat`, which begins at the plant's value.
    Whether parameters can be known at all says `identifiability`; at rest most of them cannot.

    Args:
        system: the plant, in continuous time. free: names of the parameters.
        noise: of the plant's states and outputs, as of `extended_kalman_filter`.
        spread: SI standard deviation of parameters at the start; left out, the plant's own `std`, else half the value.
        drift: SI standard deviation by which a parameter walks in one second; left out 0, for one that is constant.
            A load that is taken up is followed the faster the larger its drift.

    Raises:
        DesignError: names that do not fit, numbers out of range.
        PlantError: a plant without output.

    Reference:
        L. Ljung, "Asymptotic behavior of the extended Kalman filter as a parameter estimator for linear systems", IEEE
        Transactions on Automatic Control 24 (1979); L. Ljung, System Identification, 2nd ed., section 11.7.

    Examples:
        >>> observer = ulna.recursive_estimator("mass_spring_damper", ["k"])
        >>> [output.name for output in observer.system.outputs]
        ['p_hat', 's_hat', 'k_hat']
    """
    plant, noise = as_plant(system), noise or KalmanNoise()
    extended = with_unknowns(plant, free)
    chosen = [p for name in free for p in plant.parameters if p.name == name]
    for given, what in ((spread or {}, "spread"), (drift or {}, "drift")):
        strange = [name for name in given if name not in free]
        if strange:
            raise DesignError(f"{what} of '{strange[0]}'", "it is not estimated.", f"Estimated: {', '.join(free)}.")
    widths = {p.name: exact((spread or {}).get(p.name, _spread(p))) for p in chosen}
    walks = {p.name: exact((drift or {}).get(p.name, 0)) for p in chosen}
    names = [s.name for s in plant.states]
    whole = KalmanNoise(
        process={**_named(noise.process, names), **{name: walk**2 for name, walk in walks.items()}},
        measurement=noise.measurement,
        covariance={**_named(noise.covariance, names), **{name: width**2 for name, width in widths.items()}},
    )
    found = extended_kalman_filter(extended, whole)
    begun = {f"{p.name}_hat": exact(p.si_value) for p in chosen}
    return replace(found, initial={**found.initial, **begun})


def _spread(parameter: Parameter) -> Any:
    return parameter.si_std if parameter.si_std is not None else abs(exact(parameter.si_value)) * USUAL


def _named(values: Sequence[Any] | Mapping[str, Any] | None, names: Sequence[str]) -> dict[str, Any]:
    if values is None or isinstance(values, Mapping):
        return dict(values or {})
    if len(values) != len(names):
        found = f"{len(values)} numbers given, {len(names)} needed ({', '.join(names)})."
        raise DesignError("noise of the states", found, "Those of the parameters are spread= and drift=.")
    return dict(zip(names, values, strict=True))


def _si(parameter: Parameter) -> str:
    return parameter.unit if unit(parameter.unit).coherent else ""
