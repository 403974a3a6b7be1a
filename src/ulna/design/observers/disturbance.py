"""Extended-state observers: an unknown constant disturbance as a further state, estimated with the others.

Sources: Johnson, IEEE Trans. Autom. Contr. 16 (1971) 635-644; Han, IEEE Trans. Ind. Electron. 56 (2009) 900-906.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import sympy as sp

from ulna.base import DesignError
from ulna.design.gains import Gains
from ulna.design.observers.observer import Observer, exact_observer
from ulna.design.observers.observer_coordinates import observer_form
from ulna.plants import PlantLike, as_plant
from ulna.system import Signal, System, require_continuous


def with_disturbance(
    system: PlantLike, enters: Mapping[str, sp.Expr | int], *, disturbance: Signal | None = None
) -> System:
    """The plant with one further state d, d' = 0, added to its rates: x' = f(x, u) + e(x) d.

    Args:
        enters: e by state name; states left out are not reached by d.
        disturbance: name, unit and description of d; left out, it is called `disturbance`.

    Raises:
        DesignError: for an unknown state or a disturbance that enters nowhere.
    """
    system = as_plant(system)
    require_continuous(system)
    names = [s.name for s in system.states]
    unknown = [name for name in enters if name not in names]
    if unknown or all(e == 0 for e in enters.values()):
        raise DesignError(
            f"disturbance of '{system.name}'",
            f"no such state: {', '.join(unknown)}." if unknown else "it enters no rate.",
            f"Say how it enters the rates of {', '.join(names)}.",
        )
    signal = disturbance or Signal(name="disturbance", text="unknown constant disturbance")
    return replace(
        system,
        name=f"{system.name}, with {signal.name}",
        states=(*system.states, signal),
        rates=(
            *(
                rate + enters.get(state.name, 0) * signal.symbol
                for state, rate in zip(system.states, system.rates, strict=True)
            ),
            sp.Integer(0),
        ),
        operating_point=(*system.operating_point, (signal.name, sp.Integer(0))),
    )


def extended_state_observer(extended: PlantLike, gains: Gains) -> Observer:
    """The exact observer of a plant with its disturbance: the errors of states and disturbance decay with the poles.

    Args:
        extended: what `with_disturbance` gives.
        gains: one pole per state, the disturbance included.

    Raises:
        NoFormError: where the extended plant has no observer form; DesignError: where the gains do not fit.
    """
    return exact_observer(observer_form(extended), gains)
