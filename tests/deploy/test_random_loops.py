"""Random loops, compiled all at once: every bit of every sample is that of the simulator's step."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compilers import GCC
from random_loops import random_loop

from ulna.deploy import TARGETS, FixedFirmware, FixedPoint, firmware, fixed_firmware
from ulna.deploy.c import c_files
from ulna.loop import Loop
from ulna.program import C_FLAGS, Precision

pytestmark = pytest.mark.skipif(GCC is None, reason="there is no gcc")
SAMPLES = 120
FLOATING, INTEGERS = range(12), range(100, 103)
RANGES = {"y": (-3.0, 3.0), "ref": (-1.0, 1.0), "u": (-10.0, 10.0), "z": (-4.0, 4.0)}


def _rows(seed: int, width: int) -> np.ndarray:
    """Measured values that wander, now and then far off, not finite, or zero."""
    random = np.random.default_rng(seed)
    rows = np.cumsum(random.normal(0.0, 0.1, (SAMPLES, width)), axis=0)
    odd = random.choice([0.0, -0.0, 30.0, -1e4, np.nan, np.inf, -np.inf, 1e30], rows.shape)
    return np.where(random.random(rows.shape) < 0.05, odd, rows)


def _in_integers(seed: int) -> FixedFirmware:
    loop = random_loop(seed)
    assert loop.hardware is not None
    # A bound of commands is what their ranges are there.
    loop = Loop(plant=loop.plant, controller=loop.controller, hardware=replace(loop.hardware, guard=None))
    wiring = loop.wiring
    signals = (*wiring.measured, *wiring.references, *wiring.driven, *wiring.memory)
    ranges = {s.name: RANGES[s.name.rstrip("0123456789")] for s in signals}
    return fixed_firmware(loop, FixedPoint(factor=32 if seed % 2 else 16, ranges=ranges), name=f"loop_{seed}")


def _written(folder: Path) -> dict[str, Path]:
    """Folder of each loop by the name of its library."""
    found = {}
    for seed in (*FLOATING, *INTEGERS):
        fixed: FixedFirmware | None = None
        if seed in FLOATING:
            precision = (Precision.DOUBLE, Precision.SINGLE)[seed % 2]
            made = firmware(random_loop(seed), name=f"loop_{seed}", precision=precision)
        else:
            fixed = _in_integers(seed)
            made = fixed.made
        rows = _rows(seed, len(made.inputs) + made.missed)
        if made.missed:
            rows[:, -1] = np.random.default_rng(seed).random(SAMPLES) < 0.2
        place = folder / f"{seed}"
        place.mkdir()
        for path, text in c_files(made, TARGETS["generic"], rows, fixed).items():
            if "/" not in path:
                (place / path).write_text(text, encoding="utf-8")
        found[made.name] = place
    return found


def _run(folder: Path, places: dict[str, Path]) -> dict[str, int]:
    """Of each loop how many samples are equal."""
    main = ["#include <stdio.h>", *(f"int test_{name}(void);" for name in places), "int main(void)", "{"]
    main += [f'    (void)printf("{name}: %d\\n", {SAMPLES} - test_{name}());' for name in places]
    sources = [folder / "main.c"]
    sources[0].write_text("\n".join([*main, "    return 0;", "}", ""]))
    for name, place in places.items():
        test = (place / "self_test.c").read_text()
        # The test's answer is how many samples differ.
        test = test.replace("int main(void)", f"int test_{name}(void)").replace("(wrong == 0) ? 0 : 1", "wrong")
        (place / "test.c").write_text(f"#define ULNA_QUIET\nint test_{name}(void);\n{test}")
        sources += [place / "test.c", place / f"{name}.c"]
    program = folder / "all"
    command = [str(GCC), *C_FLAGS, "-O1", *map(str, sources), "-lm", "-o", str(program)]
    subprocess.run(command, check=True)
    done = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    return {name: int(count) for name, count in re.findall(r"(\w+): (-?\d+)", done.stdout)}


def test_every_bit_of_random_loops_is_that_of_the_step(tmp_path: Path) -> None:
    places = _written(tmp_path)
    assert _run(tmp_path, places) == dict.fromkeys(places, SAMPLES)
    # The coefficients of one loop are others.
    name, place = next(iter(places.items()))
    source = place / f"{name}.c"
    text = source.read_text()
    changed = re.sub(r"\b\d\.\d{3}\b", lambda number: f"{float(number[0]) * 1.01!r}", text)
    assert changed != text
    source.write_text(changed)
    assert _run(tmp_path, {name: place})[name] < SAMPLES
