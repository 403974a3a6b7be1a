"""`library`: the C of a folder, compiled by a compiler of this machine and loaded into this process."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

from ulna.deploy.errors import DeployError
from ulna.program import C_FLAGS


def library(place: Path, name: str, harness: str, compiler: str) -> ctypes.CDLL:
    """The loaded library of `<name>.c` of a folder and a harness around it, which may use `<name>.h`.

    Raises:
        DeployError: no compiler, C that does not compile.
    """
    program = shutil.which(compiler)
    if program is None:
        raise DeployError(
            f"the compiler '{compiler}'", "it is not on the path.", "Install gcc or clang, or name another."
        )
    with tempfile.TemporaryDirectory(prefix="ulna-") as work:
        around, made = Path(work) / "harness.c", Path(work) / "step.so"
        around.write_text(f'#include "{name}.h"\n{harness}', encoding="utf-8")
        sources = [str(around), str(place.resolve() / f"{name}.c")]
        flags = [*C_FLAGS, "-O2", "-fPIC", "-shared", f"-I{place.resolve()}"]
        done = subprocess.run(  # noqa: S603 - a compiler on files that ulna wrote
            [program, *flags, *sources, "-o", str(made), "-lm"], capture_output=True, text=True, check=False
        )
        if done.returncode:
            lines = done.stderr.strip().splitlines() or ["no message"]
            raise DeployError(f"the C in '{place}'", f"{compiler} refuses it: {lines[0]}", "Export it again.")
        return ctypes.CDLL(str(made))
