"""The import contract: exhaustive, checked by import-linter, and able to say no."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from source_imports import imports

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "ulna"


def _contracts() -> str:
    """The import-linter sections of pyproject.toml, as they stand there."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    return text[text.index("[tool.importlinter]") :]


CONTRACTS: list[dict[str, Any]] = tomllib.loads(_contracts())["tool"]["importlinter"]["contracts"]
ROOMS = {each["id"]: each for each in CONTRACTS if each["type"] == "layers" and each["id"] != "layers"}
APART = next(contract for contract in CONTRACTS if contract["id"] == "the-second-program")


def _lint(folder: Path, files: dict[str, str], contract: str = "layers") -> subprocess.CompletedProcess[str]:
    """Run import-linter with one of the project's contracts on a made-up package `ulna` in `folder`."""
    (folder / "pyproject.toml").write_text(_contracts(), encoding="utf-8")
    for name, text in {"__init__.py": "", **files}.items():
        path = folder / "ulna" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return subprocess.run(
        [
            sys.executable,
            "-c",
            "from importlinter.cli import lint_imports_command; lint_imports_command()",
            "--no-cache",
            f"--contract={contract}",
        ],
        cwd=folder,
        env={"PYTHONPATH": str(folder), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )


def _imports_of_the_top_package(text: str) -> list[int]:
    """The lines that import `ulna` itself; its version is the one thing that lives nowhere else."""
    return [
        node.lineno
        for node in imports(text)
        if (isinstance(node, ast.Import) and any(alias.name == "ulna" for alias in node.names))
        or (
            isinstance(node, ast.ImportFrom)
            and node.module == "ulna"
            and any(alias.name != "__version__" for alias in node.names)
        )
    ]


def test_a_package_that_imports_downwards_is_accepted(tmp_path: Path) -> None:
    result = _lint(tmp_path, {"base/__init__.py": "", "system/__init__.py": "import ulna.base\n"})
    assert result.returncode == 0, result.stdout


def test_a_package_that_imports_upwards_is_refused(tmp_path: Path) -> None:
    result = _lint(tmp_path, {"base/__init__.py": "import ulna.system\n", "system/__init__.py": ""})
    assert result.returncode == 1
    assert "ulna.base is not allowed to import ulna.system" in result.stdout


def test_packages_on_one_line_are_refused_to_know_each_other(tmp_path: Path) -> None:
    result = _lint(tmp_path, {"design/__init__.py": "", "sim/__init__.py": "import ulna.design\n"})
    assert result.returncode == 1
    assert "ulna.sim is not allowed to import ulna.design" in result.stdout


def test_a_package_without_a_line_is_refused(tmp_path: Path) -> None:
    result = _lint(tmp_path, {"base/__init__.py": "", "helpers/__init__.py": ""})
    assert result.returncode == 1
    assert "helpers" in result.stdout


@pytest.mark.parametrize("contract", ROOMS)
def test_a_room_may_import_downwards_and_is_refused_upwards_or_without_a_line(contract: str, tmp_path: Path) -> None:
    """Whoever adds a contract on rooms to pyproject.toml has it tested here."""
    [container] = ROOMS[contract]["containers"]
    lines = [re.findall(r"[a-z_0-9]+", line) for line in ROOMS[contract]["layers"]]
    top, bottom = lines[0][0], lines[-1][0]

    def linted(**texts: str) -> str:
        rooms = dict.fromkeys([room for line in lines for room in line], "") | texts
        package = container.removeprefix("ulna.")
        files = {f"{package}/{room}/__init__.py": text for room, text in rooms.items()}
        result = _lint(tmp_path, {f"{package}/__init__.py": "", **files}, contract)
        return "accepted" if result.returncode == 0 else result.stdout

    assert linted(**{top: f"import {container}.{bottom}\n"}) == "accepted"
    refused = linted(**{bottom: f"import {container}.{top}\n"})
    assert f"{container}.{bottom} is not allowed to import {container}.{top}" in refused
    assert f"{container}.cellar" in linted(cellar="")


@pytest.mark.parametrize("shared", ["certify.certificate", *APART["forbidden_modules"]])
def test_the_checker_shares_nothing_with_the_prover(shared: str, tmp_path: Path) -> None:
    [checker] = APART["source_modules"]
    named = [checker, "ulna.certify.certificate", *APART["forbidden_modules"]]
    files = {f"{name.removeprefix('ulna.').replace('.', '/')}/__init__.py": "" for name in named}
    files |= {"certify/__init__.py": "", "certify/checker/__init__.py": f"import ulna.{shared.removeprefix('ulna.')}\n"}
    result = _lint(tmp_path, files, "the-second-program")
    assert (result.returncode == 0) == (shared not in APART["forbidden_modules"]), result.stdout


def test_nothing_inside_imports_names_from_the_lazy_top_package() -> None:
    found = {
        f"{path.relative_to(ROOT)}:{line}"
        for path in SOURCE.rglob("*.py")
        if path != SOURCE / "__init__.py"
        for line in _imports_of_the_top_package(path.read_text(encoding="utf-8"))
    }
    assert not found


def test_an_import_from_the_lazy_top_package_is_noticed() -> None:
    assert _imports_of_the_top_package("import ulna.base\nfrom ulna import __version__\n") == []
    assert _imports_of_the_top_package("from ulna import Verdict\nimport ulna\n") == [1, 2]


CLOSED = (
    "base",
    "geometry",
    "plants",
    "program",
    "symbolic",
    "system",
    "design.analysis",
    "design.control",
    "design.forms",
    "design.internal",
    "design.observers",
)
"""Packages, and rooms of packages, that others import through their fronts only; each room of `symbolic` has one."""

SINGLE = ("ulna.program.lowering.",)
"""Whose files are fronts of their own, so that no other target's library is loaded."""


@cache
def _public(front: str) -> set[str] | None:
    """The names that a package's `__init__` brings in; None if there is no such package."""
    path = SOURCE.parent.joinpath(*front.split("."), "__init__.py")
    if not path.exists():
        return None
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {
        alias.asname or alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }


def _past_the_front(text: str, package: str) -> list[int]:
    """The lines that import a file of a package, or a name that its front does not offer."""
    lines = []
    for node in imports(text):
        if isinstance(node, ast.Import):
            wrong = any(alias.name.startswith(f"ulna.{package}.") for alias in node.names)
        elif f"{node.module}.".startswith(f"ulna.{package}."):
            public = _public(node.module or "")
            wrong = public is None or not {alias.name for alias in node.names} <= public
            wrong = wrong and not (node.module or "").startswith(SINGLE)
        else:
            continue
        if wrong:
            lines.append(node.lineno)
    return lines


@pytest.mark.parametrize("package", CLOSED)
def test_other_packages_import_fronts_and_what_they_offer(package: str) -> None:
    found = {
        f"{path.relative_to(ROOT)}:{line}"
        for path in SOURCE.rglob("*.py")
        if path != SOURCE / "__init__.py" and not path.is_relative_to(SOURCE / package.replace(".", "/"))
        for line in _past_the_front(path.read_text(encoding="utf-8"), package)
    }
    assert not found


def test_an_import_past_a_front_is_noticed() -> None:
    assert _past_the_front("from ulna.system import System\nimport ulna.system\n", "system") == []
    assert _past_the_front("from ulna.system.signal import to_si\nimport ulna.system.file\n", "system") == [1, 2]
    assert _past_the_front("from ulna.symbolic.exact import tidy\n", "symbolic") == []
    assert _past_the_front("from ulna.symbolic.exact import simplify\n", "symbolic") == [1]
    assert _past_the_front("from ulna.symbolic import exact\n", "symbolic") == [1]
    assert _past_the_front("from ulna.program.lowering.heyoka import to_heyoka\n", "program") == []


def test_no_front_offers_a_name_that_one_of_its_files_bears() -> None:
    """`from ulna.geometry import distribution` must not mean two things."""
    clashes = {
        f"{front}: {name}"
        for package in CLOSED
        if package != "program"  # has three of them
        for path in (SOURCE / package.replace(".", "/")).rglob("__init__.py")
        if (front := ".".join(path.parent.relative_to(SOURCE.parent).parts))
        for name in (_public(front) or ())
        if (path.parent / f"{name}.py").exists() or (path.parent / name / "__init__.py").exists()
    }
    assert not clashes
