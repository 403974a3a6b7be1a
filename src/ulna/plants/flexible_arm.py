"""A planar arm with n flexible joints: 4n states, n motors; the yardstick for large plants."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from ulna.base import PlantError
from ulna.system import Definition, Signal, System

MASS = sp.Integer(1)
LENGTH = sp.Rational(1, 2)
STIFFNESS = sp.Integer(100)
ROTOR = sp.Rational(1, 10)
INERTIA = MASS * LENGTH**2
GRAVITY = sp.Rational(981, 100)


def flexible_joint_arm(links: int) -> System:
    """An arm of n links with a point mass at each end, each joint a spring behind a motor (Spong's model).

    Angles q_i of the links count from the hanging position, motor angles p_i along the joint. The equations of the
    links stay implicit in their angular accelerations and are written joint by joint: the plant grows with n, not
    with n² (M. W. Spong, J. Dyn. Sys. Meas. Control 109 (1987); J. Y. S. Luh, M. W. Walker and R. P. C. Paul, J. Dyn.
    Sys. Meas. Control 102 (1980)).

    Args:
        links: n ≥ 1.

    Raises:
        PlantError: for n < 1.
    """
    if links < 1:
        raise PlantError("an arm with flexible joints", f"{links} links were asked for.", "Ask for one or more.")
    q, w, p, r, u = (_symbols(stem, links) for stem in "qwpru")
    acceleration = _symbols("acc", links)
    twist, torque = _symbols("twist", links), _symbols("torque", links)
    springs = [
        *(Definition(name=t.name, expression=p[i] - (q[i] - (q[i - 1] if i else 0))) for i, t in enumerate(twist)),
        *(Definition(name=t.name, expression=STIFFNESS / INERTIA * twist[i]) for i, t in enumerate(torque)),
    ]
    pull = [torque[i] - (torque[i + 1] if i + 1 < links else 0) for i in range(links)]
    states = [
        ("q", "angle of link", q),
        ("w", "rate of link", w),
        ("p", "angle of motor", p),
        ("r", "rate of motor", r),
    ]
    return System(
        name=f"planar arm with {links} flexible joints",
        source="Spong, J. Dyn. Sys. Meas. Control 109 (1987)",
        states=tuple(Signal(name=s.name, text=f"{text} {k + 1}") for _, text, row in states for k, s in enumerate(row)),
        rates=(*w, *acceleration, *r, *((u[i] - STIFFNESS * twist[i]) / ROTOR for i in range(links))),
        inputs=tuple(Signal(name=s.name, text=f"torque of motor {k + 1}") for k, s in enumerate(u)),
        outputs=tuple(Signal(name=f"y{k + 1}", text=f"angle of link {k + 1}") for k in range(links)),
        readouts=tuple(q),
        definitions=(*springs, *_links(q, w, acceleration, pull)),
        operating_point=tuple((s.name, sp.Integer(0)) for _, _, row in states for s in row),
    )


def _symbols(stem: str, count: int) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(f"{stem}{k + 1}", real=True) for k in range(count))


def _links(
    q: Sequence[sp.Symbol], w: Sequence[sp.Symbol], acceleration: Sequence[sp.Symbol], pull: Sequence[sp.Expr]
) -> list[Definition]:
    """The balance of moments of every link, implicit in the accelerations, and what it is written with.

    Lengths are counted in links and masses in point masses: `ax`, `ay` are the accelerations of the points, from the
    base outwards, seen from a frame in free fall; `fx`, `fy` the forces that the links carry, from the tip inwards.
    """
    definitions: list[Definition] = []

    def named(name: str, expression: sp.Expr) -> sp.Symbol:
        definitions.append(Definition(name=name, expression=expression))
        return definitions[-1].symbol

    moving: list[tuple[sp.Expr, sp.Expr]] = []
    before: tuple[sp.Expr, sp.Expr] = (sp.Integer(0), GRAVITY / LENGTH)
    for k, (angle, rate, speedup) in enumerate(zip(q, w, acceleration, strict=True)):
        across, along = sp.sin(angle), sp.cos(angle)  # the link is the vector (across, −along)
        before = (
            named(f"ax{k + 1}", before[0] + speedup * along - rate**2 * across),
            named(f"ay{k + 1}", before[1] + speedup * across + rate**2 * along),
        )
        moving.append(before)
    force: tuple[sp.Expr, sp.Expr] = (sp.Integer(0), sp.Integer(0))
    balances = []
    for k in reversed(range(len(q))):
        force = (named(f"fx{k + 1}", force[0] + moving[k][0]), named(f"fy{k + 1}", force[1] + moving[k][1]))
        moment = sp.sin(q[k]) * force[1] + sp.cos(q[k]) * force[0]
        balances.append(
            Definition(name=acceleration[k].name, expression=pull[k] - named(f"moment{k + 1}", moment), implicit=True)
        )
    return [*definitions, *reversed(balances)]
