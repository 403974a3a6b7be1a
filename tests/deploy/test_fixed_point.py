"""Fixed point: the C gives the integers that Python gives, near the step in double precision, and refuses in words."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compilers import GCC
from firmware_loops import arm_loops, catalogue_loop
from random_loops import random_loop

from ulna.deploy import DeployError, FixedPoint, c_project, compare, fixed_firmware, verify
from ulna.program import (
    Assembly,
    IntegerProgram,
    Kernel,
    Operation,
    UnboundedError,
    format_of,
    restricted,
    to_fixed,
    to_python,
)
from ulna.program.fixed import Step

FLAGS = [
    *("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wundef", "-Wmissing-prototypes"),
    *("-Wstrict-prototypes", "-Werror", "-O1", "-fsanitize=undefined", "-fno-sanitize-recover"),
]
needs_gcc = pytest.mark.skipif(GCC is None, reason="there is no gcc")


@pytest.mark.parametrize(("factor", "part"), [(32, 2e-7), (16, 2e-3)])
def test_functions_stay_near_those_of_double_precision(factor: int, part: float) -> None:
    w = Assembly("functions")
    x, y = w.input("x"), w.input("y")
    names = {"sin": x, "cos": x, "tanh": x, "atan": x, "exp": y, "log": y + 1.5, "sqrt": abs(x)}
    outputs = {name: a.apply(Operation(name)) for name, a in names.items()}
    outputs |= {"quotient": x / (2.0 + y), "least": x.at_most(0.5).where(x, 0.5), "product": x * y + 0.001 * x}
    kernel = w.finished(outputs)
    program = to_fixed(kernel, {"x": format_of(-8, 8), "y": format_of(-1, 1)}, {}, factor=factor)
    exact, random = to_python(kernel), np.random.default_rng(1)
    for _ in range(500):
        point = {"x": random.uniform(-8, 8), "y": random.uniform(-1, 1)}
        given = [form.integer(point[name]) for name, form in program.inputs.items()]
        expected = exact(*(form.number(n) for n, form in zip(given, program.inputs.values(), strict=True)))
        for (name, form), n, wanted in zip(program.outputs.items(), program.run(given), expected, strict=True):
            assert form.lower <= form.number(n) <= form.upper, name
            assert form.number(n) == pytest.approx(wanted, abs=part * max(1.0, form.upper)), name
            assert abs(form.number(n) - wanted) <= program.errors[name], name
    assert all(program.errors[name] < 10.0 * part * max(1.0, form.upper) for name, form in program.outputs.items())
    assert not program.doubts


def _beyond(program: IntegerProgram, kernel: Kernel, names: list[str], count: int) -> int:
    """At how many of random points an output is farther from double precision than its bound."""
    exact, random = to_python(kernel), np.random.default_rng(2)
    beyond = 0
    for _ in range(count):
        given = [int(random.integers(*form.ends, endpoint=True)) for form in program.inputs.values()]
        numbers = exact(*(form.number(n) for n, form in zip(given, program.inputs.values(), strict=True)))
        wanted = dict(zip(kernel.outputs, numbers, strict=True))
        found = dict(zip(program.outputs, program.run(given), strict=True))
        for name in names:
            form = program.outputs[name]
            beyond += (
                abs(form.number(found[name]) - min(max(wanted[name], form.lower), form.upper)) > program.errors[name]
            )
    return beyond


@pytest.mark.parametrize(("name", "factor"), [("paper", 32), ("watched", 16), ("PID", 16), ("series_dc_motor", 32)])
def test_no_call_is_farther_from_double_precision_than_its_bound(name: str, factor: int) -> None:
    made = fixed_firmware(arm_loops().get(name) or catalogue_loop(name), FixedPoint(factor=factor))
    assert 0.0 < made.seen["u"] <= made.bounds["u"] < (1e-4 if factor == 32 else 0.2)
    command = made.made.commands[0].slot
    assert _beyond(made.program, made.kernel, [command], 500) == 0
    spoilt = [
        replace(each, value=each.value - each.value // 4) if each.step is Step.CONSTANT else each
        for each in made.program.instructions
    ]
    assert _beyond(replace(made.program, instructions=tuple(spoilt)), made.kernel, [command], 500) > 0


def test_counts_keep_all_their_bits_as_factors_of_sixteen() -> None:
    """A late call is counted in microseconds: 1150 of them are not 0."""
    made = fixed_firmware(arm_loops()["watched"], FixedPoint(factor=16))
    on_time, late = [0.0, 0.1, 1e-3, 0.0], [0.0, 0.1, 1.2e-3, 0.0]
    rows = np.array([on_time, on_time, late, on_time])
    assert made.run(rows)[:, -1].tolist() == [0, 0, 4, 0]
    assert [row[-1] for row in made.run_integers(made.integers(rows))] == [0, 0, 4, 0]  # bits, with no binary point
    assert made.difference["u"] < 0.01
    texts = [doubt.text for doubt in made.doubts]
    assert "((elapsed*1e-06) ≤ 0.00115)" in texts
    assert not any("absent" in text for text in texts)  # whole numbers are exact


def test_a_comparison_that_rounding_can_decide_is_a_doubt_with_its_margin() -> None:
    w = Assembly("k")
    x = w.input("x")
    kernel = w.finished(
        {"jump": (x * 0.3).less(0.1).where(-1.0, 1.0), "least": (x * 0.3).less(0.1).where(x * 0.3, 0.1)}
    )
    program = to_fixed(kernel, {"x": format_of(-1, 1)}, {}, factor=16)
    assert [doubt.text for doubt in program.doubts] == ["((x*0.3) < 0.1)"]
    assert 1e-6 < program.doubts[0].margin < 1e-4
    assert program.errors["jump"] == 0.0
    only = to_fixed(restricted(kernel, ["least"]), {"x": format_of(-1, 1)}, {}, factor=16)
    assert not only.doubts  # the smaller of two is near the other where the comparison is in doubt
    assert 0.0 < only.errors["least"] < 1e-4


def test_what_has_no_bounds_is_named_with_its_interval() -> None:
    for formula, text in (
        (lambda x: 1.0 / x, r"\(1/x\) in fixed point: .*\[-1, 1\].*its range \[-inf, inf\] is too large"),
        (lambda x: x.apply(Operation.LOG), r"log\(x\) in fixed point"),
        (lambda x: (2.0 * x).apply(Operation.TAN), "it has a pole there"),
    ):
        w = Assembly("k")
        kernel = w.finished({"a": formula(w.input("x"))})
        with pytest.raises(UnboundedError, match=text):
            to_fixed(kernel, {"x": format_of(-1, 1)}, {}, factor=32)


@needs_gcc
@pytest.mark.parametrize("factor", [32, 16])
@pytest.mark.parametrize("name", ["paper", "watched", "PID"])
def test_the_self_test_passes_and_no_operation_overflows(name: str, factor: int, tmp_path: Path) -> None:
    c_project(arm_loops()[name], tmp_path / "c", arithmetic=FixedPoint(factor=factor))
    sources = [str(path) for path in sorted((tmp_path / "c").glob("*.c"))]
    built = subprocess.run(
        [str(GCC), *FLAGS, *sources, "-o", str(tmp_path / "t")], capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    done = subprocess.run([str(tmp_path / "t")], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    text = (tmp_path / "c" / f"{next((tmp_path / 'c').glob('*.h')).stem}.c").read_text()
    assert "double" not in text
    assert "float" not in text


@needs_gcc
def test_ten_thousand_samples_are_bit_equal_and_near_the_simulation(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    ranges = {"y": (-3.0, 3.0), "theta_hat": (-3.0, 3.0), "omega_hat": (-20.0, 20.0), "i_hat": (-100.0, 100.0)}
    c_project(loop, tmp_path / "c", arithmetic=FixedPoint(ranges=ranges))
    found = compare(tmp_path / "c", loop, samples=10_000, initial={"theta": 1.0})
    assert found.equal
    assert found.samples == 10_000
    assert 0.0 < found.largest < 1e-4
    assert verify(tmp_path / "c", loop).holds
    source = next(path for path in (tmp_path / "c").glob("*.c") if path.name != "self_test.c")
    source.write_text(source.read_text().replace("whole(value + (INT64_C(1) << (by - 1U)), by)", "whole(value, by)"))
    assert not compare(tmp_path / "c", loop, samples=100, initial={"theta": 1.0}).equal


def test_ranges_and_differences_stand_in_the_readme(tmp_path: Path) -> None:
    made = c_project(arm_loops()["paper"], tmp_path / "c", arithmetic=FixedPoint(ranges={"omega_hat": (-9, 9)}))
    assert made.fixed is not None
    assert made.fixed.difference["u"] < 1e-5
    text = (tmp_path / "c" / "README.md").read_text()
    for line in ("| omega_hat | -9 | 9 | stated |", "| u | -24 | 24 | its saturation |", "| u | V | 1"):
        assert line in text


def test_mistakes_are_one_clear_line(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    with pytest.raises(DeployError, match="32 or 16 bits"):
        FixedPoint(factor=8)
    with pytest.raises(DeployError, match="1 to -1 is not a finite range"):
        FixedPoint(ranges={"y": (1.0, -1.0)})
    with pytest.raises(DeployError, match="the range of 'alpha': the controller has no signal of this name"):
        fixed_firmware(loop, FixedPoint(ranges={"alpha": (0.0, 1.0)}))
    with pytest.raises(UnboundedError, match="in fixed point"):
        fixed_firmware(catalogue_loop("tank_cascade"), FixedPoint(ranges={"h1": (-1.0, 1.0)}))
    with pytest.raises(DeployError, match="the range of '.*' in fixed point: none is stated, and the rehearsed run"):
        fixed_firmware(random_loop(101), FixedPoint())
    with pytest.raises(DeployError, match="both choose the number format"):
        c_project(loop, tmp_path / "c", precision="float", arithmetic=FixedPoint())
    assert not list(tmp_path.iterdir())
