"""Systems without states: read and written, closed round rings, simulated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import ulna
from ulna.base import PlantError, SimulationError
from ulna.system import System, connect, read_system, system_from_mapping, write_system

A, B, K = sp.symbols("a b k", real=True)
_ATOMS = st.sampled_from([A, B, K, *map(sp.Rational, (1, -2, 3, "1/3", "-7/10"))])
_FUNCTIONS = st.sampled_from([sp.sin, sp.tanh, sp.Abs, lambda e: sp.Min(e, 2), lambda e: sp.Max(e, -1)])
FORMULAS = st.recursive(
    _ATOMS,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda pair: pair[0] + pair[1]),
        st.tuples(inner, inner).map(lambda pair: pair[0] * pair[1]),
        st.tuples(_FUNCTIONS, inner).map(lambda pair: pair[0](pair[1])),
        st.tuples(inner, inner).map(lambda pair: sp.Piecewise((pair[0], A < 1), (pair[1], True))),
    ),
    max_leaves=8,
)


def static(name: str, inputs: tuple[str, ...], **outputs: str) -> System:
    return system_from_mapping({"name": name, "inputs": {each: {} for each in inputs}, "outputs": outputs})


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(first=FORMULAS, second=FORMULAS, ending=st.sampled_from(["toml", "json"]))
def test_a_static_system_reads_back_as_it_was_written(
    first: sp.Expr, second: sp.Expr, ending: str, tmp_path: Path
) -> None:
    data: dict[str, Any] = {"parameters": {"k": 3}, "inputs": {"a": {}, "b": {}}, "outputs": {"y": 1, "z": 2}}
    plain = system_from_mapping(data)
    law = System(
        name="law",
        states=(),
        rates=(),
        inputs=plain.inputs,
        outputs=plain.outputs,
        readouts=(sp.sympify(first), sp.sympify(second)),
        parameters=plain.parameters,
    )
    path = tmp_path / f"law.{ending}"
    write_system(law, path)
    back = read_system(path)
    assert (back.inputs, back.outputs, back.parameters) == (law.inputs, law.outputs, law.parameters)
    point = {A: sp.Rational(3, 7), B: sp.Rational(-5, 3), K: sp.Rational(11, 4)}
    for one, other in zip(back.readouts, law.readouts, strict=True):
        assert float(one.subs(point)) == pytest.approx(float(other.subs(point)), rel=1e-12, abs=1e-12)


@given(st.fractions(-4, 4, max_denominator=9), st.fractions(-4, 4, max_denominator=9))
def test_a_ring_of_two_gains_has_the_solution_by_hand(p: Any, q: Any) -> None:
    """B = p a + r and a = q b: b = r/(1 − p q)."""
    parts = {"one": static("one", ("a", "r"), b=f"{p}*a + r"), "two": static("two", ("b",), a=f"{q}*b")}
    wires = {"one.a": "two.a", "two.b": "one.b"}
    if p * q == 1:
        with pytest.raises(PlantError, match=r"the algebraic loop .*gain of exactly 1"):
            connect(parts, wires, outputs=["one.b"], name="ring")
        return
    ring = connect(parts, wires, outputs=["one.b", "two.a"], name="ring")
    r = sp.Symbol("r", real=True)
    b = r / (1 - sp.Rational(p.numerator, p.denominator) * sp.Rational(q.numerator, q.denominator))
    shown = ring.inline(ring.readouts)
    assert sp.expand(shown[0] - b) == 0
    assert sp.expand(shown[1] - sp.Rational(q.numerator, q.denominator) * b) == 0


def test_the_ring_of_the_issue_is_simulated() -> None:
    parts = {"one": static("one", ("a", "r"), b="-2*a + r"), "two": static("two", ("b",), a="b/4")}
    ring = connect(parts, {"one.a": "two.a", "two.b": "one.b"}, outputs=["one.b"], name="ring")
    times = np.linspace(0, 2, 9)
    run = ulna.simulate(ring, (), times, inputs={"r": sp.sin(ulna.TIME)})
    assert run["b"] == pytest.approx(np.sin(times) / 1.5, abs=1e-15)
    assert ring == system_from_mapping(ulna.system.system_to_mapping(ring))


def test_three_gains_in_two_rings_that_share_a_wire_are_solved_together() -> None:
    """X = r − y − z, y = x/2, z = 3 x + y: x = r/5."""
    parts = {
        "x": static("x", ("y", "z", "r"), x="r - y - z"),
        "y": static("y", ("x",), y="x/2"),
        "z": static("z", ("x", "y"), z="3*x + y"),
    }
    wires = {"x.y": "y.y", "x.z": "z.z", "y.x": "x.x", "z.x": "x.x", "z.y": "y.y"}
    rings = connect(parts, wires, outputs=["x.x"], name="rings")
    assert rings.inline(rings.readouts) == (sp.Symbol("r", real=True) / 5,)


def test_a_plant_that_shows_its_input_is_closed_by_a_gain() -> None:
    """y = x + u with u = 2 (r − y): u = (2 r − 2 x)/3, so x' = −x + u has the rate −5/3."""
    plant = system_from_mapping({"states": {"x": "-x + u"}, "inputs": {"u": {}}, "outputs": {"y": "x + u"}})
    law = static("gain", ("y", "r"), u="2*(r - y)")
    loop = ulna.Loop(plant=plant, controller=law)
    times = np.linspace(0, 2, 21)
    run = ulna.simulate(loop, {"x": 1.0}, times, inputs={"r": 0.0})
    assert run["x"] == pytest.approx(np.exp(-5 / 3 * times), abs=1e-9)
    assert run["u"] == pytest.approx(-2 / 3 * run["x"], abs=1e-9)
    limited = ulna.Loop(
        plant=plant, controller=law, hardware=ulna.Hardware(saturation=ulna.Saturation(lower=-1, upper=1))
    )
    with pytest.raises(SimulationError, match="an algebraic loop"):
        ulna.simulate(limited, {"x": 1.0}, times, inputs={"r": 0.0})


