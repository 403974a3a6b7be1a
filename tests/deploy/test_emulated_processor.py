"""The C on an emulated Arm processor: the self-test passes there, and fails where it must."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from firmware_loops import arm_loops

from ulna.deploy import TARGETS, DeployError, FixedPoint, c_project, verify
from ulna.deploy.emulation import Ran, cost_of, run_on_board
from ulna.deploy.project import VECTORS

COMPILER, EMULATOR = shutil.which("arm-none-eabi-gcc"), shutil.which("qemu-system-arm")
pytestmark = pytest.mark.skipif(
    COMPILER is None or EMULATOR is None, reason="there is no arm-none-eabi-gcc or no qemu-system-arm"
)
BOARDS = [name for name, target in TARGETS.items() if target.board is not None]


def _emulated(target: str, folder: Path, *flags: str) -> Ran:
    return run_on_board(TARGETS[target], sorted(folder.glob("*.c")), flags=flags)


@pytest.mark.parametrize("name", ["paper", "integral", "exact hold"])
@pytest.mark.parametrize("target", BOARDS)
def test_the_self_test_passes_on_the_processor(
    target: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    samples = 10_000 if (target, name) == ("cortex-m4f", "paper") else VECTORS
    monkeypatch.setattr("ulna.deploy.project.VECTORS", samples)
    c_project(arm_loops()[name], tmp_path / "c", target=target)
    done = _emulated(target, tmp_path / "c")
    assert f"{samples + 20} of {samples + 20} samples are bit-equal" in done.printed
    assert done.status == 0


@pytest.mark.parametrize(("name", "factor"), [("paper", 32), ("watched", 16)])
def test_fixed_point_gives_the_integers_of_python_without_a_floating_point_unit(
    name: str, factor: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ulna.deploy.project.VECTORS", 3000)
    made = c_project(arm_loops()[name], tmp_path / "c", target="cortex-m0", arithmetic=FixedPoint(factor=factor))
    done = _emulated("cortex-m0", tmp_path / "c")
    count, whole = re.findall(r"\d+", done.printed)
    assert count == whole, done.printed
    assert int(whole) > 3000
    assert done.status == 0
    law = tmp_path / "c" / f"{made.firmware.name}.c"
    text = law.read_text()
    law.write_text(text.replace("whole(value + (INT64_C(1) << (by - 1U)), by)", "whole(value, by)"))
    assert law.read_text() != text
    assert "differs" in _emulated("cortex-m0", tmp_path / "c").printed


def test_contracted_products_are_found_out_by_the_self_test(tmp_path: Path) -> None:
    """With -ffp-contract=fast the compiler fuses products with sums: other bits."""
    c_project(arm_loops()["paper"], tmp_path / "c", target="cortex-m4f")
    assert "differs" in _emulated("cortex-m4f", tmp_path / "c", "-ffp-contract=fast").printed


def test_what_a_call_costs_is_counted_and_stands_in_the_readme(tmp_path: Path) -> None:
    """The mean of calls, exact to one instruction; the stack is that of the compiler's own account."""
    made = c_project(arm_loops()["paper"], tmp_path / "c", target="cortex-m4f", measure=True)
    cost, name = made.cost, made.firmware.name
    assert cost is not None
    assert made.operations < cost.instructions <= cost.most < 2 * made.operations
    assert cost.calls == 220
    command = [str(COMPILER), *made.target.flags, "-O2", "-ffp-contract=off", "-fno-math-errno", "-fstack-usage", "-c"]
    subprocess.run([*command, str(tmp_path / "c" / f"{name}.c"), "-o", str(tmp_path / "step.o")], check=True)
    rows = [line.split() for line in (tmp_path / "step.su").read_text().splitlines()]
    assert cost.stack == max(int(row[1]) for row in rows)
    text = (tmp_path / "c" / "README.md").read_text()
    assert f"| instructions of a call, on average | {cost.instructions:.0f} |" in text
    assert f"| stack, bytes below the caller's | {cost.stack} |" in text
    assert verify(tmp_path / "c").holds
    # Three instructions more are three more.
    source = tmp_path / "c" / f"{name}.c"
    body = source.read_text()
    more = body.replace("    output->fault", '    __asm volatile("nop\\n nop\\n nop");\n    output->fault')
    assert more != body
    source.write_text(more)
    assert cost_of(tmp_path / "c", name, made.target).instructions == pytest.approx(cost.instructions + 3, abs=1.0)


def test_what_cannot_be_counted_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loop = arm_loops()["states"]
    with pytest.raises(DeployError, match="target 'generic': it is not a particular processor"):
        c_project(loop, tmp_path / "c", measure=True)
    made = c_project(loop, tmp_path / "wrong", target="cortex-m4f")
    test = tmp_path / "wrong" / "self_test.c"
    test.write_text(test.read_text().replace("faults[SAMPLES] = { 0", "faults[SAMPLES] = { 1"))
    with pytest.raises(DeployError, match="on an emulated cortex-m4f: it fails: sample 0 differs"):
        cost_of(tmp_path / "wrong", made.firmware.name, made.target)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(DeployError, match="'arm-none-eabi-gcc': it is not on the path"):
        c_project(loop, tmp_path / "c", target="cortex-m4f", measure=True)
    assert not (tmp_path / "c").exists()
