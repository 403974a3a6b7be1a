"""The C of a folder in the simulated loop: the same run, and another one where the C is another one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compilers import GCC
from firmware_loops import CATALOGUE, arm_loops, catalogue_loop

import ulna
from ulna.base import SimulationError
from ulna.deploy import Compiled, DeployError, FixedPoint, c_project, fixed_firmware
from ulna.loop import Deadline, Guard, Jitter, Loop, MeasurementNoise, MissedSamples, SafeOutput
from ulna.sim import FixedSteps, Gpu, Paths, Trajectory
from ulna.system import given_point

pytestmark = pytest.mark.skipif(GCC is None, reason="there is no gcc")


def _start(loop: Loop) -> dict[str, float]:
    return {s.name: 0.3 if k == 0 else 0.0 for k, s in enumerate(loop.plant.states)}


def _same(left: Trajectory, right: Trajectory) -> bool:
    series = [(left[name], right[name]) for name in left.further]
    return all(np.array_equal(a, b) for a, b in [(left.states, right.states), *series])


@pytest.mark.parametrize("name", arm_loops())
def test_a_run_by_the_compiled_c_is_the_run_of_the_simulator(name: str, tmp_path: Path) -> None:
    loop = arm_loops()[name]
    inputs = {s.name: 0.2 for s in loop.references}
    c_project(loop, tmp_path / "c")
    expected = ulna.simulate(loop, _start(loop), 3.0, inputs=inputs)
    assert _same(ulna.simulate(loop, _start(loop), 3.0, inputs=inputs, engine=Compiled(tmp_path / "c")), expected)


@pytest.mark.parametrize("name", CATALOGUE[::4])
def test_catalogue_loops_run_by_their_c(name: str, tmp_path: Path) -> None:
    loop = catalogue_loop(name)
    c_project(loop, tmp_path / "c")
    point = given_point(loop.plant).numbers
    start = {s.name: float(point[s.name]) + 0.01 for s in loop.plant.states}
    expected = ulna.simulate(loop, start, 0.5, throw=False)
    assert _same(ulna.simulate(loop, start, 0.5, engine=Compiled(tmp_path / "c"), throw=False), expected)


def test_noise_late_clocks_and_missed_samples_reach_the_c_of_many_runs(tmp_path: Path) -> None:
    loop = arm_loops()["PID"]
    assert loop.hardware is not None
    hardware = replace(
        loop.hardware,
        noise=MeasurementNoise(std=1e-4),
        clock=(Jitter(width=3e-4), MissedSamples(probability=0.2)),
        guard=Guard(reaction=SafeOutput(0.0)),
    )
    real = Loop(plant=loop.plant, controller=loop.controller, hardware=hardware)
    c_project(real, tmp_path / "c")
    starts = np.random.default_rng(1).normal(0.0, 0.1, (50, 3))
    names = ("theta", "u_limited", "u_command", "total", "theta_measured")
    runs = [
        ulna.simulate(real, starts, 0.3, inputs={"theta_ref": 0.1}, engine=engine, record=Paths(*names), seed=7)
        for engine in (None, Compiled(tmp_path / "c"))
    ]
    for name in names:
        assert np.array_equal(runs[0].paths[name], runs[1].paths[name])
    assert np.array_equal(runs[0].final_state, runs[1].final_state)


def test_single_precision_runs_beside_double(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    c_project(loop, tmp_path / "c", precision="float")
    expected = ulna.simulate(loop, _start(loop), 1.0)
    found = ulna.simulate(loop, _start(loop), 1.0, engine=Compiled(tmp_path / "c"))
    assert np.array_equal(found["u_limited"], found["u_limited"].astype(np.float32))
    assert 0.0 < np.abs(found.states - expected.states).max() < 1e-3


def test_integers_run_in_the_loop_as_python_computes_them(tmp_path: Path) -> None:
    watched = arm_loops()["watched"]
    assert watched.hardware is not None
    late = Deadline(lateness=1.5e-4, reaction=SafeOutput(0.5))
    hardware = replace(watched.hardware, clock=Jitter(width=2e-4), deadline=late)
    loop = Loop(plant=watched.plant, controller=watched.controller, hardware=hardware)
    fixed = FixedPoint(factor=16, ranges={"y": (-1.0, 4.0), "theta_hat": (-1.0, 4.0), "y_ref": (-1.0, 1.0)})
    c_project(loop, tmp_path / "c", arithmetic=fixed)
    start, inputs = _start(loop) | {"theta": 0.05}, {"y_ref": 0.1}
    found = ulna.simulate(loop, start, 0.5, inputs=inputs, engine=Compiled(tmp_path / "c"))
    made = fixed_firmware(loop, fixed)
    assert [port.name for port in made.made.inputs] == ["y", "y_ref", "elapsed"]
    elapsed = np.diff(found.times, prepend=found.times[0] - 1e-3)
    reference = np.full(len(found.times), 0.1)
    rows = np.column_stack([found["y_measured"], reference, elapsed])
    alone = made.run(rows)
    assert np.array_equal(found["fault"], alone[:, -1])
    assert np.array_equal(found["u_limited"], alone[:, 0])
    assert len(set(alone[:, -1])) > 1
    expected = ulna.simulate(loop, start, 0.5, inputs=inputs)
    assert 0.0 < np.abs(found["theta"] - expected["theta"]).max() < 1e-3


def test_memory_begins_as_the_folder_says_unless_the_run_does(tmp_path: Path) -> None:
    loop = arm_loops()["PID"]
    c_project(loop, tmp_path / "c", initial={"total": 3.0, "u": 2.0})
    engine, inputs = Compiled(tmp_path / "c"), {"theta_ref": 0.0}
    named = {**_start(loop), "total": 3.0, "u": 2.0}
    begun = ulna.simulate(loop, _start(loop), 0.1, inputs=inputs, engine=engine)
    assert _same(begun, ulna.simulate(loop, named, 0.1, inputs=inputs))
    other = {**_start(loop), "total": 1.0}
    assert _same(
        ulna.simulate(loop, other, 0.1, inputs=inputs, engine=engine), ulna.simulate(loop, other, 0.1, inputs=inputs)
    )


def test_c_that_was_changed_is_run_as_it_stands(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    c_project(loop, tmp_path / "c")
    source = next((tmp_path / "c").glob("one*.c"))
    source.write_text(source.read_text().replace("24.0", "5.0"))
    found = ulna.simulate(loop, {"theta": 1.0, "omega": 0.0, "i": 0.0}, 0.5, engine=Compiled(tmp_path / "c"))
    assert np.abs(found["u_limited"]).max() == 5.0
    source.write_text("no C")
    with pytest.raises(DeployError, match="cc refuses it"):
        ulna.simulate(loop, _start(loop), 0.5, engine=Compiled(tmp_path / "c"))


def test_what_cannot_run_is_refused_in_one_line(tmp_path: Path) -> None:
    loops = arm_loops()
    c_project(loops["states"], tmp_path / "c")
    engine = Compiled(tmp_path / "c")
    with pytest.raises(DeployError, match=r"in the loop of 'one-link arm with a DC motor': the folder is of design"):
        ulna.simulate(loops["paper"], _start(loops["paper"]), 0.1, engine=engine)
    with pytest.raises(SimulationError, match="for a loop whose controller runs once a period"):
        ulna.simulate(loops["paper"].plant, (0, 0, 0), 0.1, engine=engine)
    with pytest.raises(DeployError, match="it has no design.json"):
        ulna.simulate(loops["paper"], _start(loops["paper"]), 0.1, engine=Compiled(tmp_path))
    with pytest.raises(DeployError, match="the compiler 'nocc': it is not on the path"):
        ulna.simulate(loops["states"], _start(loops["states"]), 0.1, engine=Compiled(tmp_path / "c", "nocc"))
    c_project(loops["PID"], tmp_path / "PID")
    with pytest.raises(SimulationError, match="parameter 'kp': the controller's numbers are compiled already"):
        ulna.simulate(
            loops["PID"], _start(loops["PID"]), 0.1,
            inputs={"theta_ref": 0.0}, parameters={"kp": 1.0}, engine=Compiled(tmp_path / "PID"),
        )  # fmt: skip
    with pytest.raises(SimulationError, match="a GPU has no other processor's code"):
        FixedSteps(device=Gpu(), processor=engine)
