"""`Cost`: instructions, stack and code of a step, counted on an emulated processor."""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from ulna.deploy.emulation.board import FLAGS, PROGRAM, run_on_board
from ulna.deploy.errors import DeployError
from ulna.deploy.target import Target

_COUNTED = 2e6
"""Instructions that the scale of the counter is taken from."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """The cost of one call of the step: instructions, stack and code.

    Attributes:
        instructions: of a call, on average over the self-test. most: of the longest.
        calls: that were counted. stack: bytes below the caller's, library functions included.
        code: bytes of code and constants of the step's file. program: of the whole program that counts, with what the
            step calls of libraries: of two steps, the difference counts.
        how: compiler, flags and board, for people.
    """

    instructions: float
    most: int
    calls: int
    stack: int
    code: int
    program: int
    how: str

    def __str__(self) -> str:
        return (
            f"{self.instructions:.0f} instructions a call (at most {self.most} seen), {self.stack} bytes of stack, "
            f"{self.code} bytes of code"
        )


def cost_of(folder: Path, name: str, target: Target, *, step: Path | None = None) -> Cost:
    """What the step of a folder costs on an emulated processor, its self-test passed there.

    Args:
        folder: written by `c_project`. name: of the library. target: with a board.
        step: other C with the same functions in place of the folder's, whose bits may differ: to compare its cost.

    Raises:
        DeployError: as `run_on_board`; a self-test that fails there.
    """
    text = (files("ulna.deploy.emulation") / "count.c").read_text(encoding="utf-8").replace("NAME", name)
    with tempfile.TemporaryDirectory(prefix="ulna-") as work:
        counting = Path(work) / "count.c"
        counting.write_text(text, encoding="utf-8")
        source = folder / f"{name}.c" if step is None else step
        ran = run_on_board(target, [counting, source], include=str(folder.resolve()))
    found = re.search(r"counted (\d+) (\d+) (\d+) (\d+) (\d+) (\d+)", ran.printed)
    if found is None or (ran.status and step is None):
        lines = ran.printed.strip().splitlines() or ["it printed nothing"]
        raise DeployError(f"the self-test of '{name}' on an emulated {target.name}", f"it fails: {lines[0]}.")
    calls, total, most, stack, repeats, scale = map(int, found.groups())
    # The return of the empty call is the one instruction that is taken off too much.
    each = _COUNTED / scale / repeats
    board = f"{target.board.machine} of QEMU" if target.board is not None else ""
    return Cost(
        instructions=total * each / calls + 1.0,
        most=round(most * each) + 1,
        calls=calls,
        stack=stack,
        code=ran.code[source.name],
        program=ran.code[PROGRAM],
        how=f"{target.compiler} {' '.join([*target.flags, *FLAGS])}, {board}",
    )
