"""A planar arm with n flexible joints: 4n states, n motors; the yardstick for large plants."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

from ulna.base import PlantError
from ulna.system.signal import Definition, Signal
from ulna.system.system import System

MASS = sp.Integer(1)
LENGTH = sp.Rational(1, 2)
STIFFNESS = sp.Integer(100)
ROTOR = sp.Rational(1, 10)
GRAVITY = sp.Rational(981, 100)


def flexible_joint_arm(links: int) -> System:
    """An arm of n links with a point mass at each end, each joint a spring behind a motor (Spong's model).

    Angles q_i of the links count from the hanging position, motor angles p_i along the joint. The equations come from
    `sympy.physics.mechanics`; the mass matrix is factored, M = L D Lᵀ, step by step in definitions, so that the
    plant stays a short program however many links there are (M. W. Spong, J. Dyn. Sys. Meas. Control 109 (1987)).

    Args:
        links: n ≥ 1.

    Raises:
        PlantError: for n < 1.
    """
    if links < 1:
        raise PlantError("an arm with flexible joints", f"{links} links were asked for.", "Ask for one or more.")
    q, w, p, r, u = (_symbols(stem, links) for stem in "qwpru")
    mass, force = _equations(q, w)
    torque = [STIFFNESS * (p[i] - (q[i] - (q[i - 1] if i else 0))) for i in range(links)]
    pull = [force[i] + torque[i] - (torque[i + 1] if i + 1 < links else 0) for i in range(links)]
    definitions, acceleration = _factored_solve(mass, pull)
    states = [
        ("q", "angle of link", q),
        ("w", "rate of link", w),
        ("p", "angle of motor", p),
        ("r", "rate of motor", r),
    ]
    motor = [(u[i] - torque[i]) / ROTOR for i in range(links)]
    return System(
        name=f"planar arm with {links} flexible joints",
        source="Spong, J. Dyn. Sys. Meas. Control 109 (1987); equations by sympy.physics.mechanics",
        states=tuple(Signal(name=s.name, text=f"{text} {k + 1}") for _, text, row in states for k, s in enumerate(row)),
        rates=(*w, *acceleration, *r, *motor),
        inputs=tuple(Signal(name=s.name, text=f"torque of motor {k + 1}") for k, s in enumerate(u)),
        outputs=tuple(Signal(name=f"y{k + 1}", text=f"angle of link {k + 1}") for k in range(links)),
        readouts=tuple(q),
        definitions=definitions,
        operating_point=tuple((s.name, sp.Integer(0)) for _, _, row in states for s in row),
    )


def _symbols(stem: str, count: int) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(f"{stem}{k + 1}", real=True) for k in range(count))


def _equations(q: Sequence[sp.Symbol], w: Sequence[sp.Symbol]) -> tuple[sp.Matrix, list[sp.Expr]]:
    """Mass matrix and generalised forces of the links, M w' = force, by Kane's method in absolute angles."""
    angles, speeds = dynamicsymbols(f"a1:{len(q) + 1}"), dynamicsymbols(f"s1:{len(q) + 1}")
    ground, pivot = ReferenceFrame("N"), Point("O")
    pivot.set_vel(ground, 0)
    bodies, loads, last = [], [], pivot
    for k, (angle, speed) in enumerate(zip(angles, speeds, strict=True)):
        frame = ground.orientnew(f"A{k}", "Axis", [angle, ground.z])
        frame.set_ang_vel(ground, speed * ground.z)
        tip = last.locatenew(f"P{k}", -LENGTH * frame.y)
        tip.v2pt_theory(last, ground, frame)
        bodies.append(Particle(f"m{k}", tip, MASS))
        loads.append((tip, -MASS * GRAVITY * ground.y))
        last = tip
    kinematic = [angle.diff() - speed for angle, speed in zip(angles, speeds, strict=True)]
    kane = KanesMethod(ground, q_ind=angles, u_ind=speeds, kd_eqs=kinematic)
    kane.kanes_equations(bodies, loads)
    plain = {**dict(zip(angles, q, strict=True)), **dict(zip(speeds, w, strict=True))}
    mass = kane.mass_matrix.applyfunc(lambda e: sp.factor_terms(sp.expand(e.xreplace(plain))))
    return mass, [_by_direction(e.xreplace(plain), angle) for e, angle in zip(kane.forcing, q, strict=True)]


def _by_direction(force: sp.Expr, angle: sp.Symbol) -> sp.Expr:
    """The force with the sine and cosine of its own angle in front: few products, whatever the number of links."""
    return sp.collect(sp.expand(force), [sp.sin(angle), sp.cos(angle)])


def _factored_solve(mass: sp.Matrix, pull: Sequence[sp.Expr]) -> tuple[tuple[Definition, ...], list[sp.Expr]]:
    """The solution of M a = pull by M = L D Lᵀ, every intermediate value a definition."""
    n = mass.rows
    definitions: list[Definition] = []

    def named(name: str, expression: sp.Expr) -> sp.Expr:
        if expression.is_Atom:
            return expression
        definitions.append(Definition(name=name, expression=expression))
        return definitions[-1].symbol

    lower = [[sp.Integer(0)] * n for _ in range(n)]
    scaled = [[sp.Integer(0)] * n for _ in range(n)]
    diagonal: list[sp.Expr] = []
    for i in range(n):
        for j in range(i):
            inner = sum((scaled[i][k] * lower[j][k] for k in range(j)), sp.Integer(0))
            scaled[i][j] = named(f"V{i + 1}_{j + 1}", mass[i, j] - inner)
            lower[i][j] = named(f"L{i + 1}_{j + 1}", scaled[i][j] / diagonal[j])
        own = sum((scaled[i][k] * lower[i][k] for k in range(i)), sp.Integer(0))
        diagonal.append(named(f"D{i + 1}", mass[i, i] - own))
    forward: list[sp.Expr] = []
    for i in range(n):
        inner = sum((lower[i][k] * forward[k] for k in range(i)), sp.Integer(0))
        forward.append(named(f"b{i + 1}", pull[i] - inner))
    solution = [sp.Integer(0)] * n
    for i in reversed(range(n)):
        inner = sum((lower[k][i] * solution[k] for k in range(i + 1, n)), sp.Integer(0))
        solution[i] = named(f"acc{i + 1}", forward[i] / diagonal[i] - inner)
    return tuple(definitions), solution
