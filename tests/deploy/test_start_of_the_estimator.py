"""An estimator whose coordinates are not 0 where the plant is: the C starts where the simulation does."""

from __future__ import annotations

from pathlib import Path

import pytest
from compilers import GCC

import ulna
from ulna.deploy import c_project, compare, controllers_part
from ulna.loop import Hardware, Loop, Saturation
from ulna.program import Plain
from ulna.system import system_from_mapping

PENDULUM = {
    "name": "pendulum read from a shifted scale",
    "states": {"theta": "omega", "omega": "u - sin(theta)"},
    "inputs": {"u": {}},
    "outputs": {"y": "theta + 0.3"},
}


@pytest.mark.skipif(GCC is None, reason="there is no gcc")
def test_the_first_samples_are_those_of_the_simulation(tmp_path: Path) -> None:
    plant = system_from_mapping(PENDULUM)
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    observer = ulna.injected_observer(ulna.observer_form(plant), ulna.Poles(-8, -9))
    hardware = Hardware(period=1e-2, saturation=Saturation(lower=-5.0, upper=5.0), arithmetic=Plain())
    loop = Loop(plant=plant, controller=ulna.compensator(law, observer), hardware=hardware)
    made = c_project(loop, tmp_path / "c")
    assert any(made.firmware.initial.values())
    assert compare(tmp_path / "c", loop, samples=50, initial={"theta": 0.5}).equal
    # A run that begins with an estimate is that of a folder which was written to begin with it.
    start = {"theta": 0.5, "theta_hat": 0.4, "omega_hat": -0.1}
    assert not compare(tmp_path / "c", loop, samples=50, initial=start).equal
    c_project(loop, tmp_path / "told", initial=controllers_part(loop, start))
    assert compare(tmp_path / "told", loop, samples=50, initial=start).equal
