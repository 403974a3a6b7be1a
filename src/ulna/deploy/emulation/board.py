"""`run_on_board`: C compiled for a target and run on QEMU's model of a board that has its processor."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from ulna.deploy.errors import DeployError
from ulna.deploy.target import Target
from ulna.program import C_FLAGS

EMULATOR = "qemu-system-arm"
PROGRAM = "program.elf"
FLAGS = (*C_FLAGS, "-O2", "-fno-math-errno")
"""What C is compiled with: square roots are instructions, they set no error number."""
_LIMIT = 240.0
"""s of an emulated run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ran:
    """What a program did: its exit `status`, what it `printed`, and bytes of `code` of each source and of `PROGRAM`."""

    status: int
    printed: str
    code: dict[str, int]


def run_on_board(target: Target, sources: Sequence[Path], *, flags: Sequence[str] = (), include: str = "") -> Ran:
    """A program compiled for a target and run there, one virtual nanosecond for each instruction.

    Args:
        target: with a board. sources: C, one of them with `main`; it may print.
        flags: for the compiler, beyond `FLAGS`. include: folder of headers.

    Raises:
        DeployError: a target without a board, no cross compiler or emulator, C that does not compile, a run that does
            not end.
    """
    if target.board is None:
        raise DeployError(
            f"a run on target '{target.name}'",
            "it is not a particular processor.",
            "Choose a target that is one: cortex-m4f, say.",
        )
    compiler, emulator = _program(target.compiler), _program(EMULATOR)
    place = files("ulna.deploy.emulation")
    with tempfile.TemporaryDirectory(prefix="ulna-") as work:
        folder = Path(work)
        (folder / "start.c").write_text((place / "start.c").read_text(encoding="utf-8"), encoding="utf-8")
        linked = (place / "linked.ld").read_text(encoding="utf-8")
        linked = linked.replace("RAM_SIZE", target.board.memory).replace("FLASH_SIZE", target.board.flash)
        (folder / "linked.ld").write_text(linked, encoding="utf-8")
        objects = {}
        for k, source in enumerate([folder / "start.c", *sources]):
            objects[source] = folder / f"{k}.o"
            options = [*target.flags, *FLAGS, "-ffunction-sections", *flags, *([f"-I{include}"] if include else [])]
            _compiled([compiler, *options, "-c", str(source), "-o", str(objects[source])], source)
        program = folder / PROGRAM
        linking = [*target.flags, "-nostartfiles", "--specs=rdimon.specs", "-T", str(folder / "linked.ld")]
        parts = [*map(str, objects.values()), "-Wl,--gc-sections", "-lm", "-o", str(program)]
        _compiled([compiler, *linking, *parts], program)
        code = {source.name: _code(target, made) for source, made in [*objects.items(), (program, program)]}
        return _run(emulator, target.board.machine, target.board.core, program, code)


def _program(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        raise DeployError(
            f"the program '{name}'",
            "it is not on the path.",
            "Install it (Debian: gcc-arm-none-eabi, libnewlib-arm-none-eabi, qemu-system-arm).",
        )
    return found


def _compiled(command: list[str], what: Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - a compiler on given files
    if done.returncode:
        lines = (
            [line for line in done.stderr.splitlines() if "error" in line] or done.stderr.splitlines() or ["no word"]
        )
        raise DeployError(f"'{what.name}' for an emulated processor", f"{Path(command[0]).name} refuses it: {lines[0]}")


def _code(target: Target, made: Path) -> int:
    """Bytes of code and constants of an object."""
    size = target.compiler.removesuffix("gcc") + "size"
    done = subprocess.run([_program(size), str(made)], capture_output=True, text=True, check=True)  # noqa: S603
    return int(done.stdout.splitlines()[1].split()[0])


def _run(emulator: str, machine: str, core: str, program: Path, code: dict[str, int]) -> Ran:
    board = ["-M", machine, "-cpu", core, "-icount", "shift=0", "-nographic", "-monitor", "none", "-serial", "null"]
    told = ["-semihosting-config", "enable=on,target=native", "-kernel", str(program)]
    try:
        done = subprocess.run(  # noqa: S603 - an emulator on what was compiled here
            [emulator, *board, *told], capture_output=True, text=True, timeout=_LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        raise DeployError(f"a run on an emulated {core}", f"it did not end in {_LIMIT:g} s.") from None
    return Ran(status=done.returncode, printed=done.stdout + done.stderr, code=code)
