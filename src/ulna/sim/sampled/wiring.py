"""The loop as kernels: who reads whom by name, and every formula in the symbols of its role."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import sympy as sp

from ulna.base import SimulationError
from ulna.program import Hoisted, hoist
from ulna.sim.inputs import TIME
from ulna.sim.sampled.sampled import Sampled
from ulna.symbolic.compiling import kernel
from ulna.system import LinearInjection, Signal, System


@dataclass(frozen=True, slots=True, kw_only=True)
class Wiring:
    """Names and kernels of a sampled loop.

    Symbols of the kernels: x plant states, u driven inputs, d other inputs, t time, p plant parameters; z states of
    estimator and controller, y measured values, r references, q parameters of estimator and controller; numbered.

    Attributes:
        driven: plant inputs that the controller drives. others: the plant's other inputs that are not formulas of
            time. measured: what is read from the plant. references: by name. memory: states of estimator and
            controller. estimates: what estimator and controller show besides commands.
        observed: how many of the memory belong to the estimator.
        plant: x' (outputs `x'k`), measured values (`yk`) and the plant's outputs (`ok`), hoisted by p.
        controller: z' (`z'k`), injections (`wk`), estimates (`ek`) and commands (`ck`), hoisted by q.
        parameters: (q,) owner's name and value, None where it has none.
    """

    driven: tuple[Signal, ...]
    others: tuple[Signal, ...]
    measured: tuple[Signal, ...]
    references: tuple[Signal, ...]
    memory: tuple[Signal, ...]
    estimates: tuple[Signal, ...]
    observed: int
    plant: Hoisted
    controller: Hoisted
    parameters: tuple[tuple[str, sp.Expr | None], ...]


def numbered(stem: str, count: int) -> list[sp.Symbol]:
    """`count` real symbols stem0, stem1 and so on."""
    return [sp.Symbol(f"{stem}{k}", real=True) for k in range(count)]


def wire(plant: System, settings: Sampled, formulas: Mapping[str, sp.Expr]) -> Wiring:
    """The wiring of a plant and the controller in `settings`.

    Args:
        plant: what is controlled.
        settings: of the loop.
        formulas: plant inputs that are given as formulas of time.

    Raises:
        SimulationError: an input of the controller that nothing feeds, a controller that drives nothing.
    """
    controller, estimator = settings.controller, _estimator(settings)
    commanded = {s.name for s in controller.outputs}
    driven = tuple(s for s in plant.inputs if s.name in commanded)
    if not driven:
        raise SimulationError(
            f"loop of '{plant.name}' and '{controller.name}'",
            f"none of the outputs {_names(controller.outputs)} is an input of the plant.",
            f"The plant's inputs: {_names(plant.inputs)}.",
        )
    others = tuple(s for s in plant.inputs if s not in driven and s.name not in formulas)
    found = _Found(plant=plant, driven=driven, references=tuple(settings.references))
    owners = [controller] if estimator is None else [estimator, controller]
    renamed = _renamed(owners)
    estimates: dict[str, tuple[Signal, sp.Expr]] = {}
    seen: dict[sp.Symbol, sp.Expr] = {}
    if estimator is not None:
        sources = {s.symbol: found.source(estimator, s.name, {}) for s in estimator.inputs}
        seen = {**renamed[0], **sources}
        estimates = {
            s.name: (s, e.xreplace(seen))
            for s, e in zip(estimator.outputs, estimator.inline(estimator.readouts), strict=True)
        }
    inner = {s.symbol: found.source(controller, s.name, estimates) for s in controller.inputs}
    law = {**renamed[-1], **inner}
    rates = [e.xreplace(law) for e in controller.inline(controller.rates)]
    injections: list[sp.Expr] = []
    if estimator is not None:
        rates = [e.xreplace(seen) for e in estimator.inline(estimator.rates)] + rates
        if isinstance(settings.estimator, LinearInjection):
            injections = [e.xreplace(seen) for e in estimator.inline(settings.estimator.injection)]
    commands = {}
    for signal, readout in zip(controller.outputs, controller.inline(controller.readouts), strict=True):
        if signal in driven or signal.name in {s.name for s in driven}:
            commands[signal.name] = readout.xreplace(law)
        else:
            estimates[signal.name] = (signal, readout.xreplace(law))
    shown = [commands[s.name] for s in driven]
    return Wiring(
        driven=driven,
        others=others,
        measured=tuple(found.measured),
        references=tuple(found.used),
        memory=tuple(s for owner in owners for s in owner.states),
        estimates=tuple(s for s, _ in estimates.values()),
        observed=0 if estimator is None else len(estimator.states),
        plant=_plant_kernel(plant, driven, others, found.measured, formulas),
        controller=_controller_kernel(
            found, owners, rates, {"w": injections, "e": [e for _, e in estimates.values()], "c": shown}
        ),
        parameters=tuple((p.name, p.si_value) for owner in owners for p in owner.parameters),
    )


def _estimator(settings: Sampled) -> System | None:
    given = settings.estimator
    return given.system if isinstance(given, LinearInjection) else given


def _names(signals: Iterable[Signal]) -> str:
    return ", ".join(s.name for s in signals) or "none"


def _renamed(owners: list[System]) -> list[dict[sp.Symbol, sp.Symbol]]:
    """For each owner: its states to z, its parameters to q."""
    z = iter(numbered("z", sum(len(o.states) for o in owners)))
    q = iter(numbered("q", sum(len(o.parameters) for o in owners)))
    return [{**{s: next(z) for s in o.state_symbols}, **{s: next(q) for s in o.parameter_symbols}} for o in owners]


class _Found:
    """Collects what the controller reads while its inputs are looked up."""

    def __init__(self, *, plant: System, driven: tuple[Signal, ...], references: tuple[str, ...]) -> None:
        self.plant = plant
        self.driven = [s.name for s in driven]
        self.given = references
        self.measured: list[Signal] = []
        self.used: list[Signal] = []

    def source(self, owner: System, name: str, estimates: Mapping[str, tuple[Signal, sp.Expr]]) -> sp.Expr:
        """What feeds the input `name` of the owner."""
        for label in (f"{name}_hat", name):
            if label in estimates:
                return estimates[label][1]
        if name in self.given:
            return self._place("r", self.used, Signal(name=name))
        if name in self.driven:
            return sp.Symbol(f"u{self.driven.index(name)}", real=True)
        for signal in (*self.plant.outputs, *self.plant.states):
            if signal.name == name:
                return self._place("y", self.measured, signal)
        raise SimulationError(
            f"input '{name}' of '{owner.name}'",
            "nothing in the loop feeds it.",
            f"Give it: references={{'{name}': ...}}; the plant measures {_names(self.plant.outputs)}.",
        )

    @staticmethod
    def _place(stem: str, row: list[Signal], signal: Signal) -> sp.Symbol:
        names = [s.name for s in row]
        if signal.name not in names:
            row.append(signal)
            names.append(signal.name)
        return sp.Symbol(f"{stem}{names.index(signal.name)}", real=True)


def _plant_kernel(
    plant: System,
    driven: tuple[Signal, ...],
    others: tuple[Signal, ...],
    measured: list[Signal],
    formulas: Mapping[str, sp.Expr],
) -> Hoisted:
    given = {s.symbol: formulas[s.name] for s in plant.inputs if s.name in formulas}
    rows = (
        ("x", plant.state_symbols),
        ("u", [s.symbol for s in driven]),
        ("d", [s.symbol for s in others]),
        ("p", plant.parameter_symbols),
    )
    names: dict[sp.Symbol, sp.Symbol] = {}
    for stem, row in rows:
        names |= dict(zip(row, numbered(stem, len(row)), strict=True))
    inlined = {s.symbol: e for s, e in zip(plant.outputs, plant.inline(plant.readouts), strict=True)}
    outputs = {f"x'{k}": e for k, e in enumerate(plant.inline(plant.rates))}
    outputs |= {f"y{k}": inlined.get(s.symbol, s.symbol) for k, s in enumerate(measured)}
    outputs |= {f"o{k}": inlined[s.symbol] for k, s in enumerate(plant.outputs)}
    outputs = {label: e.xreplace(given).xreplace(names) for label, e in outputs.items()}
    held = numbered("p", len(plant.parameters))
    symbols = [symbol for symbol in names.values() if symbol not in held]
    # Always there, so that every loop has the same shape; it costs nothing where it is not used.
    whole = kernel(f"plant {plant.name}", [*symbols, TIME, *held], outputs, held=held)
    return hoist(whole, [p.name for p in held])


def _controller_kernel(
    found: _Found, owners: list[System], rates: list[sp.Expr], rows: Mapping[str, list[sp.Expr]]
) -> Hoisted:
    held = numbered("q", sum(len(o.parameters) for o in owners))
    symbols = [
        *numbered("z", len(rates)),
        *numbered("y", len(found.measured)),
        *numbered("u", len(found.driven)),
        *numbered("r", len(found.used)),
    ]
    outputs = {f"z'{k}": e for k, e in enumerate(rates)}
    for stem, row in rows.items():
        outputs |= {f"{stem}{k}": e for k, e in enumerate(row)}
    whole = kernel(f"controller {owners[-1].name}", [*symbols, *held], outputs, held=held)
    return hoist(whole, [q.name for q in held])
