"""`Picture`: how a plant is drawn, as the table `[picture]` of its file says it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from ulna.base import PlantError
from ulna.system.signal import Parameter, Signal

_STATE, _STATES, _PARAMETER, _NUMBER = "a state", "a list of states", "a parameter or a number", "a number"
_ZERO = ("right", "up", "left", "down")
_TURNS = ("clockwise", "anticlockwise")
_ANGLED: Mapping[str, Any] = {"zero": _ZERO, "turns": _TURNS}

KINDS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "arm": {"angle": _STATE, "current": _STATE, "load": _PARAMETER, "length": _PARAMETER, **_ANGLED},
        "pendulum": {"angle": _STATE, "wheel": _STATE, "mass": _PARAMETER, "length": _PARAMETER, **_ANGLED},
        "cart-pole": {"position": _STATE, "angle": _STATE, "length": _PARAMETER, "rope": _STATE, **_ANGLED},
        "two-link-arm": {"angles": _STATES, **_ANGLED},
        "tanks": {"levels": _STATES, "full": _NUMBER},
        "levitated-ball": {"position": _STATE, "current": _STATE, "far": _NUMBER},
        "masses": {"positions": _STATES, "reach": _NUMBER},
        "rotor": {"angle": _STATE, "speed": _STATE},
        "ball-and-beam": {"position": _STATE, "angle": _STATE, "reach": _NUMBER},
        "vehicle": {"x": _STATE, "y": _STATE, "heading": _STATE, "steering": _STATE, "trailer": _STATE},
        "aircraft": {"x": _STATE, "y": _STATE, "angle": _STATE},
    }
)
"""What each kind of picture shows, by role; `docs/plant-file.md` has the same table."""

_NEEDED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "cart-pole": ("position", "angle"),
        "levitated-ball": ("position",),
        "rotor": (),
        "ball-and-beam": ("position", "angle"),
        "vehicle": ("x", "y", "heading"),
        "aircraft": ("x", "y", "angle"),
    }
)
"""Roles that must be given, where they are others than the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """How a plant is drawn: nothing but names, and no part of what it does.

    Attributes:
        kind: one of `KINDS`.
        parts: (role, names of states or a parameter, a word, or a number) in the order of the file.
    """

    kind: str
    parts: tuple[tuple[str, str | float | tuple[str, ...]], ...]

    def with_values(self, values: Mapping[str, float]) -> Picture:
        """The same with numbers in place of parameters; a length or mass of zero is not drawn."""
        roles = KINDS[self.kind]
        parts = ((r, values.get(v, v) if roles[r] == _PARAMETER and isinstance(v, str) else v) for r, v in self.parts)
        return replace(self, parts=tuple((r, v) for r, v in parts if not isinstance(v, float) or v > 0))


def picture_of(data: Any, *, states: Sequence[Signal], parameters: Sequence[Parameter], where: str) -> Picture | None:
    """The picture that the table `[picture]` of a plant file describes; None for an empty one.

    Raises:
        PlantError: an unknown kind or part, a part that is missing, a name that the plant does not have.
    """
    if not data:
        return None
    asked = f"[picture] in {where}"
    kind = data.get("kind")
    if kind not in KINDS:
        raise PlantError(asked, f"kind = {kind!r} is unknown.", f"Known: {', '.join(KINDS)}.")
    roles = KINDS[kind]
    for role in data:
        if role != "kind" and role not in roles:
            raise PlantError(asked, f"{kind} has no part '{role}'.", f"Known: {', '.join(roles)}.")
    missing = [role for role in _NEEDED.get(kind, (next(iter(roles)),)) if role not in data]
    if missing:
        raise PlantError(asked, f"{kind} needs {missing[0]}.", f"Add {missing[0]} = {_example(roles[missing[0]])}.")
    names = {_STATE: [s.name for s in states], _PARAMETER: [p.name for p in parameters]}
    names[_STATES] = names[_STATE]
    parts = tuple(
        (role, _part(data[role], roles[role], names, f"{role} of {asked}")) for role in data if role != "kind"
    )
    return Picture(kind=kind, parts=parts)


def picture_to_mapping(picture: Picture) -> dict[str, Any]:
    """The table that `picture_of` reads back."""
    return {"kind": picture.kind} | {r: list(v) if isinstance(v, tuple) else _short(v) for r, v in picture.parts}


def _part(value: Any, what: Any, names: Mapping[str, Collection[str]], asked: str) -> str | float | tuple[str, ...]:
    if what == _NUMBER or (what == _PARAMETER and not isinstance(value, str)):
        return _size(value, asked)
    if isinstance(what, tuple):
        if value not in what:
            raise PlantError(asked, f"{value!r} is none of {', '.join(what)}.")
        return value
    if what == _STATES:
        if not isinstance(value, list | tuple) or not value:
            raise PlantError(asked, f"expected a list of states, found {value!r}.", f"Write {_example(what)}.")
        return tuple(str(_known(each, names[what], "state", asked)) for each in value)
    return _known(value, names[what], "state" if what == _STATE else "parameter", asked)


def _known(value: Any, names: Collection[str], what: str, asked: str) -> str:
    if not isinstance(value, str) or value not in names:
        raise PlantError(asked, f"the plant has no {what} {value!r}.", f"Known: {', '.join(names) or 'none'}.")
    return value


def _size(value: Any, asked: str) -> float:
    try:
        found = 0.0 if isinstance(value, str | bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = 0.0
    if not 0 < found < float("inf"):
        raise PlantError(asked, f"{value!r} is not a positive number.", "Give one in SI, 0.5 say.")
    return found


def _short(value: str | float) -> str | float | int:
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _example(what: Any) -> str:
    return '["x1", "x2"]' if what == _STATES else '"x1"'
