"""A battery with internal resistance behind a lossless switching bridge."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.system import Parameter, Signal, System


@dataclass(frozen=True, slots=True, kw_only=True)
class Battery:
    """Open-circuit voltage in V and internal resistance in Ω.

    A lossless bridge with duty d in [−1, 1] gives the motor u = d v at the bus voltage v and draws i_b = d i, so that
    v i_b = u i and v = V − R i_b: v = (V + √(V² − 4 R u i))/2.
    """

    voltage: sp.Expr
    resistance: sp.Expr

    def __post_init__(self) -> None:
        if not (self.voltage > 0 and self.resistance >= 0):
            raise PlantError(
                "battery", f"{self.voltage} V and {self.resistance} ohm.", "Give a positive voltage, no negative ohms."
            )


def voltage_range(battery: Battery, current: float) -> tuple[float, float]:
    """(lowest, highest) motor voltage in V at a motor current in A: u = d (V − R d i) at d = −1 and d = 1."""
    voltage, drop = float(battery.voltage), float(battery.resistance) * current
    return -voltage - drop, voltage - drop


def battery_system(battery: Battery) -> System:
    """The battery as a part: inputs u and the motor's current; state the charge drawn, in C.

    Outputs: `bus_voltage` in V, `battery_power` (chemical, in W) and `battery_loss` (in its resistance, in W).
    """
    v, r = (
        Parameter(name="V_bat", unit="V", value=battery.voltage, text="open-circuit voltage"),
        Parameter(name="R_bat", unit="ohm", value=battery.resistance, text="internal resistance"),
    )
    u, i = Signal(name="u", unit="V"), Signal(name="i_motor", unit="A")
    power = u.symbol * i.symbol
    bus = (v.symbol + sp.sqrt(v.symbol**2 - 4 * r.symbol * power)) / 2
    drawn = power / bus
    return System(
        name="battery",
        states=(Signal(name="charge", unit="C", text="charge drawn from the battery"),),
        rates=(drawn,),
        inputs=(u, i),
        outputs=(
            Signal(name="bus_voltage", unit="V", text="voltage of the bus"),
            Signal(name="battery_power", unit="W", text="power out of the cells"),
            Signal(name="battery_loss", unit="W", text="loss inside the battery"),
        ),
        readouts=(bus, v.symbol * drawn, r.symbol * drawn**2),
        parameters=(v, r),
        operating_point=(("charge", sp.Integer(0)),),
    )
