"""The import contract: exhaustive, checked by import-linter, and able to say no."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "ulna"


def _contract() -> str:
    """The import-linter sections of pyproject.toml, as they stand there."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    return text[text.index("[tool.importlinter]") :]


def _lint(folder: Path, files: dict[str, str], contract: str = "layers") -> subprocess.CompletedProcess[str]:
    """Run import-linter with one of the project's contracts on a made-up package `ulna` in `folder`."""
    (folder / "pyproject.toml").write_text(_contract(), encoding="utf-8")
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
        for node in ast.walk(ast.parse(text))
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


def test_a_room_that_imports_one_above_it_is_refused(tmp_path: Path) -> None:
    files = {
        "campaign/__init__.py": "",
        "campaign/plans/__init__.py": "import ulna.campaign.store\n",
        "campaign/store/__init__.py": "",
    }
    result = _lint(tmp_path, files, "rooms-of-campaign")
    assert result.returncode == 1
    assert "ulna.campaign.plans is not allowed to import ulna.campaign.store" in result.stdout


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
    "plants",
    "system",
    "design.analysis",
    "design.control",
    "design.forms",
    "design.internal",
    "design.observers",
)
"""Packages, and rooms of packages, that others import through their fronts only."""


def _inner_imports(text: str, package: str) -> list[int]:
    """The lines that import a file of a package, not its front."""
    inside = f"ulna.{package}."
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if (isinstance(node, ast.ImportFrom) and (node.module or "").startswith(inside))
        or (isinstance(node, ast.Import) and any(alias.name.startswith(inside) for alias in node.names))
    ]


@pytest.mark.parametrize("package", CLOSED)
def test_other_packages_import_the_front_not_its_files(package: str) -> None:
    found = {
        f"{path.relative_to(ROOT)}:{line}"
        for path in SOURCE.rglob("*.py")
        if not path.is_relative_to(SOURCE / package.replace(".", "/"))
        for line in _inner_imports(path.read_text(encoding="utf-8"), package)
    }
    assert not found


def test_an_import_past_a_front_is_noticed() -> None:
    assert _inner_imports("from ulna.system import System\nimport ulna.system\n", "system") == []
    assert _inner_imports("from ulna.system.signal import to_si\nimport ulna.system.file\n", "system") == [1, 2]
