"""The battery: its bus sags while power is drawn and rises while power comes back; the motor's range follows."""

from __future__ import annotations

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from ulna.base import PlantError
from ulna.plants import Battery, battery_system, voltage_range

PACK = Battery(voltage=sp.Rational(148, 10), resistance=sp.Rational(1, 10))
amperes = st.floats(-30, 30)


def at(voltage: float, current: float) -> dict[str, float]:
    """The battery's outputs, and its current as `drawn`, with a motor voltage and current."""
    system = battery_system(PACK).with_values()
    values = {sp.Symbol("u", real=True): voltage, sp.Symbol("i_motor", real=True): current}
    found = {o.name: float(e.subs(values)) for o, e in zip(system.outputs, system.readouts, strict=True)}
    return {**found, "drawn": float(system.rates[0].subs(values))}


@given(st.floats(-10, 10), amperes)
def test_power_is_kept_and_the_bus_sags_by_resistance_times_current(voltage: float, current: float) -> None:
    found = at(voltage, current)
    assert found["bus_voltage"] == pytest.approx(14.8 - 0.1 * found["drawn"])
    assert found["bus_voltage"] * found["drawn"] == pytest.approx(voltage * current, abs=1e-9)
    assert found["battery_power"] - found["battery_loss"] == pytest.approx(voltage * current, abs=1e-9)
    assert found["battery_loss"] >= 0


@pytest.mark.parametrize(("voltage", "current"), [(10.0, 8.0), (-10.0, -8.0)])
def test_driving_lowers_the_bus_and_braking_raises_it(voltage: float, current: float) -> None:
    assert at(voltage, current)["bus_voltage"] < 14.8 < at(voltage, -current)["bus_voltage"]


@given(amperes)
def test_the_ends_of_the_range_are_the_bus_voltages_there(current: float) -> None:
    """At full duty d = ±1 the motor sees d times the bus, which is what `battery_system` says at that voltage."""
    lower, upper = voltage_range(PACK, current)
    assert at(upper, current)["bus_voltage"] == pytest.approx(upper)
    assert at(lower, current)["bus_voltage"] == pytest.approx(-lower)


def test_a_current_that_drives_forwards_lowers_both_ends() -> None:
    assert voltage_range(PACK, 0.0) == (-14.8, 14.8)
    assert voltage_range(PACK, 20.0) == pytest.approx((-16.8, 12.8))
    assert voltage_range(PACK, -20.0) == pytest.approx((-12.8, 16.8))


def test_a_battery_that_cannot_be_is_refused() -> None:
    with pytest.raises(PlantError, match="no negative ohms"):
        Battery(voltage=sp.Integer(12), resistance=sp.Integer(-1))
