"""Friction of a joint: it sticks, breaks away, falls with speed, and LuGre's bristles agree at rest and at speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from ulna.base import PlantError
from ulna.plants import Friction, LuGre, arm_with_drive, preset
from ulna.plants.friction import friction_part
from ulna.sim import simulate

R = sp.Rational
STRIBECK: dict[str, Any] = {"torque": R(1, 5), "static": R(3, 10), "stribeck": R(1, 10)}
OMEGA = sp.Symbol("omega", real=True)


def _torque(friction: Friction | LuGre, speed: float) -> float:
    """At a constant speed, bristles at rest."""
    part = friction_part(friction, OMEGA)
    values: dict[Any, Any] = {p.symbol: p.value for p in part.parameters} | {OMEGA: speed}
    for state, rate in zip(part.states, part.rates, strict=True):
        values[state.symbol] = sp.solve(rate.subs(values), state.symbol)[0]
    return float(part.torque.subs(values))


@pytest.mark.parametrize("speed", [-2.0, -0.05, 0.02, 0.3])
def test_all_forms_agree_at_a_constant_speed_with_stribecks_curve(speed: float) -> None:
    due = np.sign(speed) * (0.2 + 0.1 * np.exp(-((speed / 0.1) ** 2)))
    assert _torque(Friction(**STRIBECK), speed) == pytest.approx(due)
    assert _torque(Friction(speed=R(1, 10**4), **STRIBECK), speed) == pytest.approx(due)
    assert _torque(LuGre(stiffness=sp.Integer(500), damping=sp.Integer(1), **STRIBECK), speed) == pytest.approx(due)
    assert _torque(Friction(torque=R(1, 5)), speed) == pytest.approx(0.2 * np.sign(speed))


def test_a_hanging_arm_with_dry_friction_stops_off_the_vertical_and_stays() -> None:
    arm = arm_with_drive(preset("bench_servo"), friction=Friction(torque=R(1, 50), static=R(1, 40), stribeck=R(1, 5)))
    run = simulate(arm, [1.2, 0.0, 0.0], np.linspace(0, 3, 61))
    assert run["omega"][-1] == 0.0
    assert run["theta"][-1] == run["theta"][-5]
    assert abs(run["theta"][-1] - np.pi / 2) > 1e-4
    assert any(mode.held for mode in run.modes)


def test_lugre_sticks_to_the_stiffness_of_its_bristles() -> None:
    stiff = LuGre(torque=R(1, 2), stiffness=sp.Integer(100), damping=sp.Integer(1))
    arm = arm_with_drive(preset("bench_servo"), friction=stiff)
    assert [s.name for s in arm.states] == ["theta", "omega", "bristle", "i"]
    run = simulate(arm, [1.4, 0.0, 0.0, 0.0], np.linspace(0, 3, 31))
    weight = float(next(d.expression for d in arm.definitions if d.name == "G").subs(arm.values))
    assert run["theta"][-1] == pytest.approx(1.4 + weight * np.cos(1.4) / 100, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (Friction, {"torque": R(-1)}),
        (Friction, {"torque": R(1), "static": R(1, 2), "stribeck": R(1)}),
        (Friction, {"torque": R(1), "static": R(2)}),
        (LuGre, {"torque": R(1), "stiffness": R(0), "damping": R(1)}),
    ],
)
def test_friction_out_of_range_is_refused(kind: Any, given: dict[str, Any]) -> None:
    with pytest.raises(PlantError, match="friction"):
        kind(**given)
