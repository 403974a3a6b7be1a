"""The C on an emulated Arm processor: the self-test passes there, and fails where it must."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from firmware_loops import arm_loops

from ulna.deploy import TARGETS, FixedPoint, Target, c_project

COMPILER, EMULATOR = shutil.which("arm-none-eabi-gcc"), shutil.which("qemu-system-arm")
pytestmark = pytest.mark.skipif(
    COMPILER is None or EMULATOR is None, reason="there is no arm-none-eabi-gcc or no qemu-system-arm"
)
BOARDS = {"cortex-m4f": ("mps2-an386", "cortex-m4"), "cortex-m7": ("mps2-an500", "cortex-m7")}
BOARDS["cortex-m0"] = ("microbit", "cortex-m0")

START = r"""
#include <stdint.h>
#include <stdlib.h>
extern uint32_t _estack, _sidata, _sdata, _edata, _sbss, _ebss;
extern void initialise_monitor_handles(void);
int main(void);
void reset(void)
{
#if defined(__ARM_FP)
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* switch the floating-point unit on */
    __asm volatile("dsb\n isb");
#endif
    uint32_t *from = &_sidata;
    for (uint32_t *to = &_sdata; to < &_edata; to++) { *to = *from++; }
    for (uint32_t *to = &_sbss; to < &_ebss; to++) { *to = 0; }
    initialise_monitor_handles();
    exit(main());
}
static void stuck(void) { for (;;) { } }
__attribute__((section(".vectors"), used)) void *const vectors[16] = {
    &_estack, (void *)reset, (void *)stuck, (void *)stuck, (void *)stuck, (void *)stuck, (void *)stuck, 0, 0, 0, 0,
    (void *)stuck, (void *)stuck, 0, (void *)stuck, (void *)stuck };
"""
LINKED = """
MEMORY { FLASH (rx): ORIGIN = 0x0, LENGTH = 256K
         RAM (rwx): ORIGIN = 0x20000000, LENGTH = %s }
ENTRY(reset)
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) . = ALIGN(4); } > FLASH
  .ARM.exidx : { *(.ARM.exidx*) } > FLASH
  _sidata = LOADADDR(.data);
  .data : { _sdata = .; *(.data*) . = ALIGN(4); _edata = .; } > RAM AT> FLASH
  .bss : { _sbss = .; *(.bss*) *(COMMON) . = ALIGN(8); _ebss = .; end = .; } > RAM
  _estack = ORIGIN(RAM) + LENGTH(RAM);
}
"""


def _emulated(target: Target, sources: list[Path], work: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    board, core = BOARDS[target.name]
    (work / "start.c").write_text(START)
    (work / "linked.ld").write_text(LINKED % ("16K" if core == "cortex-m0" else "4M"))
    program = work / "program.elf"
    options = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-ffunction-sections", "-Wl,--gc-sections"]
    options += ["-nostartfiles", "--specs=rdimon.specs", "-T", str(work / "linked.ld"), *flags]
    command = [str(COMPILER), *target.flags, *options, str(work / "start.c"), *map(str, sources), "-lm"]
    built = subprocess.run([*command, "-o", str(program)], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    machine = ["-M", board, "-cpu", core, "-icount", "shift=0", "-nographic", "-monitor", "none", "-serial", "null"]
    semihosting = ["-semihosting-config", "enable=on,target=native"]
    return subprocess.run(
        [str(EMULATOR), *machine, *semihosting, "-kernel", str(program)],
        capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["paper", "integral", "exact hold"])
@pytest.mark.parametrize("target", BOARDS)
def test_the_self_test_passes_on_the_processor(target: str, name: str, tmp_path: Path) -> None:
    c_project(arm_loops()[name], tmp_path / "c", target=target)
    done = _emulated(TARGETS[target], sorted((tmp_path / "c").glob("*.c")), tmp_path)
    assert "220 of 220 samples are bit-equal" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0


@pytest.mark.parametrize(("name", "factor"), [("paper", 32), ("watched", 16)])
def test_fixed_point_gives_the_integers_of_python_without_a_floating_point_unit(
    name: str, factor: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ulna.deploy.project.VECTORS", 3000)
    made = c_project(arm_loops()[name], tmp_path / "c", target="cortex-m0", arithmetic=FixedPoint(factor=factor))
    sources = sorted((tmp_path / "c").glob("*.c"))
    done = _emulated(TARGETS["cortex-m0"], sources, tmp_path)
    count, whole = re.findall(r"\d+", done.stdout)
    assert count == whole, done.stdout + done.stderr
    assert int(whole) > 3000
    assert done.returncode == 0
    law = tmp_path / "c" / f"{made.firmware.name}.c"
    text = law.read_text()
    law.write_text(text.replace("whole(value + (INT64_C(1) << (by - 1U)), by)", "whole(value, by)"))
    assert law.read_text() != text
    assert "differs" in _emulated(TARGETS["cortex-m0"], sources, tmp_path).stdout


def test_contracted_products_are_found_out_by_the_self_test(tmp_path: Path) -> None:
    """With -ffp-contract=fast the compiler fuses products with sums: other bits."""
    c_project(arm_loops()["paper"], tmp_path / "c", target="cortex-m4f")
    sources = sorted((tmp_path / "c").glob("*.c"))
    done = _emulated(TARGETS["cortex-m4f"], sources, tmp_path, "-ffp-contract=fast")
    assert "differs" in done.stdout
