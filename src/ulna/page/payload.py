"""What a page says of its loops beside their programs: how the plant is drawn, where it rests, what can be pushed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ulna.base import UlnaError
from ulna.loop import Loop
from ulna.page.start import point_of, reference_at_start
from ulna.system import Equilibrium, System, equilibria, equilibrium, linearise

_MOST_PUSHES = 6
_NO_PLACES = ("current", "speed", "wheel", "steering", "rope")
"""Roles in a picture that a hand does not take hold of."""
_STILL = 1e-6
"""A rate that nobody sees, SI."""
_SEARCH = 2.0
"""s for the points of rest of a plant alone."""


def velocities(plant: System) -> dict[str, str]:
    """By position the state that is its rate, as it stands."""
    names = {s.symbol: s.name for s in plant.states}
    rows = zip(plant.states, plant.inline(plant.rates), strict=True)
    return {s.name: names[rate] for s, rate in rows if rate in names and names[rate] != s.name}


def pushed_states(plant: System) -> tuple[str, ...]:
    """The states to whose rates a hand adds: the velocities of what is drawn, else what is drawn, else any velocity."""
    if plant.discrete:
        return ()
    pairs, drawn = velocities(plant), pictured_states(plant)
    moved = [pairs[name] for name in drawn if name in pairs] or list(drawn) or list(pairs.values())
    moved = moved or [plant.states[0].name]
    return tuple(dict.fromkeys(moved))[:_MOST_PUSHES]


def _angles_first(part: tuple[str, Any]) -> bool:
    return part[0] not in ("angle", "angles")


def pictured_states(plant: System) -> tuple[str, ...]:
    """The states that the picture shows as places, angles first."""
    if plant.picture is None:
        return ()
    names = {s.name for s in plant.states}
    parts = [v for role, v in sorted(plant.picture.parts, key=_angles_first) if role not in _NO_PLACES]
    rows = [each if isinstance(each, tuple) else (each,) for each in parts]
    return tuple(str(name) for row in rows for name in row if name in names)


def shown_states(plant: System) -> dict[str, str]:
    """By output the state that it is, where it is one."""
    names = {s.symbol: s.name for s in plant.states}
    return {o.name: names[e] for o, e in zip(plant.outputs, plant.inline(plant.readouts), strict=True) if e in names}


def begin(plant: System, *, closed: bool) -> dict[str, float]:
    """Where a page begins, in SI by state: beside the rest, in what is controlled or drawn first.

    Args:
        plant: with numbers for its parameters. closed: whether a controller brings it back.
            Else it begins farther off.
    """
    found = point_of(plant)
    start = {s.name: found.get(s.name, 0.0) for s in plant.states}
    shown = shown_states(plant)
    wanted = [shown[o.name] for o in plant.outputs if o.controlled and o.name in shown] if closed else []
    names = dict.fromkeys([*wanted, *pictured_states(plant), *start])
    starts = [start | {name: _beside(plant, name, start[name], closed=closed)} for name in names]
    # A plant alone that rests anywhere, as a cart does, is moved in something else.
    return starts[0] if closed else next((each for each in starts if _moves(plant, found | each)), starts[0])


def _beside(plant: System, name: str, rest: float, *, closed: bool) -> float:
    signal = next(s for s in plant.states if s.name == name)
    step = (0.1 if closed else 0.3) * abs(rest) if rest else 0.2 if closed else 0.3
    low, high = (None if each is None else float(each) for each in (signal.lower, signal.upper))
    if low is not None and high is not None:
        step = min(step, 0.1 * (high - low))
    return rest + step if high is None or rest + step <= high else rest - step


def _moves(plant: System, point: Mapping[str, float]) -> bool:
    """Whether anything changes at a point."""
    values = {s.symbol: sp.Float(point.get(s.name, 0.0)) for s in (*plant.states, *plant.inputs)}
    try:
        return any(abs(complex(each.xreplace(values))) > _STILL for each in plant.inline(plant.balances))
    except (TypeError, ValueError, OverflowError):
        return False  # no number there: nowhere to begin


def plane_axes(plant: System) -> dict[str, str] | None:
    """The axes that the phase plane begins with: a position and its velocity; None for a single state."""
    if len(plant.states) < 2:
        return None
    pairs, drawn = velocities(plant), pictured_states(plant)
    first = next((name for name in drawn if name in pairs), next(iter(pairs), plant.states[0].name))
    other = next(s.name for s in plant.states if s.name != first)
    return {"x": first, "y": pairs.get(first, other)}


def poles_of(loop: Loop | System, values: Mapping[str, float]) -> list[list[float]]:
    """(real, imaginary) of every pole at rest, of a loop without its hardware; empty where none is found."""
    try:
        system = loop if isinstance(loop, System) else Loop(plant=loop.plant, controller=loop.controller).system
        known = {name: value for name, value in values.items() if name in {p.name for p in system.parameters}}
        numbered = system.with_parameters(known).with_values()
        plant = (loop if isinstance(loop, System) else loop.plant).with_parameters(values).with_values()
        eigenvalues = linearise(_rest(numbered, point_of(plant))).eigenvalues
    except (UlnaError, ValueError, TypeError, ArithmeticError):
        return []
    return [[float(each.real), float(each.imag)] for each in eigenvalues]


def _rest(system: System, point: Mapping[str, float]) -> Equilibrium:
    """Where the loop rests beside its plant: by Newton's method from there, else the operating point of its own."""
    near = {s.name: point[n] for s in system.states if (n := s.name.removesuffix("_hat")) in point}
    inputs = {s.name: reference_at_start(s.name, {}, point) for s in system.inputs}
    try:
        return equilibrium(system, near=near, inputs=inputs)
    except UlnaError:
        return equilibrium(system)


def rests_of(plant: System, poles: Sequence[Sequence[float]], *, closed: bool) -> tuple[list[dict[str, Any]], str]:
    """The points of rest that the phase plane shows, and a sentence where there is none.

    Args:
        plant: with numbers for its parameters. poles: of the loop, which say whether its point is stable.
        closed: whether a controller holds one of them; of a plant alone all are shown.
    """
    names = [s.name for s in plant.states]
    try:
        if closed:
            found = equilibrium(plant)
            stable = bool(poles) and all(re < 0 for re, _ in poles)
            return [{"at": {name: float(found[name]) for name in names}, "stable": stable}], ""
        points = [point for point in equilibria(plant, seconds=_SEARCH).points if not point.system.discrete]
        return [
            {"at": {name: float(point[name]) for name in names}, "stable": _stable(plant, point)} for point in points
        ], ""
    except (UlnaError, ValueError, TypeError, ArithmeticError):
        return [], "No point of rest was found, so the phase plane shows none."


def _stable(plant: System, point: Any) -> bool:
    return all(each.real < 0 for each in linearise(plant, point).eigenvalues)


def picture_data(plant: System) -> dict[str, Any] | None:
    """The picture as the view reads it."""
    if plant.picture is None:
        return None
    return {
        "kind": plant.picture.kind,
        "parts": {r: list(v) if isinstance(v, tuple) else v for r, v in plant.picture.parts},
    }
