"""Common practice: proportional voltage, a velocity servo, a PID with gravity compensation, as systems."""

from __future__ import annotations

import sympy as sp

from ulna.studies.prosthesis.contender import Contender, Tuned
from ulna.system import Parameter, Signal, System

VISUAL_DELAY = 0.2
"""s between seeing an error and acting on it (choice; simple visual reactions take 0.18 to 0.25 s)."""
DIFFERENTIATOR = 0.008
"""s, time constant of the filtered derivative of the encoder's angle (choice)."""


def proportional_voltage() -> Contender:
    """The voltage is proportional to the user's command: speed-controlled, as most prostheses are.

    The user sees the error after `VISUAL_DELAY` (two lags in a row), knows the wanted speed, and commands
    v = y_ref' + p s + q ∫s; u = (N kb) v, the voltage of that speed without load, up to the full supply. A practised
    user begins with the command that holds the nominal arm.
    """
    user = _user(_s("u_max") * _s("c6") / _s("c4"))
    return Contender(
        key="proportional_voltage",
        title="proportional voltage",
        note="voltage in proportion to the user's command; the user closes the loop by eye, 0.2 s late",
        controller=_system(
            "proportional voltage", user["states"], user["rates"], _s("c4") / _s("c6") * user["command"]
        ),
        tuned=(
            Tuned(name="user_p", start=2.0, lower=0.2, upper=12.0),
            Tuned(name="user_i", start=2.0, lower=0.1, upper=30.0),
        ),
        proposed=False,
    )


def velocity_servo() -> Contender:
    """The same user; a servo keeps the commanded speed: u = (N kb) v + p (v − ω̂) + q ∫(v − ω̂), ω̂ a filtered derivative.

    The user commands no more than v_max; the servo's integral begins where the nominal arm is held and stops at the
    voltage limit by back-calculation.
    """
    user = _user(_s("v_max"))
    lag, y, total = _s("servo_lag"), _s("y"), _s("servo_sum")
    speed = (y - lag) / _s("T_d")
    error = user["command"] - speed
    wanted = _s("c4") / _s("c6") * user["command"] + _s("servo_p") * error + _s("servo_i") * total
    rates = {
        "servo_lag": speed,
        "servo_sum": error + (_limited(wanted, _s("u_max")) - wanted) / _s("servo_p"),
    }
    return Contender(
        key="velocity_servo",
        title="velocity servo",
        note="a PI servo on the speed follows the command of the user, who closes the loop by eye, 0.2 s late",
        controller=_system("velocity servo", (*user["states"], *rates), {**user["rates"], **rates}, wanted),
        tuned=(
            Tuned(name="user_p", start=3.0, lower=0.2, upper=12.0),
            Tuned(name="user_i", start=1.0, lower=0.01, upper=30.0),
            Tuned(name="servo_p", start=2.0, lower=0.001, upper=100.0),
            Tuned(name="servo_i", start=20.0, lower=0.1, upper=2000.0),
        ),
        proposed=False,
    )


def pid() -> Contender:
    """PID on the angle with the nominal gravity and back-EMF fed forward, back-calculation at the voltage limit."""
    y, lag, total = _s("y"), _s("pid_lag"), _s("pid_sum")
    speed = (y - lag) / _s("T_d")
    error = _s("y_ref") - y
    gravity = -_s("c1") * _s("c5") / (_s("c3") * _s("c6")) * sp.cos(y)
    forward = gravity + _s("c4") / _s("c6") * _s("y_ref_d1")
    wanted = forward + _s("pid_p") * error + _s("pid_d") * (_s("y_ref_d1") - speed) + _s("pid_i") * total
    rates = {"pid_lag": speed, "pid_sum": error + (_limited(wanted, _s("u_max")) - wanted) / _s("pid_p")}
    return Contender(
        key="pid",
        title="PID with gravity compensation",
        note="position PID on the encoder with the nominal gravity and back-EMF fed forward, anti-windup",
        controller=_system("PID", tuple(rates), rates, wanted),
        tuned=(
            Tuned(name="pid_p", start=30.0, lower=0.5, upper=3000.0),
            Tuned(name="pid_i", start=60.0, lower=0.5, upper=20000.0),
            Tuned(name="pid_d", start=2.0, lower=0.001, upper=100.0),
        ),
        proposed=False,
    )


def _user(fastest: sp.Expr) -> dict:
    """The person: two lags of the seen error, its integral, and the speed asked for, limited to the fastest."""
    seen, late, total = _s("seen"), _s("late"), _s("user_sum")
    free = _s("y_ref_d1") + _s("user_p") * late + _s("user_i") * total
    command = _limited(free, fastest)
    rates = {
        "seen": (_s("y_ref") - _s("y") - seen) / (_s("T_see") / 2),
        "late": (seen - late) / (_s("T_see") / 2),
        "user_sum": late + (command - free) / _s("user_p"),
    }
    return {"states": tuple(rates), "rates": rates, "command": command}


def _limited(value: sp.Expr, bound: sp.Expr) -> sp.Expr:
    return sp.Max(sp.Min(value, bound), -bound)


def _system(name: str, states: tuple[str, ...], rates: dict[str, sp.Expr], command: sp.Expr) -> System:
    used = set(command.free_symbols).union(*(rate.free_symbols for rate in rates.values()))
    inputs = ("y", "y_ref", "y_ref_d1", "y_ref_d2", "y_ref_d3")
    known = {*inputs, *states}
    return System(
        name=name,
        states=tuple(Signal(name=state) for state in states),
        rates=tuple(rates[state] for state in states),
        inputs=tuple(Signal(name=entry) for entry in inputs if _s(entry) in used),
        outputs=(Signal(name="u", unit="V", text="armature voltage"),),
        readouts=(command,),
        parameters=tuple(Parameter(name=n) for n in sorted(str(s) for s in used if str(s) not in known)),
    )


def _s(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)