def test_a_ring_whose_gain_is_1_at_the_parameters_values_is_refused_by_name() -> None:
    gain = {"parameters": {"k": {"value": "-0.5"}}, "inputs": {"b": {}}, "outputs": {"a": "k*b"}}
    parts = {"one": static("one", ("a", "r"), b="-2*a + r"), "two": system_from_mapping(gain)}
    with pytest.raises(PlantError, match=r"two\.b → one\.a → two\.b .* gain of exactly 1"):
        connect(parts, {"one.a": "two.a", "two.b": "one.b"}, outputs=["one.b"], name="ring")


@pytest.mark.parametrize("bent", ["sin(b)", "min(b, 3)", "b**2", "b*abs(b)"])
def test_a_ring_that_is_not_linear_is_refused_by_name(bent: str) -> None:
    parts = {"one": static("one", ("a", "r"), b="-2*a + r"), "two": static("two", ("b",), a=bent)}
    with pytest.raises(PlantError, match=r"the algebraic loop .* is not linear"):
        connect(parts, {"one.a": "two.a", "two.b": "one.b"}, outputs=["one.b"], name="ring")


def test_equations_for_accelerations_are_solved_where_events_and_limits_are_asked_for() -> None:
    mass = {
        "definitions": {"a": {"zero": "2*a + 3*v - u"}},
        "states": {"x": "v", "v": "a"},
        "inputs": {"u": {}},
        "outputs": {"y": "x"},
    }
    plant, times = system_from_mapping(mass), np.linspace(0, 2, 5)
    free = ulna.simulate(plant, (0, 1), times, inputs={"u": 0.5})
    watched = ulna.simulate(
        plant, (0, 1), times, inputs={"u": 0.5}, events=[ulna.Crossing(name="nine", expression="a - 9")]
    )
    assert watched.states == pytest.approx(free.states, abs=1e-12)
    hardware = ulna.Hardware(saturation=ulna.Saturation(lower=-0.5, upper=0.5))
    held = ulna.simulate(ulna.Loop(plant=plant, hardware=hardware), (0, 1), times, inputs={"u": 7.0})
    assert held.states == pytest.approx(free.states, abs=1e-12)


def test_many_runs_and_limits_of_what_does_not_move_are_refused() -> None:
    law = static("law", ("a",), y="1/a")
    with pytest.raises(SimulationError, match="no states, so nothing in it moves"):
        ulna.simulate(law, (), (0.0, 1.0), inputs={"a": np.array([1.0, 2.0])})
    with pytest.raises(SimulationError, match="output y is not a finite number at 0 s"):
        ulna.simulate(law, (), (0.0, 1.0), inputs={"a": ulna.TIME})
