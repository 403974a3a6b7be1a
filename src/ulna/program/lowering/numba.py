"""Generated source compiled by Numba: once a process, once a machine.

Text is made by `PYTHON.statements` below a header (`HEADER`, `GPU_HEADER`), with `error_model="numpy"` and
without `fastmath`: then every operation rounds as its instruction says.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
import types
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from ulna.base import OptionalDependencyError
from ulna.program.lowering.numba_header import GPU_HEADER, HEADER
from ulna.program.lowering.python_source import PYTHON, TEMPLATES, literal

__all__ = ["GPU_HEADER", "HEADER", "PYTHON", "TEMPLATES", "cache_folder", "compiled", "literal"]

# Numba looks at the time stamp of the source to tell whether its cache is of use; equal sources get equal stamps.
_STAMP = 1_000_000_000


def cache_folder() -> Path:
    """Where compiled loops are kept: `$XDG_CACHE_HOME/ulna/loops`, by default below `~/.cache`."""
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "ulna" / "loops"


@lru_cache(maxsize=64)
def compiled(source: str) -> Callable[..., Any]:
    """The function `loop` of a generated module.

    It is kept on disk under a name made from the source and the versions of Python, Numba and NumPy. A cache that
    cannot be read or written costs the time to compile, nothing else.

    Raises:
        OptionalDependencyError: without Numba.
    """
    try:
        import llvmlite
        import numba
        import numpy as np
    except ImportError:
        raise OptionalDependencyError("a sampled loop", "campaign") from None
    versions = f"{sys.version} {numba.__version__} {llvmlite.__version__} {np.__version__}"
    name = "loop_" + hashlib.sha256(f"{versions}\n{source}".encode()).hexdigest()[:32]
    path = _kept(name, source)
    if path is not None:
        try:
            return _executed(name, source, str(path), keep=True)
        except Exception:  # noqa: BLE001, S110 - whatever a damaged cache makes Numba raise, compiling anew cures it
            pass
    return _executed(name, source, f"<ulna {name}>", keep=False)


def _executed(name: str, source: str, file: str, *, keep: bool) -> Callable[..., Any]:
    module = types.ModuleType(name)
    module.__file__ = file
    module.__dict__["CACHE"] = keep
    sys.modules[name] = module  # Numba asks for the module of a function by its name
    exec(compile(source, file, "exec"), module.__dict__)  # noqa: S102 - written from kernels, never from a user's text
    return module.__dict__["loop"]


def _kept(name: str, source: str) -> Path | None:
    """The source as a file, written whole or not at all; None where that cannot be."""
    folder = cache_folder()
    path = folder / f"{name}.py"
    try:
        if path.is_file() and path.read_text(encoding="utf-8") == source:
            return path
        folder.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=folder, prefix=f".{name}.", suffix=".part")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(source)
            os.utime(part, (_STAMP, _STAMP))
            Path(part).replace(path)
        except OSError:
            Path(part).unlink(missing_ok=True)
            return None
        return path if os.access(folder, os.W_OK) else None
    except (OSError, UnicodeDecodeError, RuntimeError):
        return None
