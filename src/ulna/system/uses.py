"""What a plant's outputs are for: some are measured, some are to be controlled; both unless it is said."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ulna.base import PlantError
from ulna.system.holder import SystemLike, as_system
from ulna.system.system import System


def with_uses(
    system: SystemLike, *, controlled: Sequence[str] | None = None, measured: Sequence[str] | None = None
) -> System:
    """The system with only these outputs controlled, only these measured; what is left out stays as it is.

    Laws, relative degrees and zero dynamics are about the controlled outputs, observers about the measured ones.

    Args:
        controlled, measured: names of outputs; of controlled ones in the order in which a law is to take them.

    Raises:
        PlantError: a name that is no output, an output that is given twice.

    Examples:
        >>> plant = ulna.with_uses(ulna.model("one_link_arm"), measured=[])
        >>> plant.outputs[0].measured
        False
    """
    system = as_system(system)
    for what, names in (("controlled", controlled), ("measured", measured)):
        _check(system, what, names)
    rows = dict(zip((s.name for s in system.outputs), zip(system.outputs, system.readouts, strict=True), strict=True))
    order = [*(controlled or ()), *(name for name in rows if name not in (controlled or ()))]
    outputs = [
        replace(
            rows[name][0],
            controlled=rows[name][0].controlled if controlled is None else name in controlled,
            measured=rows[name][0].measured if measured is None else name in measured,
        )
        for name in order
    ]
    return replace(system, outputs=tuple(outputs), readouts=tuple(rows[name][1] for name in order))


def controlled_part(system: System) -> System:
    """The system with its controlled outputs alone, for which both uses are meant."""
    return _only(system, [s.name for s in system.outputs if s.controlled])


def measured_part(system: System) -> System:
    """The system with its measured outputs alone, for which both uses are meant."""
    return _only(system, [s.name for s in system.outputs if s.measured])


def _only(system: System, names: Iterable[str]) -> System:
    kept = set(names)
    if all(s.controlled and s.measured for s in system.outputs):
        return system
    rows = [(s, e) for s, e in zip(system.outputs, system.readouts, strict=True) if s.name in kept]
    shown = tuple(replace(s, controlled=True, measured=True) for s, _ in rows)
    return replace(system, outputs=shown, readouts=tuple(e for _, e in rows))


def _check(system: System, what: str, names: Sequence[str] | None) -> None:
    known = [s.name for s in system.outputs]
    for name in names or ():
        asked = f"{what} outputs of '{system.name}'"
        if name not in known:
            raise PlantError(asked, f"there is no output '{name}'.", f"Its outputs: {', '.join(known) or 'none'}.")
        if list(names or ()).count(name) > 1:
            raise PlantError(asked, f"'{name}' is given twice.", "Name it once.")
