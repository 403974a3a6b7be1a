"""What may stand for a system: a `System`, or any value that holds one as its `system`."""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias, runtime_checkable

from ulna.base import PlantError
from ulna.system.system import System


@runtime_checkable
class HasSystem(Protocol):
    """A law, an observer, a compensator, a closed loop, a form: whatever is a system or was made from one."""

    @property
    def system(self) -> System:
        """The system."""
        ...


SystemLike: TypeAlias = System | HasSystem
"""What every public verb accepts where a system is meant; `as_plant` of the catalogue accepts names besides."""


def as_system(given: Any) -> System:
    """The system that is meant: the value itself, or its `system`.

    Raises:
        PlantError: for anything else.
    """
    found = given if isinstance(given, System) else getattr(given, "system", None)
    if not isinstance(found, System):
        raise PlantError(
            f"a system from {str(given)[:60]!r}",
            f"it is of type {type(given).__name__}, which is not a System and has no `system`.",
            "Read a plant file with `read_system`, take one of the catalogue with `model`, or hand over a law, an "
            "observer or a closed loop.",
        )
    return found
