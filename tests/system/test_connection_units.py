"""Wires between units: converted where the dimension is the same, refused where not, anything fits no unit."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from ulna.base import UnitError
from ulna.system import Signal, System, connect, linearise

x, u = sp.symbols("x u", real=True)
ANGLES = {"rad": sp.Integer(1), "deg": sp.pi / 180, "mrad": sp.Rational(1, 1000)}
LENGTHS = {"m": sp.Integer(1), "mm": sp.Rational(1, 1000), "km": sp.Integer(1000)}


def source(unit: str) -> System:
    """A state that is its own output."""
    signal = Signal(name="y", unit=unit)
    return System(name="source", states=(Signal(name="x"),), rates=(-x,), outputs=(signal,), readouts=(x,))


def sink(unit: str, name: str = "u") -> System:
    """An integrator of its input."""
    symbol = sp.Symbol(name, real=True)
    return System(
        name="sink", states=(Signal(name=f"z_{name}"),), rates=(symbol,), inputs=(Signal(name=name, unit=unit),)
    )


def wired(here: str, there: str) -> System:
    parts = {"a": source(here), "b": sink(there)}
    return connect(parts, {"b.u": "a.y"}, outputs=["a.y", "b.u"], name="whole")


@given(st.sampled_from([ANGLES, LENGTHS]), st.data())
def test_a_wire_of_one_dimension_converts(units: dict[str, sp.Expr], data: st.DataObject) -> None:
    here, there = (data.draw(st.sampled_from(sorted(units))) for _ in range(2))
    whole = wired(here, there)
    assert whole.inline(whole.rates)[1] == x * units[here] / units[there]
    shown = dict(zip((o.name for o in whole.outputs), whole.inline(whole.readouts), strict=True))
    assert shown == {"y": x, "u": x * units[here] / units[there]}


@pytest.mark.parametrize("units", [("rad", "m"), ("V", "A"), ("N*m", "N"), ("rad/s", "rad"), ("deg", "V"), ("1", "K")])
def test_a_wire_between_dimensions_is_refused_with_both_signals_and_units(units: tuple[str, str]) -> None:
    here, there = units
    with pytest.raises(UnitError) as caught:
        wired(here, there)
    for told in ("'a.y'", f"in {here} (", "'b.u'", f"in {there} (", "Wire signals of one dimension"):
        assert told in str(caught.value)


@pytest.mark.parametrize("units", [("", "V"), ("deg", ""), ("", ""), ("rad", "1"), ("N*m", "J"), ("V*A", "W")])
def test_a_signal_without_a_unit_and_another_name_of_the_same_unit_fit(units: tuple[str, str]) -> None:
    whole = wired(*units)
    assert whole.inline(whole.rates)[1] == x


@pytest.mark.parametrize("order", [("a", "b"), ("b", "a")])
def test_inputs_that_share_an_external_input_are_converted_to_it(order: tuple[str, str]) -> None:
    """`a` keeps the name and so the unit; `b` takes degrees."""
    parts = {"a": sink("rad"), "b": sink("deg", "v")}
    whole = connect({key: parts[key] for key in order}, {"b.v": "u"}, outputs=[], name="whole")
    assert [(s.name, s.unit) for s in whole.inputs] == [("u", "rad")]
    rates = dict(zip((s.name for s in whole.states), whole.inline(whole.rates), strict=True))
    assert rates == {"z_u": u, "z_v": 180 * u / sp.pi}
    with pytest.raises(UnitError, match=r"'u \(a.u\)' is in rad .*'b.v' in V"):
        connect({"a": sink("rad"), "b": sink("V", "v")}, {"b.v": "u"}, outputs=[], name="whole")


def test_an_external_input_has_the_unit_of_the_first_part_that_has_one() -> None:
    whole = connect({"a": sink(""), "b": sink("A", "v")}, {"a.u": "w", "b.v": "w"}, outputs=[], name="whole")
    assert [(s.name, s.unit) for s in whole.inputs] == [("w", "A")]


def test_a_loop_through_degrees_has_the_gain_of_the_loop_in_radians() -> None:
    """x' = −k y with y = x in degrees is x' = −k x when the law takes radians."""
    k = sp.Rational(3, 2)
    plant = System(
        name="plant",
        states=(Signal(name="x", unit="rad"),),
        rates=(u,),
        inputs=(Signal(name="u", unit="rad/s"),),
        outputs=(Signal(name="y", unit="deg"),),
        readouts=(180 * x / sp.pi,),
    )
    y = sp.Symbol("y", real=True)
    law = System(
        name="law",
        states=(),
        rates=(),
        inputs=(Signal(name="y", unit="rad"),),
        outputs=(Signal(name="u", unit="rad/s"),),
        readouts=(-k * y,),
    )
    loop = connect({"plant": plant, "law": law}, {"plant.u": "law.u", "law.y": "plant.y"}, outputs=[], name="loop")
    assert linearise(loop, {}).A == sp.Matrix([[-k]])
