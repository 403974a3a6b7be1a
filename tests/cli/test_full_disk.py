"""Standard output that cannot be written: one line on standard error and exit status 1."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).with_name("ulna")
FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.is_char_device(), reason="there is no device that is always full")
@pytest.mark.parametrize("arguments", ["--help", "--version", "models", "models --json"])
def test_a_full_disk_under_standard_output_is_one_line(arguments: str) -> None:
    with FULL.open("w") as full:
        done = subprocess.run(
            [PROGRAM, *arguments.split()], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 1
    assert done.stderr == "error: standard output: No space left on device.\n"
