"""The arm with its drive: equal to the paper's plant, energy conserved, brakes hold, bad input refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

from ulna.base import PlantError
from ulna.plants import (
    BackDriven,
    Brake,
    DrivenArm,
    Friction,
    SelfLocking,
    anthropometric_forearm,
    arm_with_drive,
    driven_arm,
    measured_forearm,
    model,
    preset,
    steady_rise,
    thermal_current,
    with_meters,
)
from ulna.sim import TIME, simulate
from ulna.system import control_affine

FRICTION = Friction(torque=sp.Rational(1, 10), speed=sp.Rational(1, 20))


def back_driven(name: str) -> BackDriven:
    """Equal loss of torque both ways."""
    return BackDriven(efficiency=2 - 1 / preset(name).value("eta"), power=sp.Rational(1, 10))


def imbalance(arm: DrivenArm, volts: sp.Expr, seconds: float) -> tuple[float, float]:
    """Largest error of the energy balance along a run, and the largest energy in it."""
    system = with_meters(arm)
    start = np.zeros(len(system.states))
    start[0] = 0.4
    run = simulate(system, start, np.linspace(0, seconds, 101), inputs={"u": volts})
    lost = np.sum([run[f"E_{name}"] for name in arm.losses], axis=0)
    error = run["stored_energy"] - run["stored_energy"][0] - run["E_source"] + lost
    return float(np.abs(error).max()), float(np.abs(run["E_source"]).max() + np.abs(lost).max())


def test_the_preset_paper_is_the_plant_of_the_paper_exactly() -> None:
    ours, theirs = arm_with_drive(preset("paper")).with_values(), model("one_link_arm").with_values()
    assert [s.name for s in ours.states] == [s.name for s in theirs.states]
    assert all(sp.expand(a - b) == 0 for a, b in zip(ours.rates, theirs.rates, strict=True))


@pytest.mark.parametrize("name", ["bench_servo", "transhumeral_elbow", "human_scale"])
def test_energy_of_drive_arm_and_battery_balances(name: str) -> None:
    arm = driven_arm(
        preset(name), friction=FRICTION, back_driven=back_driven(name), with_heating=True, with_battery=True
    )
    error, scale = imbalance(arm, -1 + 3 * sp.sin(6 * TIME), 2.0)
    assert scale > 0.1
    assert error < 1e-8


def test_energy_balances_without_battery_and_a_missing_loss_would_be_seen() -> None:
    arm = driven_arm(preset("paper"))
    volts = -15 + 4 * sp.sin(3 * TIME)
    assert imbalance(arm, volts, 2.0)[0] < 1e-8 * max(1.0, imbalance(arm, volts, 2.0)[1])
    forgetful = DrivenArm(
        preset=arm.preset, system=arm.system, stored=arm.stored, source=arm.source, losses={"gear": arm.losses["gear"]}
    )
    assert imbalance(forgetful, volts, 2.0)[0] > 1.0


def test_the_gear_loses_energy_whichever_side_drives() -> None:
    arm = driven_arm(preset("transhumeral_elbow"), back_driven=back_driven("transhumeral_elbow"))
    values = {**arm.system.values}
    omega, i = sp.Symbol("omega", real=True), sp.Symbol("i", real=True)
    loss = sp.lambdify((omega, i), arm.losses["gear"].subs(values))
    currents, speeds = np.meshgrid(np.linspace(-4, 4, 41), np.linspace(-3, 3, 41))
    assert (loss(speeds, currents) >= -0.15 * 0.1).all()  # the smooth form's allowance below 0.1 W
    assert (loss(speeds, currents)[np.abs(speeds * currents) > 0.2] > 0).all()
    torque = 100 * 0.0398
    assert loss(2.0, 3.0) == pytest.approx(0.25 * torque * 6, rel=2e-2)  # the motor drives: 1 - eta
    assert loss(-2.0, 3.0) == pytest.approx((1.5 - 1) * torque * 6, rel=2e-2)  # driven back: 1/eta_b - 1
    joint = arm.system.inline(arm.system.rates)[1].subs({**values, sp.Symbol("theta", real=True): 0})
    at_rest = joint.subs({omega: 0, i: 2}) - joint.subs({omega: 0, i: 0})
    plain = arm_with_drive(preset("transhumeral_elbow")).with_values().rates[1]
    assert sp.simplify(at_rest - (plain.subs({i: 2}) - plain.subs({i: 0})).subs({omega: 0})) == 0


def test_the_winding_warms_to_the_steady_rise_and_its_resistance_follows() -> None:
    arm = arm_with_drive(preset("human_scale"), with_heating=True)
    heating = preset("human_scale").heating
    assert heating is not None
    rise = sp.Symbol("T_w", real=True)
    i = sp.Symbol("i", real=True)
    rates = arm.with_values().rates
    final = steady_rise(heating, 0.316, 4.0)
    housing = final * 4.7 / (1.9 + 4.7)
    point = {i: 4, rise: final, sp.Symbol("T_h", real=True): housing}
    assert [float(r.subs(point)) for r in rates[3:]] == pytest.approx([0, 0], abs=1e-12)
    assert steady_rise(heating, 0.316, thermal_current(heating, 0.316)) == pytest.approx(130)
    assert steady_rise(heating, 0.316, 100.0) == math.inf


def test_an_engaged_brake_holds_the_load_without_current_and_a_free_one_does_not() -> None:
    brake = Brake(torque=sp.Integer(8), creep=sp.Rational(1, 1000))
    arm = arm_with_drive(preset("transhumeral_elbow"), brake=brake)
    held = simulate(arm, [0.0, 0.0, 0.0], 2.0, inputs={"brake": 1.0})
    assert abs(held.final_state[0]) < 2e-3
    free = simulate(arm, [0.0, 0.0, 0.0], 2.0, inputs={"brake": 0.0})
    assert free.final_state[0] > 0.1


def test_a_self_locking_gear_holds_until_current_releases_it() -> None:
    locking = SelfLocking(torque=sp.Integer(8), creep=sp.Rational(1, 1000), release=sp.Rational(1, 5))
    arm = arm_with_drive(preset("transhumeral_elbow"), brake=locking)
    assert abs(simulate(arm, [0.0, 0.0, 0.0], 2.0).final_state[0]) < 2e-3
    assert simulate(arm, [0.0, 0.0, 0.0], 1.0, inputs={"u": -6.0}).final_state[0] < -0.3


def test_forearms_of_rod_measurement_and_body_agree_where_they_should() -> None:
    man = preset("human_scale")
    values = {**arm_with_drive(man).values}
    body = anthropometric_forearm(75)
    moment = float(body.moment.subs({p.symbol: p.value for p in body.parameters}))
    inertia = float(body.inertia.subs({p.symbol: p.value for p in body.parameters}))
    m1, b, g = (values[sp.Symbol(n, real=True)] for n in ("m1", "b", "g"))
    assert moment == pytest.approx(float(m1 * g * b / 2), rel=2e-3)
    assert float(m1 * b**2 / 3) / inertia == pytest.approx(0.88, abs=5e-3)  # "its inertia is 12 % low"
    same = measured_forearm(inertia=m1 * b**2 / 3, moment=m1 * g * b / 2)
    first = arm_with_drive(man, forearm=same).with_values().rates[1]
    assert sp.simplify(first - arm_with_drive(man).with_values().rates[1]) == 0


def test_without_battery_and_switches_the_arm_is_affine_in_its_voltage() -> None:
    arm = arm_with_drive(preset("human_scale"), friction=FRICTION, with_heating=True)
    assert control_affine(arm).g.cols == 1


@pytest.mark.parametrize("mass", [0, -70, float("nan"), "heavy"])
def test_a_body_mass_that_is_not_positive_is_refused(mass: object) -> None:
    with pytest.raises(PlantError, match="body mass"):
        anthropometric_forearm(mass)


def test_heating_or_battery_without_data_is_refused() -> None:
    with pytest.raises(PlantError, match="no such data"):
        arm_with_drive(preset("paper"), with_battery=True)
    with pytest.raises(PlantError, match="efficiency"):
        BackDriven(efficiency=sp.Integer(0), power=sp.Integer(1))
    with pytest.raises(PlantError, match="must be positive"):
        measured_forearm(inertia=0, moment=1)
