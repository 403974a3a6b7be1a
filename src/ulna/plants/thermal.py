"""Motor heating: winding and housing as two nodes, and the current that can flow continuously."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import sympy as sp

from ulna.base import PlantError
from ulna.system import Parameter, Signal, System


@dataclass(frozen=True, slots=True, kw_only=True)
class Heating:
    """Two-node thermal model; temperatures are rises above the surroundings, which are at the data sheet's 25 °C.

    C_w T_w' = P − (T_w − T_h)/R_wh,  C_h T_h' = (T_w − T_h)/R_wh − T_h/R_ha,  R(T_w) = Ra (1 + α T_w).

    Attributes:
        winding_to_housing, housing_to_ambient: thermal resistances R_wh, R_ha in K/W.
        winding_capacity, housing_capacity: C_w, C_h in J/K.
        copper: α in 1/K.
        limit: largest rise of the winding in K.
    """

    winding_to_housing: sp.Expr
    housing_to_ambient: sp.Expr
    winding_capacity: sp.Expr
    housing_capacity: sp.Expr
    copper: sp.Expr
    limit: sp.Expr

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not value > 0 and not (field.name == "copper" and value == 0):
                raise PlantError(f"heating, {field.name.replace('_', ' ')}", f"it is {value}.", "It must be positive.")


def heating_system(heating: Heating) -> System:
    """The two nodes as a part: input the loss in the winding in W, outputs both rises in K."""
    r_wh = Parameter(name="R_wh", unit="K/W", value=heating.winding_to_housing)
    r_ha = Parameter(name="R_ha", unit="K/W", value=heating.housing_to_ambient)
    c_w = Parameter(name="C_w", unit="J/K", value=heating.winding_capacity)
    c_h = Parameter(name="C_h", unit="J/K", value=heating.housing_capacity)
    winding = Signal(name="T_w", unit="K", text="rise of the winding above the surroundings")
    housing = Signal(name="T_h", unit="K", text="rise of the housing above the surroundings")
    loss = Signal(name="loss", unit="W", text="heat put into the winding")
    across = (winding.symbol - housing.symbol) / r_wh.symbol
    return System(
        name="motor heating",
        states=(winding, housing),
        rates=((loss.symbol - across) / c_w.symbol, (across - housing.symbol / r_ha.symbol) / c_h.symbol),
        inputs=(loss,),
        outputs=(winding, housing),
        readouts=(winding.symbol, housing.symbol),
        parameters=(r_wh, r_ha, c_w, c_h),
        operating_point=(("T_w", sp.Integer(0)), ("T_h", sp.Integer(0))),
    )


def steady_rise(heating: Heating, resistance: float, current: float) -> float:
    """Final rise of the winding in K at a constant current in A; infinite where the warming runs away.

    T = R_th Ra I² (1 + α T), R_th = R_wh + R_ha.
    """
    cold = float(heating.winding_to_housing + heating.housing_to_ambient) * resistance * current**2
    left = 1.0 - float(heating.copper) * cold
    return cold / left if left > 0 else math.inf


def thermal_current(heating: Heating, resistance: float) -> float:
    """The current in A that brings the winding to its limit in the end: I² = T/(R_th Ra (1 + α T))."""
    limit = float(heating.limit)
    through = float(heating.winding_to_housing + heating.housing_to_ambient)
    return math.sqrt(limit / (through * resistance * (1.0 + float(heating.copper) * limit)))
