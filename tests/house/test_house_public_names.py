"""The lazy table of `src/ulna/__init__.py`: complete, true, documented."""

from __future__ import annotations

import ast
import importlib.metadata
import inspect
import re
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path

import pytest

import ulna

ROOT = Path(__file__).parents[2]
PROGRAM = Path(sys.executable).with_name("ulna")
NAMES = [name for name in ulna.__all__ if name != "__version__"]


def _imports_for_type_checkers() -> dict[str, str]:
    """Name → module, read from the `if TYPE_CHECKING:` block."""
    tree = ast.parse((ROOT / "src" / "ulna" / "__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    return {
        alias.asname or alias.name: str(statement.module)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }


def test_type_checkers_and_the_program_see_the_same_names() -> None:
    assert _imports_for_type_checkers() == ulna._HOME


def test_the_table_is_in_alphabetical_order() -> None:
    assert list(ulna._HOME.items()) == sorted(ulna._HOME.items(), key=lambda row: (row[1], row[0].lower()))


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_can_be_used_and_is_documented(name: str) -> None:
    value = getattr(ulna, name)
    assert inspect.getdoc(value), f"ulna.{name} has no docstring"
    if inspect.isclass(value) or inspect.isfunction(value):
        assert value.__doc__
        assert not value.__doc__.startswith(f"{name}("), f"ulna.{name} has only the docstring of its dataclass"


def test_dir_lists_the_public_names() -> None:
    assert set(dir(ulna)) == {"__version__", *NAMES}


def test_an_unknown_name_is_an_attribute_error_that_names_it() -> None:
    with pytest.raises(AttributeError, match="no attribute 'controler_form'"):
        _ = ulna.controler_form


def test_a_package_can_be_reached_without_an_import_of_its_own() -> None:
    code = "import ulna; print(ulna.certify.prove.__name__, hasattr(ulna, 'nothing'), hasattr(ulna, '_nothing'))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout == "prove False False\n"


def test_a_star_import_brings_the_public_names() -> None:
    code = "from ulna import *; print(Verdict.__name__)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout == "Verdict\n"


def test_there_is_one_version() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+", ulna.__version__)
    assert importlib.metadata.version("ulna") == ulna.__version__
    result = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True)
    assert result.stdout == f"ulna {ulna.__version__}\n"


def _shadowed(front: Path, names: Collection[str]) -> set[str]:
    """The names of a front that are also its modules or packages: which of the two one gets depends on import order."""
    return {n for n in names if (front / f"{n}.py").exists() or (front / n).is_dir()}


def test_no_public_name_is_a_package_of_its_own() -> None:
    assert _shadowed(ROOT / "src" / "ulna", NAMES) == set()


FRONTS = ["base", "campaign", "campaign.answers", "campaign.plans", "campaign.runs", "campaign.store", "plants", "plot"]
FRONTS += ["report", "system"]


@pytest.mark.parametrize("package", FRONTS)
def test_no_function_of_a_front_has_the_name_of_its_module(package: str) -> None:
    front = importlib.import_module(f"ulna.{package}")
    assert _shadowed(ROOT / "src" / "ulna" / Path(*package.split(".")), front.__all__) == set()


def test_a_function_named_like_its_module_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "connect.py").touch()
    (tmp_path / "plants").mkdir()
    assert _shadowed(tmp_path, ["connect", "plants", "System"]) == {"connect", "plants"}


def test_public_names_mean_the_same_in_every_order_of_imports() -> None:
    """One fresh process, which forks a child for every order, so that what lies below the catalogue loads once."""
    code = """
import itertools, os, sys
import ulna.base.units, ulna.system
ulna.base.units.unit("m")
steps = ("ulna.model('duffing')", "ulna.models()", "import ulna.plants")
for order in itertools.permutations(steps):
    child = os.fork()
    if child == 0:
        for step in order:
            exec(step)
        os._exit(0 if ulna.models()[0].name and ulna.model('duffing').states else 1)
    if os.waitpid(child, 0)[1]:
        sys.exit(f"broken by {order}")
"""
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False).stderr == ""
