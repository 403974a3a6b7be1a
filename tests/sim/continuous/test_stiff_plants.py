"""Stiff plants end right, by the implicit engine, which takes over by itself."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq
from typer.testing import CliRunner

from ulna.base import OptionalDependencyError, SimulationError
from ulna.cli.main import app
from ulna.loop import EndStop, Hardware, Loop, Saturation
from ulna.program import to_python
from ulna.sim import TIME, Crossing, Ends, EventKind, Implicit, Outcome, Taylor, simulate
from ulna.sim.continuous.layout import Layout
from ulna.sim.continuous.stiffness import Stiffness
from ulna.symbolic.compiling import kernel
from ulna.system import Parameter, Signal, System

x, v, w, u, mu, L = sp.symbols("x v w u mu L", real=True)


def plant(*rates: object, inputs: str = "", **parameters: float) -> System:
    return System(
        name="plant",
        states=tuple(Signal(name=name) for name in "xvw"[: len(rates)]),
        rates=tuple(map(sp.sympify, rates)),
        inputs=tuple(Signal(name=name) for name in inputs.split()),
        parameters=tuple(Parameter(name=name, value=sp.Float(value)) for name, value in parameters.items()),
    )


VAN_DER_POL = plant(v, mu * (1 - x**2) * v - x, mu=1e6)
ROBERTSON = plant(-0.04 * x + 1e4 * v * w, 0.04 * x - 1e4 * v * w - 3e7 * v**2, 3e7 * v**2)
COIL = plant((u - x - v) / L, x - v, inputs="u", L=1e-9)


def test_robertson_ends_right_at_1e11_seconds() -> None:
    run = simulate(ROBERTSON, (1, 0, 0), [0.0, 40.0, 1e11])
    assert run.note.startswith("stiff")
    np.testing.assert_allclose(
        run.states[1], [0.7158270687193941, 9.185534764557339e-06, 0.2841637457458413], rtol=1e-7
    )
    # Hairer and Wanner, Solving Ordinary Differential Equations II: the values at 1e11 s.
    expected = [0.2083340149701255e-07, 0.8333360770334713e-13, 0.9999999791665050]
    np.testing.assert_allclose(run.final_state, expected, rtol=1e-6)


def test_van_der_pol_ends_right() -> None:
    published = plant(v, ((1 - x**2) * v - x) / sp.Float(1e-6))
    run = simulate(published, (2, -0.66), 2.0, engine=Implicit())
    # The same book: problem VDPOL.
    np.testing.assert_allclose(run.final_state, [1.706167732170483, -0.8928097010247975], rtol=1e-6)
    slow = simulate(VAN_DER_POL, (2, 0), 0.5e6)
    # Without the fast motion (1/x − x) x' = 1/μ.
    expected = brentq(lambda z: np.log(z) - z**2 / 2 - (np.log(2) - 1.5), 1.0, 2.0, xtol=1e-14)
    assert slow.note
    assert slow.final_state[0] == pytest.approx(expected, rel=1e-7)
    assert simulate(VAN_DER_POL, (2, 0), 2e6).outcome is Outcome.FINISHED


def test_a_coil_of_a_nanosecond_ends_right() -> None:
    run = simulate(COIL, (0, 0), np.linspace(0.0, 1.0, 11), inputs={"u": sp.sin(10 * TIME)})
    t = run.times
    # v' = u − 2 v of the limit L → 0, with L's first correction far below the tolerance.
    exact = (2 * np.sin(10 * t) - 10 * np.cos(10 * t) + 10 * np.exp(-2 * t)) / 104
    np.testing.assert_allclose(run["v"], exact, rtol=0, atol=1e-7)
    assert "Implicit()" in run.note
    many = simulate(COIL, [[0.0, 0.0]] * 3, 1.0, inputs={"u": [1.0, 2.0, 3.0]}, record=Ends(), threads=1)
    np.testing.assert_allclose(many.final_state[:, 1], np.array([1, 2, 3]) * -np.expm1(-2.0) / 2, rtol=1e-7)
    implicit = simulate(COIL, [[0.0, 0.0]], 1.0, inputs={"u": [1.0]}, record=Ends(), engine=Implicit())
    assert implicit.final_state[0, 1] == many.final_state[0, 1]


def test_both_engines_agree_on_limits_walls_and_events() -> None:
    body = System(
        name="body",
        states=(Signal(name="x"), Signal(name="v")),
        rates=(v, u - x / 5 - sp.sign(v) / 50),
        inputs=(Signal(name="u"),),
        outputs=(Signal(name="x"),),
        readouts=(x,),
    )
    hardware = Hardware(
        saturation={"u": Saturation(lower=-0.1, upper=0.4)},
        end_stops=(EndStop(position="x", velocity="v", lower=-0.2, upper=0.5, restitution=0.5),),
    )
    loop = Loop(plant=body, hardware=hardware)
    found = [
        simulate(
            loop,
            (0.0, 0.3),
            np.linspace(0.0, 6.0, 13),
            inputs={"u": sp.sin(TIME)},
            events=(Crossing(name="half", expression=x - sp.Rational(1, 4)),),
            engine=engine,
        )
        for engine in (Taylor(), Implicit(tolerance=1e-11))
    ]
    np.testing.assert_allclose(found[1].states, found[0].states, rtol=0, atol=1e-7)
    assert [event.kind for event in found[1].events] == [event.kind for event in found[0].events]
    assert {EventKind.BOUNCED, EventKind.CROSSED, EventKind.SATURATION_ENTERED} <= {e.kind for e in found[0].events}
    np.testing.assert_allclose([e.time for e in found[1].events], [e.time for e in found[0].events], rtol=0, atol=1e-7)


def test_outcomes_of_the_implicit_engine() -> None:
    blown = simulate(plant(x**2), [1.0], 5.0, engine=Implicit(), throw=False)
    assert blown.outcome is Outcome.BLEW_UP
    assert blown.times[-1] == pytest.approx(1.0, abs=1e-6)
    rested = simulate(plant(-sp.sqrt(x)), [1.0], 5.0, engine=Implicit())
    assert rested.final_state[0] == 0.0
    pole = simulate(plant(1, 1 / (x - sp.Rational(7, 10))), (0, 0), 2.0, engine=Implicit(), throw=False)
    assert (pole.outcome, pole.events[-1].signal) == (Outcome.EDGE, "the denominator -0.7 + x reaches 0")
    few = simulate(ROBERTSON, (1, 0, 0), 1e11, engine=Implicit(maximum_steps=20), throw=False)
    assert few.outcome is Outcome.STEP_LIMIT
    with pytest.raises(SimulationError, match="tolerance"):
        Implicit(tolerance=1.0)


def test_a_fast_oscillation_is_not_stiff_and_a_fast_decay_is() -> None:
    def holds(*rates: sp.Expr) -> bool:
        lowered = kernel("rates", (x, v), {"x'": rates[0], "v'": rates[1]})
        assert len(to_python(lowered)(1.0, 1.0)) == 2
        return Stiffness(lowered, Layout(states=("x", "v"))).holds([1.0, 1.0], 1e-3, 1e6, 200_000)

    assert holds(-1e4 * x, v)
    assert not holds(1e4 * v, -1e4 * x)
    assert not holds(-10 * x, v)
    oscillator = simulate(plant(v, -1e8 * x), (1.0, 0.0), 5.0, throw=False)
    assert not oscillator.note
    assert oscillator["x"][-1] == pytest.approx(np.cos(5e4), abs=1e-8)


def test_without_the_extra_one_line_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sksundae", None)
    monkeypatch.setitem(sys.modules, "sksundae.cvode", None)
    monkeypatch.setattr("ulna.sim.continuous.run.implicit_available", lambda: False)
    other = plant(-x * 1e9, v - x)
    with pytest.raises(OptionalDependencyError, match=r"ulna\[stiff\]"):
        simulate(other, (1.0, 0.0), 1.0, engine=Implicit())
    left = simulate(other, (1.0, 0.0), 1.0, throw=False)
    assert left.outcome is Outcome.STEP_LIMIT
    assert "ulna[stiff]" in left.note


def test_the_command_line_knows_it(tmp_path: Path) -> None:
    file = tmp_path / "coil.toml"
    file.write_text('[states]\ni = "(1 - i - w)*1e9"\nw = "i - w"\n[outputs]\ny = "w"\n')
    for options in ([], ["--engine", "implicit"]):
        result = CliRunner().invoke(app, ["simulate", str(file), "--horizon", "1", "--json", *options])
        assert result.exit_code == 0
        shown = json.loads(result.stdout)
        assert bool(shown["note"]) is not bool(options)
        assert shown["signals"]["w"][-1] == pytest.approx(-np.expm1(-2.0) / 2, rel=1e-6)
