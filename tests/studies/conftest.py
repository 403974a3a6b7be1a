"""One run of the study through the installed command, shared by all tests of this folder."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ULNA = Path(sys.executable).with_name("ulna")


@pytest.fixture(scope="session")
def reproduction(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `ulna reproduce` writes."""
    folder = tmp_path_factory.mktemp("study") / "reproduction"
    done = subprocess.run([ULNA, "reproduce", "--out", folder], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert str(folder / "index.html") in done.stdout.replace("\n", "")
    return folder
