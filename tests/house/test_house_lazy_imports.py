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


FIRST_LOOP = """
import numpy as np
import ulna
arm = ulna.model("one_link_arm").with_values()
made = ulna.controller_for(arm, law=[-4, -5, -6], observer=[-9, -10, -11])
run = ulna.simulate(ulna.close_loop(arm, made), [1, 0, 0], np.linspace(0, 1, 11))
ulna.metrics(run, effort=("u",))"""


def test_a_first_closed_loop_and_an_analysis_load_no_library_that_they_do_not_need() -> None:
    spare = {"casadi", "matplotlib", "numba", "pandas", "rich", "scipy", "xarray"}
    assert not _loaded_after(FIRST_LOOP) & spare
    analysed = "import sys\nfrom typer.testing import CliRunner\nfrom ulna.cli.main import app\n"
    analysed += 'assert CliRunner().invoke(app, ["analyse", "one_link_arm"]).exit_code == 0'
    assert not _loaded_after(analysed) & (spare | {"heyoka"}) - {"rich"}
    assert not _loaded_after("from ulna.cli.main import app\nimport typer.main\ntyper.main.get_command(app)") & HEAVY


def test_help_and_completion_load_neither_libraries_nor_commands() -> None:
    listed = "from typer.testing import CliRunner\nfrom ulna.cli.main import app\nCliRunner().invoke(app, ['--help'])"
    assert not _loaded_after(listed) & HEAVY
    names = "import sys\nfrom ulna.cli.completion import complete_plant\nassert complete_plant('one_link')"
    assert not _loaded_after(names) & HEAVY
