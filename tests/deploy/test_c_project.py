"""Folders of C: they build without a word, give every bit, and refuse what they cannot do."""

from __future__ import annotations

import json
import math
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compilers import GCC
from firmware_loops import CATALOGUE, arm_loops, catalogue_loop

import ulna
from ulna.base import SimulationError
from ulna.deploy import DeployError, c_project, compare, firmware, verify
from ulna.loop import Guard, Hardware, Hold, Loop, MissedSamples, SafeOutput
from ulna.program import Fused, Plain, Precision

WARNINGS = [
    *("-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wfloat-conversion"),
    *("-Wshadow", "-Wundef", "-Wmissing-prototypes", "-Wstrict-prototypes", "-Werror"),
]
NAMES = list(arm_loops())
needs_gcc = pytest.mark.skipif(GCC is None, reason="there is no gcc")


def _hardware(loop: Loop, **changed: Any) -> Hardware:
    assert loop.hardware is not None
    return replace(loop.hardware, **changed)


def _self_test(folder: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    sources = [str(path) for path in sorted(folder.glob("*.c"))]
    program = folder.parent / "self_test"
    command = [str(GCC), "-std=c99", "-ffp-contract=off", "-O2", *WARNINGS, *flags, *sources, "-lm", "-o", str(program)]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return subprocess.run([str(program)], capture_output=True, text=True, check=False)


@needs_gcc
@pytest.mark.parametrize("precision", Precision)
@pytest.mark.parametrize("name", NAMES)
def test_a_folder_builds_without_a_warning_and_its_self_test_passes(name: str, precision: str, tmp_path: Path) -> None:
    c_project(arm_loops()[name], tmp_path / "firm ware", precision=precision)
    done = _self_test(tmp_path / "firm ware")
    assert done.returncode == 0, done.stdout
    assert re.fullmatch(r"(2\d\d) of \1 samples are bit-equal", done.stdout.strip())


@needs_gcc
@pytest.mark.parametrize("name", CATALOGUE)
def test_catalogue_loops_give_every_bit(name: str, tmp_path: Path) -> None:
    made = c_project(catalogue_loop(name), tmp_path / "c", target="cortex-m4f")
    assert made.firmware.precision is Precision.SINGLE
    assert _self_test(tmp_path / "c").returncode == 0


@needs_gcc
def test_a_self_test_fails_where_a_coefficient_is_changed(tmp_path: Path) -> None:
    made = c_project(arm_loops()["paper"], tmp_path / "c")
    source = tmp_path / "c" / f"{made.firmware.name}.c"
    text = source.read_text()
    # The numbers of the design: those of the elementary functions have tests of their own.
    loop = arm_loops()["paper"]
    held = [abs(value) for value in loop.step.numbers.values()]
    held += [abs(each.value) for each in loop.wiring.controller.main.instructions]
    numbers = [f" {value!r}" for value in dict.fromkeys(held) if 0.1 < value < 1000 and value not in (0.5, 1.0)]
    found = [number for number in numbers if number in text]
    assert len(found) >= 4
    for number in found:
        source.write_text(text.replace(number, f" {float(number) * 1.01!r}"))
        assert _self_test(tmp_path / "c", "-O0").returncode == 1, number


@needs_gcc
def test_c_follows_the_simulation_bit_for_bit_over_many_samples(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    c_project(loop, tmp_path / "double")
    found = compare(tmp_path / "double", loop, samples=100_000, initial={"theta": 1.0})
    assert found.equal
    assert (found.samples, found.largest) == (100_001, 0.0)
    c_project(loop, tmp_path / "single", precision="float")
    found = compare(tmp_path / "single", loop, samples=3000, initial={"theta": 1.0})
    assert found.equal
    assert 0.0 < found.largest < 1e-3
    # What is off by one coefficient is told apart.
    source = next((tmp_path / "double").glob("one*.c"))
    source.write_text(source.read_text().replace("24.0", "5.0"))
    found = compare(tmp_path / "double", loop, samples=3000, initial={"theta": 1.0})
    assert not found.equal
    assert str(found).startswith("sample 0 differs from the simulation: -5.0 instead of")


@needs_gcc
def test_references_and_integrals_follow_the_simulation(tmp_path: Path) -> None:
    loop = arm_loops()["integral"]
    c_project(loop, tmp_path / "c")
    t = ulna.TIME
    assert compare(tmp_path / "c", loop, samples=3000, inputs={"y_ref": 0.3 + t / 10}).equal


@needs_gcc
def test_fused_arithmetic_ships_too(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    hardware = _hardware(loop, arithmetic=Fused())
    c_project(Loop(plant=loop.plant, controller=loop.controller, hardware=hardware), tmp_path / "c")
    assert _self_test(tmp_path / "c").returncode == 0


def test_a_fault_holds_the_memory_and_the_command_and_is_told() -> None:
    made = firmware(arm_loops()["paper"])
    rows = np.array([[0.1], [0.1], [np.nan], [np.nan], [0.1]])
    answer = made.run(rows)
    assert answer[:, -1].tolist() == [0, 0, 1, 1, 0]
    assert (answer[2:4, 0] == answer[1, 0]).all()
    assert np.isfinite(answer).all()


def test_faults_and_reactions_ship_and_the_folder_tells_them(tmp_path: Path) -> None:
    made = c_project(arm_loops()["watched"], tmp_path / "c").firmware
    assert [port.name for port in made.inputs] == ["y", "y_ref", "elapsed"]
    good, late, strange, far = [0.0, 0.1, 1e-3, 0], [0.0, 0.1, 1.2e-3, 0], [0.0, 0.6, 1e-3, 0], [3.0, 0.1, 1e-3, 0]
    missed, broken = [0.0, 0.1, 1e-3, 1], [np.nan, 0.1, 1e-3, 0]
    hanging = [math.acos(0.5 / 17.64), 0.1, 1e-3, 0]  # where the arm comes to rest under -0.5 V
    rows = [good, late, strange, missed, missed, missed, broken, *[far] * 6, *[hanging] * 3000]
    answer = made.run(np.array(rows))
    assert answer[:13, -1].tolist() == [0, 4, 8, 0, 0, 2, 1, 0, 0, 0, 0, 16, 16]
    assert [answer[k, 0] for k in (1, 5, 6, 12)] == [0.5, 0.5, 0.0, -0.5]
    assert answer[13, -1] == 16
    assert 0 in answer[14:, -1]  # the estimate has found the arm again
    text = (tmp_path / "c" / "README.md").read_text()
    for line in (
        "More than 2 in a row: `fault` has bit 2 and 0.5 is commanded until the next sample comes",
        "is more than 0.00115 s `fault` has bit 4 and 0.5 is commanded",
        "Reference y_ref out of -0.5 … 0.5: `fault` has bit 8 and the last reference takes its place",
        "at 5 samples in a row: the plant is lost, `fault` has bit 16",
        "u is commanded -0.5, until 10 samples in a row are within it",
    ):
        assert line in text, line


@pytest.mark.parametrize("output", [None, 0.0])
def test_the_guard_of_the_hardware_is_what_ships(output: float | None) -> None:
    loop = arm_loops()["states"]
    hardware = _hardware(loop, guard=Guard(reaction=Hold() if output is None else SafeOutput(output)))
    made = firmware(Loop(plant=loop.plant, controller=loop.controller, hardware=hardware))
    answer = made.run(np.array([[0.5, 0.1, 0.0], [np.nan, 0.1, 0.0]]))
    assert answer[1, 0] == (answer[0, 0] if output is None else output)


def test_a_missed_sample_is_an_input() -> None:
    loop = arm_loops()["PID"]
    hardware = _hardware(loop, clock=MissedSamples(probability=0.1))
    made = firmware(Loop(plant=loop.plant, controller=loop.controller, hardware=hardware))
    assert made.missed
    answer = made.run(np.array([[0.01, 0.0, 0.0], [0.02, 0.0, 1.0], [0.03, 0.0, 0.0]]))
    assert answer[1, 0] == answer[0, 0] != answer[2, 0]


@needs_gcc
def test_what_a_measuring_amplifier_applied_is_an_input(tmp_path: Path) -> None:
    loop = arm_loops()["amplifier"]
    assert [port.name for port in firmware(loop).inputs] == ["y", "applied_u"]
    c_project(loop, tmp_path / "c")
    assert compare(tmp_path / "c", loop, samples=3000, initial={"theta": 0.5}).equal


def test_a_folder_belongs_to_its_design_until_either_changes(tmp_path: Path) -> None:
    loops = arm_loops()
    c_project(loops["paper"], tmp_path / "c")
    assert verify(tmp_path / "c").holds
    assert verify(tmp_path / "c", loops["paper"]).holds
    other = verify(tmp_path / "c", loops["states"])
    assert other.fails
    assert other.evidence["design"] != other.evidence["design_now"]
    readme = tmp_path / "c" / "README.md"
    readme.write_text(readme.read_text() + "\n")
    (tmp_path / "c" / "CMakeLists.txt").unlink()
    changed = verify(tmp_path / "c")
    assert changed.fails
    assert changed.evidence["changed"] == ("README.md",)
    assert changed.evidence["missing"] == ("CMakeLists.txt",)


HOSTILE = '*/ int main(void){return 0;} /* " \\ ??/ <script>\n#include "/etc/passwd" $(touch owned) `id` {{ 7*7 }} Ω'


@needs_gcc
def test_what_users_wrote_is_text_in_every_file(tmp_path: Path) -> None:
    loop = arm_loops()["states"]
    plant = replace(
        loop.plant,
        name=HOSTILE,
        states=tuple(replace(s, text=HOSTILE) if s.name == "theta" else s for s in loop.plant.states),
    )
    hostile = Loop(plant=plant, controller=loop.controller, hardware=loop.hardware)
    c_project(hostile, tmp_path / "c")
    assert _self_test(tmp_path / "c").returncode == 0
    assert json.loads((tmp_path / "c" / "library.json").read_text())["version"] == "1.0.0"


def test_names_that_c_does_not_have_are_spelt() -> None:
    from ulna.deploy.names import c_name

    assert c_name("θ") == "theta"
    assert c_name("int") == "int_"
    assert c_name("x-1 y") == "x_1_y"
    assert c_name("2nd") == "signal_2nd"
    assert len(c_name("a" * 5000)) <= 60


def test_names_that_become_one_in_c_are_refused() -> None:
    from ulna.deploy.names import c_names

    with pytest.raises(DeployError, match=r"'x 1' in C: its name becomes 'x_1', as that of 'x-1' does"):
        c_names(["x-1", "x 1"], what="state")


def test_absurd_periods_and_names_that_c_does_not_have_are_refused(tmp_path: Path) -> None:
    loop = arm_loops()["states"]
    hasty = Loop(plant=loop.plant, controller=loop.controller, hardware=_hardware(loop, period=1e-300))
    with pytest.raises(DeployError, match="shorter than a step takes on any processor"):
        c_project(hasty, tmp_path / "c")
    for name in ("int main", "double", "2nd"):
        with pytest.raises(DeployError, match=f"library '{name}': it is not a valid name in C"):
            c_project(loop, tmp_path / "c", name=name)
    assert not list(tmp_path.iterdir())


def test_what_cannot_ship_is_refused_in_one_line(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    with pytest.raises(DeployError, match=r"no processor: Hardware\(period=\.\.\.\) is missing"):
        c_project(Loop(plant=loop.plant, controller=loop.controller), tmp_path / "c")
    with pytest.raises(DeployError, match="it has no controller"):
        c_project(Loop(plant=loop.plant), tmp_path / "c")
    with pytest.raises(DeployError, match="target 'cortex-m4': it is not known. Did you mean 'cortex-m4f'"):
        c_project(loop, tmp_path / "c", target="cortex-m4")
    with pytest.raises(DeployError, match="initial value of 'alpha'"):
        c_project(loop, tmp_path / "c", initial={"alpha": 1.0})
    symbolic = ulna.model("one_link_arm")
    law = loop.controller
    bare = replace(symbolic, parameters=tuple(replace(p, value=None) for p in symbolic.parameters))
    with pytest.raises(DeployError, match="parameters without a value"):
        c_project(Loop(plant=bare, controller=law, hardware=loop.hardware), tmp_path / "c")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_free_is_left_alone(tmp_path: Path) -> None:
    loop = arm_loops()["states"]
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    with pytest.raises(DeployError, match="it is not empty"):
        c_project(loop, tmp_path / "full")
    with pytest.raises(DeployError, match="there is a file of this name"):
        c_project(loop, tmp_path / "full" / "mine.txt")
    with pytest.raises(DeployError, match="cannot be written"):
        c_project(loop, tmp_path / "full" / "mine.txt" / "below")
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["mine.txt"]
    with pytest.raises(DeployError, match=r"it has no design.json that ulna wrote"):
        verify(tmp_path / "full")
    (tmp_path / "empty").mkdir()
    c_project(loop, tmp_path / "empty")
    assert (tmp_path / "empty" / "README.md").is_file()


def test_parameters_without_a_value_are_named() -> None:
    loop = arm_loops()["PID"]
    controller = replace(loop.controller, parameters=tuple(replace(p, value=None) for p in loop.controller.parameters))
    with pytest.raises(SimulationError, match="parameters without a value: kp, ki, kd, Tf"):
        firmware(Loop(plant=loop.plant, controller=controller, hardware=Hardware(period=1e-3, arithmetic=Plain())))


def test_ports_carry_units_and_ranges_into_the_readme(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    c_project(loop, tmp_path / "c")
    text = (tmp_path / "c" / "README.md").read_text()
    assert "| `input.y` | y: measured angle | rad |" in text
    assert "| `output.u` | u, limited | V | -24 … 24 |" in text
    assert "every **0.001 s**" in text
