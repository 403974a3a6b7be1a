"""The bench's arm built anew by two physics engines from its parameters, as functions that the bench's loop can run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

import mujoco
import numpy as np

# Its wheel (`pin`) lies where static checkers and package listings do not look.
pin: Any = import_module("pinocchio")

Plant = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], None]
"""f(state (θ, ω, i), input (u, load, push), numbers, out): the rates into out."""


def arm_xml(p: Mapping[str, float], *, timestep: float = 1e-3) -> str:
    """The arm for MuJoCo: a thin rod along x, a point mass at its end, a hinge about y, the rotor as armature.

    Turning by θ about y takes the end down: θ is down-positive from the horizontal. The motor's current is the state of
    an actuator whose rate a callback gives.
    """
    rod, torque = p["m1"] * p["b"] ** 2 / 12, p["eta"] * p["N"] * p["km"]
    return f"""
    <mujoco>
      <option gravity="0 0 {-p["g"]!r}" timestep="{timestep!r}" integrator="RK4"/>
      <compiler boundmass="0" boundinertia="0" inertiafromgeom="false"/>
      <worldbody>
        <body name="forearm">
          <joint name="elbow" type="hinge" axis="0 1 0" armature="{p["N"] ** 2 * p["Jm"]!r}" damping="{p["B"]!r}"/>
          <inertial pos="{p["b"] / 2!r} 0 0" mass="{p["m1"]!r}" diaginertia="1e-12 {rod!r} {rod!r}"/>
          <body name="load" pos="{p["b"]!r} 0 0">
            <inertial pos="0 0 0" mass="{p["m2"]!r}" diaginertia="1e-14 1e-14 1e-14"/>
          </body>
        </body>
      </worldbody>
      <actuator>
        <general joint="elbow" dyntype="user" gaintype="fixed" gainprm="{torque!r}" biastype="none"/>
      </actuator>
    </mujoco>"""


def current_rate(p: Mapping[str, float], voltage: float, current: float, speed: float) -> float:
    """di/dt = (u − Ra i − N kb ω)/La."""
    return (voltage - p["Ra"] * current - p["N"] * p["kb"] * speed) / p["La"]


def extra_torque(p: Mapping[str, float], current: float, speed: float) -> float:
    """N m at the joint that a gear driven back gives on top of η N km i, the rule of `BackDriven` written anew.

    With r = −P/p of the power P = N km i ω the share driven back is ((q − 1)/(q + 1))² (1 + r/√(r² + 1))/2 for
    q = r + √(r² + 1).
    """
    motor = p["N"] * p["km"] * current
    r = -motor * speed / p["P_b"]
    root = np.hypot(r, 1.0)
    share = ((r + root - 1) / (r + root + 1)) ** 2 * (1 + r / root) / 2
    return (1 / p["eta_b"] - p["eta"]) * share * motor


def mujoco_plant(p: Mapping[str, float]) -> Plant:
    """The rates with MuJoCo's accelerations; friction apart from B is left to the caller's zero."""
    model = mujoco.MjModel.from_xml_string(arm_xml(p))
    data = mujoco.MjData(model)
    load = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "load")

    def rates(state: np.ndarray, given: np.ndarray, numbers: np.ndarray, out: np.ndarray) -> None:
        del numbers
        angle, speed, current = state
        model.body_mass[load] = p["m2"] + given[1]
        data.qpos[0], data.qvel[0], data.act[0] = angle, speed, current
        data.qfrc_applied[0] = given[2] + extra_torque(p, current, speed)
        mujoco.mj_forward(model, data)
        out[0], out[1], out[2] = speed, data.qacc[0], current_rate(p, given[0], current, speed)

    return rates


def pinocchio_plant(p: Mapping[str, float]) -> Plant:
    """The rates with the accelerations of Pinocchio's articulated-body algorithm."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "elbow")
    model.gravity.linear = np.array([0.0, 0.0, -p["g"]])
    model.armature = np.array([p["N"] ** 2 * p["Jm"]])
    across = p["m1"] * p["b"] ** 2 / 12
    rod = pin.Inertia(p["m1"], np.array([p["b"] / 2, 0.0, 0.0]), np.diag([0.0, across, across]))
    data = model.createData()

    def rates(state: np.ndarray, given: np.ndarray, numbers: np.ndarray, out: np.ndarray) -> None:
        del numbers
        angle, speed, current = state
        point = pin.Inertia(p["m2"] + given[1], np.array([p["b"], 0.0, 0.0]), np.zeros((3, 3)))
        model.inertias[joint] = rod + point
        torque = p["eta"] * p["N"] * p["km"] * current - p["B"] * speed + given[2]
        torque += extra_torque(p, current, speed)
        acceleration = pin.aba(model, data, np.array([angle]), np.array([speed]), np.array([torque]))
        out[0], out[1], out[2] = speed, acceleration[0], current_rate(p, given[0], current, speed)

    return rates


def mujoco_steps(
    p: Mapping[str, float], voltage: float, start: np.ndarray, *, seconds: float, timestep: float, held: bool = False
) -> np.ndarray:
    """(N, 2) angle and current along MuJoCo's own Runge-Kutta steps at a constant voltage.

    Args:
        held: take the current's rate once a step, from its beginning, instead of inside the step: the wrong way.
    """
    model = mujoco.MjModel.from_xml_string(arm_xml(p, timestep=timestep))
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0], data.act[0] = start
    rows = []
    rate = [0.0]

    def inside(_model: object, now: mujoco.MjData, _index: int) -> float:
        return rate[0] if held else current_rate(p, voltage, now.act[0], now.qvel[0])

    mujoco.set_mjcb_act_dyn(inside)
    try:
        for _ in range(round(seconds / timestep)):
            rows.append((data.qpos[0], data.act[0]))
            rate[0] = current_rate(p, voltage, data.act[0], data.qvel[0])
            mujoco.mj_step(model, data)
        rows.append((data.qpos[0], data.act[0]))
    finally:
        mujoco.set_mjcb_act_dyn(None)
    return np.array(rows)
