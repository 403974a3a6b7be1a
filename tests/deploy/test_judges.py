"""Generated C before the field's own judges; each also sees C that it must complain about."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from firmware_loops import CATALOGUE, arm_loops, catalogue_loop

from ulna.deploy import FixedPoint, c_project
from ulna.loop import Loop

CPPCHECK, TIDY = shutil.which("cppcheck"), shutil.which("clang-tidy")
MISRA = "--addon=misra"
CHECKS = "-*,bugprone-*,cert-*,clang-analyzer-*,portability-*"


def _cppcheck(source: Path, *more: str) -> str:
    """All findings; with `--addon=misra`, which takes most of the time, those of its rules among them."""
    command = [str(CPPCHECK), "-q", "--std=c99", "--enable=warning,style,performance,portability", *more]
    done = subprocess.run(
        [*command, "--suppress=missingIncludeSystem", str(source)], capture_output=True, text=True, check=False
    )
    return done.stdout + done.stderr


def _tidy(source: Path) -> str:
    command = [str(TIDY), "--quiet", f"--checks={CHECKS}", "--warnings-as-errors=*", str(source), "--", "-std=c99"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stdout


def _source(loop: Loop, folder: Path, numbers: str | FixedPoint) -> Path:
    fixed = isinstance(numbers, FixedPoint)
    made = c_project(loop, folder, arithmetic=numbers) if fixed else c_project(loop, folder, precision=numbers)
    return folder / f"{made.firmware.name}.c"


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("judged")
    # The addon for the MISRA rules takes a second and more for each file.
    loops = [arm_loops()["integral"], *(catalogue_loop(name) for name in CATALOGUE)]
    found = [_source(loop, folder / f"{k}", "float" if k % 2 else "double") for k, loop in enumerate(loops)]
    fixed = {"q31": ("PID", FixedPoint()), "q15": ("paper", FixedPoint(factor=16))}
    return [*found, *(_source(arm_loops()[name], folder / key, kind) for key, (name, kind) in fixed.items())]


@pytest.mark.skipif(CPPCHECK is None, reason="there is no cppcheck")
def test_cppcheck_with_the_misra_rules_finds_nothing(sources: list[Path]) -> None:
    assert {str(source): found for source in sources if (found := _cppcheck(source, MISRA))} == {}


@pytest.mark.skipif(TIDY is None, reason="there is no clang-tidy")
def test_clang_tidy_finds_nothing(sources: list[Path]) -> None:
    assert {str(source): found for source in sources if (found := _tidy(source))} == {}


def _spoiled(text: str, line: str) -> str:
    """The C with another line in place of the one that sets the fault."""
    found, count = re.subn(r"^    output->fault = .*;\n", lambda _: line, text, count=1, flags=re.MULTILINE)
    assert count == 1
    return found


@pytest.mark.skipif(CPPCHECK is None, reason="there is no cppcheck")
def test_cppcheck_complains_where_it_must(sources: list[Path], tmp_path: Path) -> None:
    shortest = min(sources, key=lambda source: source.stat().st_size)
    text = shortest.read_text()
    shutil.copy(shortest.with_suffix(".h"), tmp_path)
    wrong = tmp_path / shortest.name
    wrong.write_text(_spoiled(text, "    output->fault = 0 || 1 && 0;\n"))
    assert "misra-c2012-12.1" in _cppcheck(wrong, MISRA)
    wrong.write_text(_spoiled(text, "    int a[2]; output->fault = a[2];\n"))
    assert "arrayIndexOutOfBounds" in _cppcheck(wrong)


@pytest.mark.skipif(TIDY is None, reason="there is no clang-tidy")
def test_clang_tidy_complains_where_it_must(sources: list[Path], tmp_path: Path) -> None:
    shutil.copy(sources[0].with_suffix(".h"), tmp_path)
    wrong = tmp_path / sources[0].name
    divided = "    int zero = 0;\n    output->fault = 1 / zero;\n"
    wrong.write_text(_spoiled(sources[0].read_text(), divided))
    assert "DivideZero" in _tidy(wrong)
