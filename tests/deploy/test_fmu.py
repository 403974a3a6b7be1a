"""FMUs: valid, and run by FMPy what `simulate` runs, whatever the communication steps."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compilers import GCC
from firmware_loops import arm_loops

import ulna
from ulna.deploy import DeployError, FmuPart, fmu
from ulna.loop import Jitter, Loop
from ulna.system import system_from_mapping

fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")
pytestmark = pytest.mark.skipif(GCC is None, reason="there is no gcc")
START = {"theta": 0.3, "omega": 0.0, "i": 0.0}


def _run(path: Path, *, step: float, end: float = 0.5, start: dict[str, float] | None = None, **options: Any) -> Any:
    found: dict[str, float] = START if start is None else start
    return fmpy.simulate_fmu(
        str(path), stop_time=end, step_size=step, start_values=found, fmi_type="CoSimulation", **options
    )


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ["paper", "integral", "exact hold", "Kalman"])
def test_a_loop_is_valid_and_runs_as_simulated(name: str, version: int, tmp_path: Path) -> None:
    loop = arm_loops()[name]
    made = fmu(loop, tmp_path / "loop.fmu", version=version)
    assert validation.validate_fmu(str(made.path)) == []
    inputs = {s.name: 0.2 for s in loop.references}
    run = ulna.simulate(loop, START, 0.5, inputs=inputs)
    for step in (1e-3, 5e-3, 2.5e-4):
        shown = {"output": ["theta", "u_limited", *made.outputs[:1]], "output_interval": max(step, 1e-3)}
        found = _run(made.path, step=step, start={**START, **inputs}, **shown)
        rows = np.rint(found["time"] / 1e-3).astype(int)
        assert len(rows) > 90
        assert np.abs(found["theta"] - run["theta"][rows]).max() < 1e-12, step
        # What the last sample commands is not simulated any more.
        assert np.abs(found["u_limited"] - run["u_limited"][rows])[:-1].max() < 1e-12, step


def test_between_samples_the_motion_is_shown(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    made = fmu(loop, tmp_path / "loop.fmu")
    fine = _run(made.path, step=1e-4, end=0.01, output=["theta", "u"], output_interval=1e-4)
    assert (np.diff(fine["theta"]) != 0.0).all()
    held = fine["u"][:-1].reshape(10, 10)
    assert (held == held[:, :1]).all()


def test_parameters_and_inputs_of_the_importer_count(tmp_path: Path) -> None:
    base = arm_loops()["PID"]
    plant = ulna.model("one_link_arm")
    values = {p.name: float(p.si_value) for p in plant.parameters if p.si_value is not None}
    loop = Loop(plant=plant, controller=base.controller, hardware=base.hardware)
    made = fmu(loop, tmp_path / "loop.fmu", version=2)
    assert set(made.parameters) == set(values)
    name = "m2" if "m2" in values else made.parameters[0]
    changed = {name: 1.2 * values[name]}
    run = ulna.simulate(loop, START, 0.5, inputs={"theta_ref": 0.4}, parameters=changed)
    found = _run(made.path, step=1e-3, start={**START, **changed, "theta_ref": 0.4}, output=["theta"])
    assert np.abs(found["theta"] - run["theta"]).max() < 1e-12
    signal = np.array([(0.0, 0.0), (0.1, 0.0), (0.1, 0.4), (0.5, 0.4)], dtype=[("time", float), ("theta_ref", float)])
    found = _run(made.path, step=1e-3, start=START, input=signal, output=["theta"])
    steps = ulna.Held(times=np.array([0.0, 0.1]), values=np.array([0.0, 0.4]))
    run = ulna.simulate(loop, START, 0.5, inputs={"theta_ref": steps})
    assert np.abs(found["theta"] - run["theta"])[:100].max() < 1e-12


def test_the_controller_alone_gives_the_commands_of_the_firmware(tmp_path: Path) -> None:
    loop = arm_loops()["paper"]
    made = fmu(loop, tmp_path / "controller.fmu", part=FmuPart.CONTROLLER, version=2)
    assert validation.validate_fmu(str(made.path)) == []
    assert (made.inputs, made.outputs) == (("y",), ("u", "theta_hat", "omega_hat", "i_hat", "fault"))
    run = ulna.simulate(loop, START, 0.2)
    folder = fmpy.extract(str(made.path))
    try:
        one, reference = _slave(made.path, folder)
        for k, value in enumerate([*run["y_measured"], np.nan, 0.1]):
            one.setReal([reference["y"]], [float(value)])
            command, fault = one.getReal([reference["u"], reference["fault"]])
            one.doStep(k * 1e-3, 1e-3)
            if k < len(run.times):
                assert (command, fault) == (run["u_limited"][k], 0.0), k
            else:
                assert np.isfinite(command)
                assert fault == (1.0 if k == len(run.times) else 0.0)
        one.terminate()
        one.freeInstance()
    finally:
        shutil.rmtree(folder)


def _slave(path: Path, folder: str) -> tuple[Any, dict[str, int]]:
    """An FMU that has begun, and its value references by name."""
    read = fmpy.read_model_description(str(path))
    name = read.coSimulation.modelIdentifier
    one = fmpy.fmi2.FMU2Slave(guid=read.guid, unzipDirectory=folder, modelIdentifier=name, instanceName="one")
    one.instantiate()
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    return one, {v.name: v.valueReference for v in read.modelVariables}


@pytest.mark.parametrize("version", [2, 3])
def test_a_plant_alone_moves_as_its_equations_say(version: int, tmp_path: Path) -> None:
    plant = system_from_mapping(
        {
            "name": "oscillator",
            "states": {"p": "v", "v": "-4*p - v/2 + u"},
            "inputs": {"u": {}},
            "outputs": {"y": "p"},
        }
    )
    made = fmu(Loop(plant=plant), tmp_path / "plant.fmu", part="plant", version=version, step=1e-3)
    assert validation.validate_fmu(str(made.path)) == []
    found = _run(made.path, step=0.01, end=2.0, start={"p": 1.0, "u": 0.5}, output=["y"])
    rate, speed = -0.25, np.sqrt(4 - 0.0625)
    t = found["time"]
    exact = 0.125 + 0.875 * np.exp(rate * t) * (np.cos(speed * t) - rate / speed * np.sin(speed * t))
    assert np.abs(found["y"] - exact).max() < 1e-11


def test_states_are_kept_and_put_back(tmp_path: Path) -> None:
    made = fmu(arm_loops()["paper"], tmp_path / "loop.fmu", version=2)
    folder = fmpy.extract(str(made.path))
    try:
        one, reference = _slave(made.path, folder)
        one.doStep(0.0, 0.1)
        kept = one.getFMUState()
        one.doStep(0.1, 0.1)
        later = one.getReal([reference["theta"], reference["u"]])
        one.setFMUState(kept)
        one.doStep(0.1, 0.1)
        assert one.getReal([reference["theta"], reference["u"]]) == later
        one.freeFMUState(kept)
        with pytest.raises(Exception, match="fmi2SetReal"):
            one.setReal([reference["theta"]], [0.0])
        one.terminate()
        one.freeInstance()
        name = fmpy.read_model_description(str(made.path)).coSimulation.modelIdentifier
        other = fmpy.fmi2.FMU2Slave(guid="x", unzipDirectory=folder, modelIdentifier=name, instanceName="x")
        with pytest.raises(Exception, match="nstantiate"):
            other.instantiate()
    finally:
        shutil.rmtree(folder)


@pytest.mark.parametrize("version", [2, 3])
def test_sources_build_without_a_warning(version: int, tmp_path: Path) -> None:
    made = fmu(arm_loops()["integral"], tmp_path / "loop.fmu", version=version)
    with zipfile.ZipFile(made.path) as archive:
        archive.extractall(tmp_path / "all")
    files = sorted(map(str, (tmp_path / "all" / "sources").glob("*.c")))
    flags = [
        "-std=c99",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Wshadow",
        "-Werror",
        "-ffp-contract=off",
        "-shared",
        "-fPIC",
    ]
    done = subprocess.run(
        [str(GCC), *flags, *files, "-o", str(tmp_path / "x.so")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    again = fmu(arm_loops()["integral"], tmp_path / "again.fmu", version=version)
    assert again.path.read_bytes() == made.path.read_bytes()


def test_what_users_wrote_is_text_in_the_description(tmp_path: Path) -> None:
    loop = arm_loops()["states"]
    hostile = '"/><x y="&lt;\n*/ int x;'
    states = tuple(replace(s, text=hostile) if s.name == "theta" else s for s in loop.plant.states)
    plant = replace(loop.plant, name=hostile, states=states)
    made = fmu(Loop(plant=plant, controller=loop.controller, hardware=loop.hardware), tmp_path / "x.fmu")
    assert validation.validate_fmu(str(made.path)) == []
    assert fmpy.read_model_description(str(made.path)).modelVariables


def test_what_no_fmu_can_be_is_refused_in_one_line(tmp_path: Path) -> None:
    loop, place = arm_loops()["paper"], tmp_path / "x.fmu"
    with pytest.raises(DeployError, match="FMI 1: FMI 2.0 and 3.0 are supported"):
        fmu(loop, place, version=1)
    with pytest.raises(DeployError, match="no processor"):
        fmu(Loop(plant=loop.plant, controller=loop.controller), place)
    with pytest.raises(DeployError, match="steps=0: expected at least one step"):
        fmu(loop, place, steps=0)
    assert loop.hardware is not None
    late = replace(loop.hardware, clock=Jitter(width=1e-4))
    with pytest.raises(DeployError, match="its clock is random"):
        fmu(Loop(plant=loop.plant, controller=loop.controller, hardware=late), place)
    with pytest.raises(DeployError, match="what the amplifier of u applied"):
        fmu(arm_loops()["amplifier"], place, part="controller")
    assert not list(tmp_path.iterdir())
    place.write_text("mine")
    with pytest.raises(DeployError, match="it exists already"):
        fmu(loop, place)
    made = fmu(loop, tmp_path / "sources.fmu", compiler="nocc")
    assert made.platform == ""
