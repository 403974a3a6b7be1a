"""Comparators for observer coordinates, zero dynamics, normal coordinates and dynamic extension."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp
from answer_checks import Answers, Check, chains
from answer_facts import Facts, rank, vanishes


def _flat(plant: Facts, texts: Any) -> list[sp.Expr]:
    return [plant.parse(t) for part in texts for t in (part if isinstance(part, list | tuple) else [part])]


def _of_outputs(plant: Facts, functions: Sequence[sp.Expr]) -> bool:
    """Whether the functions depend on the state through h only."""
    stacked = plant.gradients([*plant.h, *functions])
    return rank(stacked, plant.samples()) == rank(plant.gradients(plant.h), plant.samples())


def _before(plant: Facts, z: Sequence[sp.Expr]) -> list[sp.Expr]:
    """The coordinate before each one in its block, 0 for the first; a block ends with a function of the outputs."""
    previous, last = [], sp.Integer(0)
    for coordinate in z:
        previous.append(last)
        last = sp.Integer(0) if _of_outputs(plant, [coordinate]) else coordinate
    return previous


def _observer_coordinates(plant: Facts, z: Sequence[sp.Expr]) -> str | None:
    if len(z) != len(plant.states) or rank(plant.gradients(z), plant.samples()) < len(z):
        return f"{list(z)} are no coordinates"
    if not _of_outputs(plant, [z[-1]]):
        return f"the last of {list(z)} is no function of the outputs"
    drifts = [plant.drift(c) - b for c, b in zip(z, _before(plant, z), strict=True)]
    slopes = [b for c in z for b in plant.by_inputs(c)]
    good = _of_outputs(plant, [*drifts, *slopes])
    return None if good else f"z' for z = {list(z)} has more than a shift and functions of y and u"


def _observer_T(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    wrong = _observer_coordinates(plant, _flat(plant, known[key]))
    return f"known answer: {wrong}" if wrong else _observer_coordinates(plant, found[key])


def _injects(plant: Facts, z: Sequence[sp.Expr], injection: Sequence[sp.Expr], inputs: bool) -> str | None:
    names = ["y"] if len(plant.h) == 1 else [f"y{k + 1}" for k in range(len(plant.h))]
    y = {sp.Symbol(n, real=True): h for n, h in zip(names, plant.h, strict=True)}
    if any(set(plant.states) & e.free_symbols for e in injection):
        return "an injection in the states"
    residuals = []
    for c, b, e in zip(z, _before(plant, z), injection, strict=True):
        rate = plant.drift(c)
        if inputs:
            rate += sum(k * u for k, u in zip(plant.by_inputs(c), plant.inputs, strict=True))
        residuals.append(rate - b - e.subs(y, simultaneous=True))
    return None if vanishes(residuals, plant.samples()) else f"the injection {list(injection)} does not fit"


def _observer_injection(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    """The known answers give the drift's part only."""
    wrong = _injects(plant, _flat(plant, known["observer_T"]), _flat(plant, known[key]), False)
    return f"known answer: {wrong}" if wrong else _injects(plant, found["observer_T"], found[key], True)


class _Held:
    """Zero dynamics as functions on the manifold."""

    def __init__(self, plant: Facts, value: Mapping[str, Any]) -> None:
        def read(table: Mapping[str, Any]) -> dict[sp.Symbol, sp.Expr]:
            rows = {sp.Symbol(k, real=True): e if isinstance(e, sp.Expr) else plant.parse(e) for k, e in table.items()}
            return rows

        self.plant = plant
        self.manifold = read(value["manifold"])
        self.u = [e if isinstance(e, sp.Expr) else plant.parse(e) for e in value["u"]]
        self.coords, self.rhs = read(value["coords"]), read(value["rhs"])

    def on(self, expression: sp.Expr) -> sp.Expr:
        return expression.subs(self.manifold, simultaneous=True)

    def rate(self, function: sp.Expr) -> sp.Expr:
        slopes = self.plant.by_inputs(function)
        return self.plant.drift(function) + sum((b * u for b, u in zip(slopes, self.u, strict=True)), sp.Integer(0))

    def wrong(self) -> str | None:
        plant, points = self.plant, self.plant.samples()
        rest = {**plant.point, **plant.parameters}
        outputs = [self.on(h) for h in plant.h]
        if not vanishes([(h - h.subs(rest)).subs(plant.parameters) for h in outputs], points):
            return "the outputs move on the manifold"
        if not vanishes([self.on(self.rate(x - e)) for x, e in self.manifold.items()], points):
            return "the inputs do not keep the plant on the manifold"
        rates = []
        for name, function in self.coords.items():
            value = self.rhs[name].subs(self.coords, simultaneous=True)
            rates.append(self.on(self.rate(function)) - self.on(value))
        if set(self.rhs) != set(self.coords) or not vanishes(rates, points):
            return "the coordinates do not move as told"
        free = [x for x in plant.states if x not in self.manifold]
        reduced = sp.Matrix([[sp.diff(self.on(c), x) for x in free] for c in self.coords.values()])
        full = len(self.coords) == len(free) and (not free or rank(reduced, points) == len(free))
        return None if full else "the coordinates do not describe the manifold"


