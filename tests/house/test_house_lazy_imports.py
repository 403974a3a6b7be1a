"""What `import ulna` and `ulna --help` are allowed to load."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).with_name("ulna")
HEAVY = {"casadi", "flint", "gmpy2", "heyoka", "matplotlib", "numba", "numpy", "pandas", "scipy", "symengine"}
HEAVY |= {"sympy", "xarray"}


def _loaded_after(code: str) -> set[str]:
    """The top-level packages that are loaded after `code` ran in a fresh process."""
    listing = "; import sys; print(*{name.partition('.')[0] for name in sys.modules}, sep='\\n')"
    result = subprocess.run([sys.executable, "-c", code + listing], capture_output=True, text=True, check=True)
    return set(result.stdout.split())


def test_importing_ulna_loads_no_heavy_library() -> None:
    assert not _loaded_after("import ulna") & HEAVY


def test_the_command_line_loads_no_heavy_library_before_a_command_runs() -> None:
    assert not _loaded_after("import ulna.cli.main") & HEAVY


def test_a_heavy_library_is_noticed() -> None:
    assert _loaded_after("import numpy") & HEAVY == {"numpy"}


@pytest.mark.parametrize("arguments", [["--help"], ["--version"]])
def test_the_program_answers_in_well_under_a_second(arguments: list[str]) -> None:
    """Counted in seconds of work, of the best of three: a loaded machine says nothing about the program."""
    seconds = []
    for _ in range(3):
        before = _work_of_children()
        subprocess.run([PROGRAM, *arguments], capture_output=True, check=True)
        seconds.append(_work_of_children() - before)
    assert min(seconds) < 0.6


def _work_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
