"""The arm with its drive, put together from parts, and the account of its energy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import PlantError
from ulna.plants.arm import OMEGA, Brake, Forearm, SelfLocking, link_system, rod
from ulna.plants.battery import battery_system
from ulna.plants.drive import BackDriven, gear_system, motor_system
from ulna.plants.drive_preset import Preset
from ulna.plants.friction import Friction, LuGre
from ulna.plants.statics import require_liftable
from ulna.plants.thermal import heating_system
from ulna.system import Signal, System, connect


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenArm:
    """An arm with its drive, and where its power goes.

    d stored/dt = source − Σ losses holds identically along every motion.

    Attributes:
        system: states theta, omega, i, then those of heating and battery; input u (and `brake`), output y.
        stored: energy in J of motion, height and inductance; source: power in W out of the battery, or into the motor.
        losses: power in W by name: winding, gear (negative where torque and back-EMF constants disagree), friction,
            battery.
    """

    preset: Preset
    system: System
    stored: sp.Expr
    source: sp.Expr
    losses: Mapping[str, sp.Expr]


def arm_with_drive(
    preset: Preset,
    *,
    forearm: Forearm | None = None,
    friction: Friction | LuGre | None = None,
    back_driven: BackDriven | None = None,
    brake: Brake | SelfLocking | None = None,
    with_heating: bool = False,
    with_battery: bool = False,
) -> System:
    """The arm with its drive as a system; see `driven_arm` for the arguments and the errors."""
    return driven_arm(
        preset,
        forearm=forearm,
        friction=friction,
        back_driven=back_driven,
        brake=brake,
        with_heating=with_heating,
        with_battery=with_battery,
    ).system


def driven_arm(
    preset: Preset,
    *,
    forearm: Forearm | None = None,
    friction: Friction | LuGre | None = None,
    back_driven: BackDriven | None = None,
    brake: Brake | SelfLocking | None = None,
    with_heating: bool = False,
    with_battery: bool = False,
) -> DrivenArm:
    """The arm with its drive and the account of its energy.

    (J + N² Jm) ω' = G cos θ − B ω − friction − brake + e N km i,  La i' = u − Ra i − N kb ω.

    Args:
        preset: numbers; its parameters stay symbolic in the system.
        forearm: the link; left out, the rod of the preset.
        friction: at the joint, dry, smooth or LuGre's; back_driven: what the gear loses when driven; brake: what
            holds the joint without current.
        with_heating: two temperatures as further states, the resistance following the winding's.
        with_battery: the charge as a further state. The input u stays the motor's voltage; what the battery allows it
            to be is `voltage_range`.

    Raises:
        PlantError: if the drive cannot lift the load of the preset (the torque margin is named), or data for heating
            or battery are asked for and missing.
    """
    link = forearm or rod(preset)
    require_liftable(preset, forearm=link)
    heated = with_heating and _present(preset, "heating")
    fed = with_battery and _present(preset, "battery")
    parts = {
        "link": link_system(preset, link, friction, brake),
        "motor": motor_system(preset, heated=heated),
        "gear": gear_system(preset, back_driven),
    }
    wires = {
        "link.torque": "gear.joint_torque",
        "motor.shaft": "gear.shaft_speed",
        "gear.tau": "motor.motor_torque",
        "gear.speed": f"link.{OMEGA.name}",
    }
    shown = ["link.y", "link.friction_loss", "link.mechanical_energy", "gear.joint_power"]
    shown += [f"motor.{n}" for n in ("copper_loss", "electric_power", "induced_power", "magnetic_energy")]
    if isinstance(brake, SelfLocking):
        wires["link.current"] = "motor.i"
    if heated and preset.heating is not None:
        parts["heating"] = heating_system(preset.heating)
        wires |= {"heating.loss": "motor.copper_loss", "motor.rise": "heating.T_w"}
    if fed and preset.battery is not None:
        parts["battery"] = battery_system(preset.battery)
        wires["battery.i_motor"] = "motor.i"
        shown += ["battery.battery_power", "battery.battery_loss"]
    whole = connect(parts, wires, outputs=shown, name=f"arm with drive, {preset.name}", text=preset.text)
    return _account(preset, replace(whole, source=preset.source))


def with_meters(arm: DrivenArm) -> System:
    """The arm with a state `E_<name>` in J for the source and each loss, which start at 0.

    A further output `stored_energy`; along every motion stored − stored(0) = E_source − Σ E_losses.
    """
    system = arm.system
    metered = {"source": arm.source, **arm.losses}
    return replace(
        system,
        states=(*system.states, *(Signal(name=f"E_{n}", unit="J", text=f"energy, {n}") for n in metered)),
        rates=(*system.inline(system.rates), *metered.values()),
        outputs=(*system.outputs, Signal(name="stored_energy", unit="J", text="energy of motion, height, inductance")),
        readouts=(*system.inline(system.readouts), arm.stored),
        definitions=(),
        operating_point=(*system.operating_point, *((f"E_{n}", sp.Integer(0)) for n in metered)),
    )


def _account(preset: Preset, whole: System) -> DrivenArm:
    watched = dict(zip((o.name for o in whole.outputs), whole.inline(whole.readouts), strict=True))
    losses = {
        "winding": watched["copper_loss"],
        "gear": watched["induced_power"] - watched["joint_power"],
        "friction": watched["friction_loss"],
    }
    if "battery_loss" in watched:
        losses["battery"] = watched["battery_loss"]
    return DrivenArm(
        preset=preset,
        system=replace(whole, outputs=whole.outputs[:1], readouts=whole.readouts[:1]),
        stored=watched["mechanical_energy"] + watched["magnetic_energy"],
        source=watched.get("battery_power", watched["electric_power"]),
        losses=losses,
    )


def _present(preset: Preset, what: str) -> bool:
    if getattr(preset, what) is None:
        raise PlantError(f"{what} of preset '{preset.name}'", "it has no such data.", f"Add [{preset.name}.{what}].")
    return True
