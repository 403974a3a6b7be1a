"""ulna: from a nonlinear plant written as equations to a proven output-feedback controller.

Public names live in packages of their own (`ulna.base`, `ulna.system`, ...) and are re-exported here. Nothing is
imported before it is used, so that `import ulna` costs next to nothing. To add a name: one line in `_HOME`, one import
in the block for type checkers; `tests/house/test_house_public_names.py` compares the two.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from ulna.base import Status as Status
    from ulna.base import UlnaError as UlnaError
    from ulna.base import Verdict as Verdict

_HOME = {
    "Status": "ulna.base",
    "UlnaError": "ulna.base",
    "Verdict": "ulna.base",
}

__all__ = ["__version__", *_HOME]  # noqa: PLE0604 (the names are strings)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import the public name at its first use and keep it."""
    if name not in _HOME:
        raise AttributeError(f"module 'ulna' has no attribute {name!r}", name=name, obj=None)
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
