"""Who reads whom in a loop, by name, and every formula in the symbols of its role."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import SimulationError
from ulna.loop.parts import parts_of
from ulna.loop.reading import reading
from ulna.program import Hoisted, hoist
from ulna.symbolic.compiling import kernel
from ulna.system import KalmanFilter, LinearInjection, Signal, System

TIME = sp.Symbol("t", real=True)
"""The time in formulas, in seconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wiring:
    """Names and kernels of a loop.

    Symbols of the kernels: u driven inputs, t time, z states of estimator and controller, y measured values,
    r references, q parameters of estimator and controller; numbered.

    Attributes:
        name: of the law. plant: what is controlled.
        driven: plant inputs that the controller drives. disturbances: the plant's other inputs.
        measured: what is read from the plant. readings: of it, in the plant's symbols.
        references: inputs of the controller that nothing in the loop feeds.
        memory: states of estimator and controller. estimates: what they show besides commands.
        discrete: whether z' are the values one period later, of a controller in discrete time.
        observed: how many of the memory belong to the estimator.
        injected: the estimator, where its linear part is known. filter: the estimator, where it is a Kalman filter.
        controller: z' (`z'k`), injections (`wk`), a filter's rates of the plant (`fk`) and innovations (`vk`),
            estimates (`ek`) and commands (`ck`), hoisted by q.
        parameters: (q,) owner's name and value, None where it has none.
    """

    name: str
    plant: System
    driven: tuple[Signal, ...]
    disturbances: tuple[Signal, ...]
    measured: tuple[Signal, ...]
    readings: tuple[sp.Expr, ...]
    references: tuple[Signal, ...]
    memory: tuple[Signal, ...]
    estimates: tuple[Signal, ...]
    discrete: bool
    observed: int
    injected: LinearInjection | None
    filter: KalmanFilter | None
    controller: Hoisted
    parameters: tuple[tuple[str, sp.Expr | None], ...]


def numbered(stem: str, count: int) -> list[sp.Symbol]:
    """`count` real symbols stem0, stem1 and so on."""
    return [sp.Symbol(f"{stem}{k}", real=True) for k in range(count)]


def wire(plant: System, controller: Any) -> Wiring:
    """The wiring of a plant and a controller.

    Each input of the controller reads the estimate of this name (`x_hat`, then `x`), what the plant's input of this
    name gets, the plant's output, the plant's state; what is left is a reference.

    An estimator drives nothing: of what it estimates, something has the name `<state>_hat` or `<output>_hat`.

    Raises:
        SimulationError: a controller that drives and estimates nothing, an estimator and a law in different times, or
            a state and an output of one name.
    """
    parts = parts_of(controller)
    estimator = parts.observer
    observer = estimator.system if isinstance(estimator, LinearInjection | KalmanFilter) else estimator
    law = parts.law or _NOTHING
    commanded = {s.name for s in law.outputs}
    driven = tuple(s for s in plant.inputs if s.name in commanded)
    if not driven:
        _require_estimates(plant, parts.system)
    _require_one_time([each for each in (observer, law) if each is not None])
    found = _Found(plant=plant, driven=driven, states_first=parts.states_first)
    owners = [law] if observer is None else [observer, law]
    renamed = _renamed(owners)
    estimates: dict[str, tuple[Signal, sp.Expr]] = {}
    seen: dict[sp.Symbol, sp.Expr] = {}
    if observer is not None:
        seen = {**renamed[0], **{s.symbol: found.source(s, {}) for s in observer.inputs}}
        estimates = {
            s.name: (s, e.xreplace(seen))
            for s, e in zip(observer.outputs, observer.inline(observer.readouts), strict=True)
        }
    meaning = {**renamed[-1], **{s.symbol: found.source(s, estimates) for s in law.inputs}}
    rates = [e.xreplace(meaning) for e in law.inline(law.rates)]
    rows: dict[str, list[sp.Expr]] = {}
    if observer is not None:
        rates = [e.xreplace(seen) for e in observer.inline(observer.rates)] + rates
        if isinstance(estimator, LinearInjection):
            rows["w"] = [e.xreplace(seen) for e in observer.inline(estimator.injection)]
        if isinstance(estimator, KalmanFilter):
            rows |= {"f": [e.xreplace(seen) for e in estimator.rates]}
            rows |= {"v": [e.xreplace(seen) for e in estimator.innovations]}
    commands = {}
    for signal, readout in zip(law.outputs, law.inline(law.readouts), strict=True):
        if signal.name in found.driven:
            commands[signal.name] = readout.xreplace(meaning)
        else:
            estimates[signal.name] = (signal, readout.xreplace(meaning))
    rows |= {"e": [e for _, e in estimates.values()], "c": [commands[s.name] for s in driven]}
    return Wiring(
        name=parts.system.name if parts.law is None else law.name,
        plant=plant,
        driven=driven,
        disturbances=tuple(s for s in plant.inputs if s not in driven),
        measured=tuple(found.measured),
        readings=tuple(found.readings),
        references=tuple(found.references),
        memory=tuple(s for owner in owners for s in owner.states),
        estimates=tuple(s for s, _ in estimates.values()),
        discrete=any(owner.discrete for owner in owners),
        observed=0 if observer is None else len(observer.states),
        injected=estimator if isinstance(estimator, LinearInjection) else None,
        filter=estimator if isinstance(estimator, KalmanFilter) else None,
        controller=_controller_kernel(found, owners, rates, rows),
        parameters=tuple((p.name, p.si_value) for owner in owners for p in owner.parameters),
    )


