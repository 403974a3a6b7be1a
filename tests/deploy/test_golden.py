"""The C of three loops as it was last seen: a change of the text is looked at before it ships."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from firmware_loops import arm_loops

from ulna.deploy import FixedPoint, c_project

GOLDEN = Path(__file__).parent / "golden"
RANGES = {"theta": (-2.0, 2.0), "theta_ref": (-1.0, 1.0), "total": (-30.0, 30.0), "slow": (-2.0, 2.0)}
LOOPS: dict[str, tuple[str, dict[str, Any]]] = {
    "states_double": ("states", {}),
    "pid_float": ("PID", {"precision": "float"}),
    "pid_q31": ("PID", {"arithmetic": FixedPoint(ranges=RANGES)}),
}


@pytest.mark.parametrize("key", LOOPS)
def test_the_c_is_as_it_was(key: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    name, options = LOOPS[key]
    made = c_project(arm_loops()[name], tmp_path / "c", name="control", **options)
    text = (tmp_path / "c" / "control.c").read_text().replace(f"ulna {version('ulna')}", "ulna")
    text = text.replace(made.firmware.fingerprint, "0" * len(made.firmware.fingerprint))
    golden = GOLDEN / f"{key}.c"
    if request.config.getoption("--update"):
        golden.parent.mkdir(exist_ok=True)
        golden.write_text(text)
    assert text == golden.read_text(), "where the change is meant: pytest --update tests/deploy/test_golden.py"