def _zero_dynamics(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    value, expected = _Held(plant, found[key]), _Held(plant, known[key])
    wrong = value.wrong() or ((e := expected.wrong()) and f"known answer: {e}")
    if wrong:
        return wrong
    points = plant.samples()
    same = len(value.manifold) == len(expected.manifold)
    # parameters may sit at their values in one of the two
    residuals = [value.on(x - e) for x, e in expected.manifold.items()]
    residuals += [value.on(a - b) for a, b in zip(value.u, expected.u, strict=True)]
    same = same and vanishes([r.subs(plant.parameters) for r in residuals], points)
    return None if same else f"another manifold or input: {value.manifold}, {value.u}"


def _normal_coordinates(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    points = plant.samples()
    chain = [z for c in chains(plant, plant.h) or [] for z in c]
    for z in (list(found[key]), _flat(plant, known[key])):
        internal = z[len(chain) :]
        if rank(plant.gradients(z), points) < len(plant.states) or len(z) != len(plant.states):
            return f"{z} are no coordinates"
        if not vanishes([a - b for a, b in zip(z, chain, strict=False)], points):
            return f"{z} does not begin with the outputs and their derivatives"
        if not vanishes([b for e in internal for b in plant.by_inputs(e)], points):
            return f"an input enters the internal part of {z}"
    return None


def _extension(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    """The extended plant has the relative degrees told, an invertible decoupling matrix, and zeros of `det` there."""
    value, expected = found[key], known[key]
    if list(value["relative_degree"]) != list(expected["relative_degree"]):
        return f"relative degrees {value['relative_degree']} instead of {expected['relative_degree']}"
    states = tuple(sp.Symbol(n, real=True) for n in value["states"])
    if len(states) != len(plant.states) + expected["added"]:
        return f"{len(states) - len(plant.states)} states added instead of {expected['added']}"
    inputs = tuple(sp.Symbol(n, real=True) for n in value["inputs"])
    rates = sp.Matrix([value["rates"][x.name] for x in states])
    extended = Facts(
        states=states,
        inputs=inputs,
        parameters=plant.parameters,
        f=rates.subs(dict.fromkeys(inputs, 0)),
        g=rates.jacobian(list(inputs)),
        h=tuple(_flat(plant, expected["outputs"])),
        point=plant.point,
    )
    own = chains(extended, extended.h)
    if own is None or [len(c) for c in own] != list(expected["relative_degree"]):
        return "the extended plant has other relative degrees"
    decoupling = sp.Matrix([extended.by_inputs(c[-1]) for c in own])
    if not vanishes([abs(decoupling.det()) - abs(value["det"])], extended.samples()):
        return f"{value['det']} is not the determinant of the decoupling matrix"
    return None if rank(decoupling, extended.samples()) == len(inputs) else "the decoupling matrix is singular"


DYNAMIC: dict[str, Check] = {
    "observer_T": _observer_T,
    "observer_injection": _observer_injection,
    "zero_dynamics": _zero_dynamics,
    "normal_coordinates": _normal_coordinates,
    "dynamic_extension": _extension,
}
"""Comparator by key."""
