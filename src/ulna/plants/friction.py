"""Friction at a joint: Coulomb's and Stribeck's, dry (it sticks) or smooth, and LuGre's with a bristle as a state."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.system import Parameter, Signal

BRISTLE = Signal(name="bristle", unit="rad", text="mean deflection of the bristles of the joint's friction")


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Coulomb friction T_c, or Stribeck's g(ω) = T_c + (T_s − T_c) exp(−(ω/w_s)²), against the motion.

    Dry without a `speed`: g(ω) sign(ω), which holds the joint at rest (the engine's sticking). With one smooth:
    g(ω) tanh(ω/speed), for a design that needs derivatives; it creeps instead of sticking.

    Args:
        torque: T_c, N m. speed: rad/s, None for dry friction. static: T_s ≥ T_c, N m, what it takes to break away;
            stribeck: w_s, rad/s, by which that has fallen to T_c; both or none.

    Raises:
        PlantError: numbers out of range, one of static and stribeck alone.

    Reference:
        B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994), section 2.
    """

    torque: sp.Expr
    speed: sp.Expr | None = None
    static: sp.Expr | None = None
    stribeck: sp.Expr | None = None

    def __post_init__(self) -> None:
        if not (self.torque >= 0 and (self.speed is None or self.speed > 0)):
            raise PlantError("Coulomb friction", f"torque {self.torque} N m, speed {self.speed} rad/s.")
        _check_stribeck(self.torque, self.static, self.stribeck)


@dataclass(frozen=True, slots=True, kw_only=True)
class LuGre:
    """Friction of bristles z: z' = ω − stiffness |ω| z/g(ω), torque = stiffness z + damping z', g as in `Friction`.

    Presliding, stick-slip and frictional lag, without a jump: a design has its derivatives but for |ω|, and its stiff
    state (stiffness/g rad⁻¹ times the speed) wants `Implicit()` in long runs. Part of the work is stored in the
    bristles, so the account of heat holds over whole cycles.

    Args:
        torque: T_c, N m. static, stribeck: T_s, N m, and w_s, rad/s; left out T_s = T_c. stiffness: N m/rad.
        damping: N m s/rad.

    Raises:
        PlantError: numbers out of range.

    Reference:
        C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A new model for control of systems with friction",
        IEEE Transactions on Automatic Control 40 (1995).
    """

    torque: sp.Expr
    stiffness: sp.Expr
    damping: sp.Expr
    static: sp.Expr | None = None
    stribeck: sp.Expr | None = None

    def __post_init__(self) -> None:
        if not (self.torque > 0 and self.stiffness > 0 and self.damping >= 0):
            found = f"torque {self.torque} N m, stiffness {self.stiffness} N m/rad, damping {self.damping} N m s/rad."
            raise PlantError("LuGre friction", found, "Torque and stiffness are positive.")
        _check_stribeck(self.torque, self.static, self.stribeck)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionPart:
    """What friction adds to a joint: its torque, parameters, and states with their rates."""

    torque: sp.Expr
    parameters: tuple[Parameter, ...] = ()
    states: tuple[Signal, ...] = ()
    rates: tuple[sp.Expr, ...] = ()


def friction_part(friction: Friction | LuGre | None, omega: sp.Symbol) -> FrictionPart:
    """The friction of a joint that turns at omega."""
    if friction is None:
        return FrictionPart(torque=sp.Integer(0))
    torque = Parameter(name="T_c", unit="N*m", value=friction.torque, text="Coulomb friction at the joint")
    level, parameters = torque.symbol, [torque]
    if friction.static is not None:
        static = Parameter(name="T_s", unit="N*m", value=friction.static, text="friction that must be broken away")
        fall = Parameter(name="w_s", unit="rad/s", value=friction.stribeck, text="speed at which friction has fallen")
        level += (static.symbol - torque.symbol) * sp.exp(-((omega / fall.symbol) ** 2))
        parameters += [static, fall]
    if isinstance(friction, LuGre):
        stiff = Parameter(name="s_0", unit="N*m/rad", value=friction.stiffness, text="stiffness of the bristles")
        damp = Parameter(name="s_1", unit="N*m*s/rad", value=friction.damping, text="damping of the bristles")
        rate = omega - stiff.symbol * sp.Abs(omega) * BRISTLE.symbol / level
        return FrictionPart(
            torque=stiff.symbol * BRISTLE.symbol + damp.symbol * rate,
            parameters=(*parameters, stiff, damp),
            states=(BRISTLE,),
            rates=(rate,),
        )
    if friction.speed is None:
        return FrictionPart(torque=level * sp.sign(omega), parameters=tuple(parameters))
    text = "speed at which it is three quarters there"
    speed = Parameter(name="w_c", unit="rad/s", value=friction.speed, text=text)
    return FrictionPart(torque=level * sp.tanh(omega / speed.symbol), parameters=(*parameters, speed))


def _check_stribeck(torque: sp.Expr, static: sp.Expr | None, stribeck: sp.Expr | None) -> None:
    if static is None and stribeck is None:
        return
    if static is None or stribeck is None or not (static >= torque and stribeck > 0):
        raise PlantError(
            "Stribeck friction",
            f"static {static} N m above a Coulomb friction of {torque} N m, falling at {stribeck} rad/s.",
            "Give static=, not below torque=, and a positive stribeck=.",
        )
