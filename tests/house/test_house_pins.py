"""The pins: plain, complete, and enough for everything that is imported."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from source_imports import imports

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Files beside those that import them.
SUPPORT = {path.stem for folder in ("tests/support", "benchmarks") for path in (ROOT / folder).glob("*.py")}
PIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*==[0-9][A-Za-z0-9.+!]*")


def _normal(name: str) -> str:
    """A distribution's name as registries compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _lines(file: str) -> list[str]:
    return (ROOT / "requirements" / file).read_text(encoding="utf-8").splitlines()


def _pinned(*files: str) -> set[str]:
    return {_normal(line.partition("==")[0]) for file in files for line in _lines(file)}


def _required(requirements: list[str]) -> set[str]:
    """The distributions that these requirements name; extras of ulna itself are spelt out."""
    found: set[str] = set()
    for requirement in requirements:
        match = re.match(r"([A-Za-z0-9._-]+)(?:\[([a-z,]+)\])?", requirement)
        assert match, requirement
        if match[1] != "ulna":
            found.add(_normal(match[1]))
            continue
        for extra in str(match[2]).split(","):
            found |= _required(PROJECT["optional-dependencies"][extra])
    return found


def _imported(text: str) -> set[str]:
    """The top-level packages that a file imports, anywhere in it."""
    found: set[str] = set()
    for node in imports(text):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif node.module:
            found.add(node.module.partition(".")[0])
    return found - sys.stdlib_module_names - SUPPORT - {"ulna"}


def _distributions(*folders: str) -> dict[str, str]:
    """Distribution → one file that imports it."""
    homes = {**importlib.metadata.packages_distributions(), "mpl_toolkits": ["matplotlib"]}
    return {
        _normal(homes.get(package, [package])[0]): str(path.relative_to(ROOT))
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*.py"))
        for package in _imported(path.read_text(encoding="utf-8"))
    }


@pytest.mark.parametrize("file", ["base.txt", "test.txt"])
def test_pins_are_plain(file: str) -> None:
    assert [line for line in _lines(file) if not PIN.fullmatch(line)] == []


@pytest.mark.parametrize(
    "line", ["numpy", "numpy>=2", "numpy @ https://example.org/numpy.whl", "numpy==2.0 --hash=sha256:0"]
)
def test_a_line_that_is_not_a_plain_pin_is_noticed(line: str) -> None:
    assert not PIN.fullmatch(line)


def test_nothing_is_pinned_twice() -> None:
    assert not _pinned("base.txt") & _pinned("test.txt")
    assert len(_lines("base.txt")) == len(_pinned("base.txt"))


def test_base_pins_cover_what_the_package_requires() -> None:
    assert not _required(PROJECT["dependencies"]) - _pinned("base.txt")


def test_all_pins_cover_every_extra() -> None:
    extras = list(PROJECT["optional-dependencies"])
    assert not _required([f"ulna[{extra}]" for extra in extras]) - _pinned("base.txt", "test.txt")


def test_everything_imported_by_the_package_is_a_dependency_or_in_an_extra_for_users() -> None:
    extras = [extra for extra in PROJECT["optional-dependencies"] if extra not in ("test", "dev")]
    declared = _required(PROJECT["dependencies"]) | _required([f"ulna[{','.join(extras)}]"])
    assert {name: file for name, file in _distributions("src").items() if name not in declared} == {}


def test_every_module_loads_without_the_extras() -> None:
    """All but a module that is named after the library it is for; callers import it inside a function."""
    extras = "casadi", "control", "distributed", "numba"
    code = f"""
import importlib, pkgutil, sys
for name in {extras}:
    sys.modules[name] = None
import ulna
for module in pkgutil.walk_packages(ulna.__path__, "ulna."):
    if module.name.rpartition(".")[2] not in {extras}:
        importlib.import_module(module.name)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr


def test_pins_cover_everything_that_tests_and_benchmarks_import() -> None:
    pinned = _pinned("base.txt", "test.txt")
    assert {
        name: file for name, file in _distributions("src", "tests", "benchmarks").items() if name not in pinned
    } == {}


def test_imports_are_found_wherever_they_stand() -> None:
    text = "import sympy.abc\nimport os\nfrom ulna.base import Verdict\ndef f():\n    from numba import njit\n"
    assert _imported(text) == {"sympy", "numba"}
