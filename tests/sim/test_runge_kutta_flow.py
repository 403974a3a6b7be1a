"""Continuous runs where heyoka is not installed: SciPy's method finds the same motions and events."""

from __future__ import annotations

import numpy as np
import pytest

import ulna
from ulna.sim.continuous import ensemble, prepared
from ulna.system import system_from_mapping

APART = ulna.Taylor(maximum_steps=999_999)
"""Equal to the default but for its place among the flows that are kept."""


@pytest.fixture(autouse=True)
def without_heyoka(monkeypatch) -> None:
    monkeypatch.setattr(prepared, "taylor_available", lambda: False)
    monkeypatch.setattr(ensemble, "taylor_available", lambda: False)


def _plant(states, *, outputs=None, inputs=()):
    return system_from_mapping(
        {
            "format": 1,
            "name": "plant",
            "states": states,
            "inputs": {name: {} for name in inputs},
            "outputs": outputs or {},
        }
    )


def test_a_smooth_motion_is_that_of_a_closed_formula() -> None:
    run = ulna.simulate(_plant({"x": "v", "v": "-x"}), [1, 0], np.linspace(0, 10, 101), engine=APART)
    assert np.abs(run["x"] - np.cos(run.times)).max() < 1e-10


def test_a_ball_bounces_at_exact_instants() -> None:
    ball = _plant({"h": "v", "v": "-10"})
    floor = ulna.EndStop(position="h", velocity="v", lower=0.0, restitution=0.5)
    loop = ulna.Loop(plant=ball, controller=None, hardware=ulna.Hardware(end_stops=(floor,)))
    run = ulna.simulate(loop, [5, 0], 2.5, engine=APART)
    assert [event.time for event in run.events][:2] == pytest.approx([1.0, 2.0], abs=1e-9)


def test_dry_friction_sticks() -> None:
    block = _plant({"x": "v", "v": "-2*sign(v)"})
    run = ulna.simulate(block, [0, 1], 2.0, engine=APART)
    assert run["x"][-1] == pytest.approx(0.25, abs=1e-9)
    assert run["v"][-1] == pytest.approx(0.0, abs=1e-9)


def test_a_motion_to_infinity_blows_up_in_time() -> None:
    run = ulna.simulate(_plant({"x": "x**2"}), [1], 2.0, engine=APART, throw=False)
    assert run.outcome is ulna.Outcome.BLEW_UP
    assert run.times[-1] == pytest.approx(1.0, abs=1e-6)


def test_too_few_steps_are_said() -> None:
    few = ulna.Taylor(maximum_steps=3)
    run = ulna.simulate(_plant({"x": "v", "v": "-x"}), [1, 0], 100.0, engine=few, throw=False)
    assert run.outcome is ulna.Outcome.STEP_LIMIT


def test_many_runs_have_the_figures_of_each() -> None:
    mass = _plant({"x": "-x"}, outputs={"y": "x"})
    many = ulna.simulate(mass, [[1.0], [2.0]], 5.0, engine=APART, targets={"y": 0.0})
    assert many.final_state[:, 0] == pytest.approx(np.exp(-5.0) * np.array([1.0, 2.0]), rel=1e-9)
