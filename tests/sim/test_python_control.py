"""Systems through python-control: the same trajectories, and linear systems there and back."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import sympy as sp

from ulna.base import OptionalDependencyError, SimulationError
from ulna.sim import Interpolated, simulate
from ulna.sim.python_control import from_control, to_control
from ulna.system import System, system_from_mapping

control = pytest.importorskip("control")

PENDULUM = system_from_mapping(
    {
        "name": "pendulum",
        "states": {
            "theta": {"equation": "omega", "unit": "rad"},
            "omega": {"equation": "-g/l*sin(theta) - d*omega + u", "unit": "rad/s"},
        },
        "inputs": {"u": {"unit": "rad/s^2"}},
        "outputs": {"tip": {"equation": "l*cos(theta)", "unit": "m"}, "theta": {"equation": "theta", "unit": "rad"}},
        "parameters": {
            "g": {"value": "9.81", "unit": "m/s^2"},
            "l": {"value": 50, "unit": "cm"},
            "d": {"unit": "1/s"},
        },
    }
)
TIMES = np.linspace(0, 4, 81)
# Tighter than what is compared: the kinks of a sampled input cost an adaptive method digits.
TIGHT = {"rtol": 1e-13, "atol": 1e-13}


def response(system, times, inputs, initial, **how):
    return control.input_output_response(
        system, times, inputs, initial, solve_ivp_method="DOP853", solve_ivp_kwargs=TIGHT, **how
    )


@pytest.mark.parametrize("d", [0.2, 1.5])
def test_both_libraries_simulate_the_same_run(d: float) -> None:
    pushed = np.sin(3 * TIMES)
    ours = simulate(
        PENDULUM, [1.0, 0.0], TIMES, inputs={"u": Interpolated(times=TIMES, values=pushed)}, parameters={"d": d}
    )
    there = to_control(PENDULUM, {"d": 0.2})
    theirs = response(there, TIMES, pushed, [1.0, 0.0], params={"d": d})
    assert np.abs(theirs.states.T - ours.states).max() < 1e-8
    assert np.abs(theirs.outputs.T - ours.outputs).max() < 1e-8


def test_names_and_si_values_are_kept() -> None:
    there = to_control(PENDULUM, {"d": 0.1})
    assert there.state_labels == ["theta", "omega"]
    assert there.input_labels == ["u"]
    assert there.output_labels == ["tip", "theta"]
    assert there.params == {"g": 9.81, "l": 0.5, "d": 0.1}


def test_parts_can_be_joined_over_there() -> None:
    u, theta, omega = sp.symbols("u theta omega", real=True)
    law = System(
        name="law",
        states=(),
        rates=(),
        inputs=PENDULUM.states,
        outputs=PENDULUM.inputs,
        readouts=(-3 * theta - 2 * omega,),
    )
    plant = to_control(PENDULUM, {"d": 0.1})
    bare = to_control(
        System(name="bare", states=PENDULUM.states, rates=PENDULUM.rates, inputs=PENDULUM.inputs,
               parameters=PENDULUM.parameters), {"d": 0.1}
    )  # fmt: skip
    assert bare.output_labels == ["theta", "omega"]
    loop = control.interconnect([bare, to_control(law)], inputs=[], outputs=["theta"])
    theirs = response(loop, TIMES, 0, [1.0, 0.0])
    closed = System(
        name="closed",
        states=PENDULUM.states,
        rates=tuple(rate.xreplace({u: -3 * theta - 2 * omega}) for rate in PENDULUM.rates),
        parameters=PENDULUM.parameters,
    )
    ours = simulate(closed, [1.0, 0.0], TIMES, parameters={"d": 0.1})
    assert np.abs(np.squeeze(theirs.outputs) - ours["theta"]).max() < 1e-8
    assert plant.nstates == 2


def test_linear_systems_go_there_and_back() -> None:
    given = control.ss([[0.0, 1.0], [-2.5, -0.1]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.25]], name="oscillator")
    here = from_control(given)
    assert (
        here.rates[1] == sp.Rational(-5, 2) * here.state_symbols[0] - here.state_symbols[1] / 10 + here.input_symbols[0]
    )
    pushed = np.cos(TIMES)
    name = here.inputs[0].name
    ours = simulate(here, [1.0, -1.0], TIMES, inputs={name: Interpolated(times=TIMES, values=pushed)})
    theirs = response(given, TIMES, pushed, [1.0, -1.0])
    assert np.abs(np.squeeze(theirs.outputs) - ours.outputs[:, 0]).max() < 1e-8
    again = to_control(here)
    assert np.abs(response(again, TIMES, pushed, [1.0, -1.0]).outputs - theirs.outputs).max() < 1e-9


def test_a_transfer_function_is_realised() -> None:
    here = from_control(control.tf([2.0], [1.0, 3.0, 2.0], name="filter"))
    end = simulate(here, np.zeros(2), [0.0, 30.0], inputs={here.inputs[0].name: 1.0}).outputs[-1, 0]
    assert end == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda: to_control(PENDULUM), "parameters without a value: d"),
        (lambda: to_control(PENDULUM, {"d": 1.0, "mass": 2.0}), "parameter 'mass'"),
        (lambda: from_control(to_control(PENDULUM, {"d": 1.0})), "no formulas"),
        (lambda: from_control(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], True)), "without a period"),
        (lambda: from_control(3), "no formulas"),
    ],
)
def test_what_cannot_be_taken_over_is_one_clear_error(call, reason: str) -> None:
    with pytest.raises(SimulationError, match=reason):
        call()


def test_without_python_control_the_extra_is_named(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(OptionalDependencyError, match=r"ulna\[control\]"):
        to_control(PENDULUM, {"d": 1.0})