_NOTHING = System(name="no law", states=(), rates=())


def _require_estimates(plant: System, controller: System) -> None:
    estimates = {f"{s.name}_hat" for s in (*plant.states, *plant.outputs)}
    if estimates.isdisjoint(s.name for s in controller.outputs):
        raise SimulationError(
            f"loop of '{plant.name}' and '{controller.name}'",
            f"none of the outputs {_names(controller.outputs)} is an input of the plant, or the estimate of a state.",
            f"The plant's inputs: {_names(plant.inputs)}; estimates are called {', '.join(sorted(estimates)[:3])}.",
        )


def _require_one_time(owners: list[System]) -> None:
    """Refuse an estimator and a law whose states move in different times."""
    if len({owner.period for owner in owners if owner.states or owner.discrete}) > 1:
        found = "; ".join(f"'{owner.name}' moves in {owner.time_text}" for owner in owners)
        raise SimulationError("a controller of two parts", f"{found}.", "Give both the same period, or none.")


def _names(signals: Iterable[Signal]) -> str:
    return ", ".join(s.name for s in signals) or "none"


def _renamed(owners: list[System]) -> list[dict[sp.Symbol, sp.Symbol]]:
    """For each owner: its states to z, its parameters to q."""
    z = iter(numbered("z", sum(len(o.states) for o in owners)))
    q = iter(numbered("q", sum(len(o.parameters) for o in owners)))
    return [{**{s: next(z) for s in o.state_symbols}, **{s: next(q) for s in o.parameter_symbols}} for o in owners]


class _Found:
    """Collects what the controller reads while its inputs are looked up."""

    def __init__(self, *, plant: System, driven: tuple[Signal, ...], states_first: bool) -> None:
        self.plant = plant
        self.states_first = states_first
        self.driven = [s.name for s in driven]
        self.measured: list[Signal] = []
        self.readings: list[sp.Expr] = []
        self.references: list[Signal] = []

    def source(self, wanted: Signal, estimates: Mapping[str, tuple[Signal, sp.Expr]]) -> sp.Expr:
        """What feeds this input."""
        name = wanted.name
        for label in (f"{name}_hat", name):
            if label in estimates:
                return estimates[label][1]
        if name in self.driven:
            return sp.Symbol(f"u{self.driven.index(name)}", real=True)
        found = reading(self.plant, name, states_first=self.states_first)
        if found is not None:
            if found.signal.name not in {s.name for s in self.measured}:
                self.readings.append(found.expression)
            return self._place("y", self.measured, found.signal)
        return self._place("r", self.references, wanted)

    @staticmethod
    def _place(stem: str, row: list[Signal], signal: Signal) -> sp.Symbol:
        names = [s.name for s in row]
        if signal.name not in names:
            row.append(signal)
            names.append(signal.name)
        return sp.Symbol(f"{stem}{names.index(signal.name)}", real=True)


def _controller_kernel(
    found: _Found, owners: list[System], rates: list[sp.Expr], rows: Mapping[str, list[sp.Expr]]
) -> Hoisted:
    held = numbered("q", sum(len(o.parameters) for o in owners))
    symbols = [
        *numbered("z", len(rates)),
        *numbered("y", len(found.measured)),
        *numbered("u", len(found.driven)),
        *numbered("r", len(found.references)),
    ]
    outputs = {f"z'{k}": e for k, e in enumerate(rates)}
    for stem, row in rows.items():
        outputs |= {f"{stem}{k}": e for k, e in enumerate(row)}
    whole = kernel(f"controller {owners[-1].name}", [*symbols, *held], outputs, held=held)
    return hoist(whole, [q.name for q in held])
