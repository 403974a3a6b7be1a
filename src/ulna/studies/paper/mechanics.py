"""The formulas (1) to (17) against the plants of the catalogue, with every parameter as a symbol."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from ulna.plants import model, small_oscillation
from ulna.studies.paper.chain import X
from ulna.studies.paper.compare import Comparison, Finding, compare_formula
from ulna.studies.paper.notation import read_formula
from ulna.studies.paper.printed import Paper, Passage
from ulna.studies.paper.verdict import Judged, Shown, statement
from ulna.system import System, control_affine


def _real(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


ANGLE, RATE, ACCELERATION = _real("thetaP"), _real("dthetaP"), _real("ddthetaP")
SMALL, SMALL_RATE, SMALL_ACCELERATION = _real("theta"), _real("dtheta"), _real("ddtheta")
BAR = _real("thetabar")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Mechanics:
    """A plant with the angle and its rate in the paper's names, multiplied by its inertia.

    Attributes:
        system: the plant.
        inertia: I₀.
        torque: I₀ times the angular acceleration, in thetaP, dthetaP.
    """

    system: System
    inertia: sp.Expr
    torque: sp.Expr


def mechanics(paper: Paper) -> dict[str, Judged]:
    """Return the verdict on each formula from (1) to (17), by key of its passage."""
    arm = _mechanics(model("one_link_arm"), "J")
    forearm = _mechanics(model("forearm"), "I0")
    found = [*_forearm(paper, forearm), *_oscillation(paper, forearm), *_arm(paper, arm, forearm)]
    return {judged.passage.key: judged for judged in found}


def _mechanics(system: System, inertia: str) -> _Mechanics:
    names = dict(zip(system.state_symbols, (ANGLE, RATE, _real("ia")), strict=False))
    size = next(d.expression for d in system.definitions if d.name == inertia)
    acceleration = system.inline(system.rates)[1].xreplace(names)
    return _Mechanics(system=system, inertia=size, torque=sp.cancel(size * acceleration))


def _agrees(passage: Passage, entry: str, exact: sp.Expr, known: Mapping[sp.Symbol, sp.Expr] | None = None) -> Judged:
    """One printed formula against the exact one, what it takes from elsewhere put in."""
    text = str(passage.printed[entry])
    comparison = compare_formula(read_formula(text).xreplace(dict(known or {})), exact, text=text)
    return Judged(passage=passage, comparisons=(comparison,), shown=(Shown(value=exact),))


def _forearm(paper: Paper, plant: _Mechanics) -> list[Judged]:
    c1, c2, a1, a2 = (_real(name) for name in ("c1", "c2", "a1", "a2"))
    biceps = sp.expand(plant.torque).coeff(c2) * c2 / a2
    triceps = -sp.expand(plant.torque).coeff(c1) * c1 / a1
    printed = {
        _real(name): read_formula(str(paper.entry(key, name)))
        for key, name in (("inertia", "I0"), ("biceps_force", "F2"), ("triceps_force", "F1"))
    }
    balance = plant.inertia * ACCELERATION - plant.torque
    return [
        _agrees(paper.passage("torque_balance"), "left", balance, printed),
        _agrees(paper.passage("inertia"), "I0", plant.inertia),
        _agrees(paper.passage("biceps_force"), "F2", biceps),
        _agrees(paper.passage("triceps_force"), "F1", triceps),
        _agrees(paper.passage("triceps_velocity"), "velocity", triceps / c1),
        _agrees(paper.passage("forearm"), "left", balance, printed),
    ]


def _oscillation(paper: Paper, plant: _Mechanics) -> list[Judged]:
    split = read_formula(str(paper.entry("small_displacement", "thetaP")))
    about = small_oscillation(plant.system, {plant.system.states[0].name: BAR})
    residual = -sp.cancel(plant.inertia * about.residual)
    inertia = {_real("I0"): plant.inertia, ACCELERATION: SMALL_ACCELERATION}
    restoring = plant.inertia * (SMALL_ACCELERATION + about.damping * SMALL_RATE + about.stiffness * SMALL)
    cosine = sp.cos(split)
    series = cosine.subs(SMALL, 0) + SMALL * cosine.diff(SMALL).subs(SMALL, 0)
    expanded = paper.passage("expanded")
    both = [_agrees(expanded, name, sp.expand(residual + restoring), inertia) for name in expanded.printed]
    return [
        statement(
            paper.passage("small_displacement"), holds=split == BAR + SMALL, meaning="it defines the small displacement"
        ),
        _agrees(paper.passage("cosine_series"), "cosine", series),
        Judged(
            passage=expanded,
            comparisons=tuple(c for judged in both for c in judged.comparisons),
            shown=both[0].shown,
        ),
        _agrees(paper.passage("static_equilibrium"), "left", residual),
        _agrees(paper.passage("small_angle"), "left", restoring),
        _agrees(paper.passage("natural_frequency"), "squared", sp.factor(about.stiffness)),
    ]


def _arm(paper: Paper, arm: _Mechanics, forearm: _Mechanics) -> list[Judged]:
    view = control_affine(arm.system)
    names = dict(zip(view.x, X, strict=True))
    ia, current_rate = _real("ia"), _real("dia")
    circuit = {view.x[1]: RATE, view.x[2]: ia}
    inductance = _real("La")
    drive = sp.cancel(inductance * arm.system.inline(arm.system.rates)[2].xreplace(circuit))
    state_space = paper.passage("state_space")
    rows = [
        compare_formula(read_formula(text), exact, text=text, place=f"{name}, row {row}")
        for name, field in (("f", view.f), ("g", view.g))
        for row, (text, exact) in enumerate(zip(state_space.printed[name], field.xreplace(names), strict=True), start=1)
        if isinstance(text, str)
    ]
    numbers = paper.passage("parameters")
    values = {p.name: p.si_value for p in arm.system.parameters}
    given = [
        compare_formula(read_formula(str(text)), values[name] or sp.nan, text=str(text), place=name)
        for name, text in numbers.printed.items()
    ]
    angles = paper.passage("initial_angles")
    name = compare_formula(read_formula(str(paper.entry("back_emf_name", "constant"))), _real("kb"))
    return [
        _gear(paper, arm),
        _motor_equation(paper, arm, forearm),
        _agrees(paper.passage("armature"), "left", inductance * current_rate - drive + view.u[0], {}),
        Judged(passage=paper.passage("back_emf_name"), comparisons=(name,)),
        Judged(
            passage=state_space,
            comparisons=tuple(rows),
            shown=(Shown(value=view.f.xreplace(names), name="f"), Shown(value=view.g, name="g")),
        ),
        Judged(passage=numbers, comparisons=tuple(given)),
        _agrees(paper.passage("output"), "y", view.h[0].xreplace(names)),
        statement(angles, holds=len(angles.printed["angles"]) > 0, meaning="it says where the runs start"),
    ]


def _gear(paper: Paper, arm: _Mechanics) -> Judged:
    gear = paper.passage("gear")
    motor = arm.torque.coeff(_real("ia")) * _real("ia")
    return _agrees(gear, "torque", motor)


def _motor_equation(paper: Paper, arm: _Mechanics, forearm: _Mechanics) -> Judged:
    """(13), and how its weight stands to that of (6): equal after the angle is counted the other way round."""
    judged = _agrees(paper.passage("arm_with_motor"), "right", arm.torque)
    weight = _real("g")
    here = sp.expand(arm.torque).coeff(weight)
    there = sp.expand(forearm.torque).coeff(weight)
    flipped = -there.xreplace({ANGLE: -ANGLE})
    turned = sp.expand(here - flipped) == 0 and sp.expand(here - there) != 0
    note = Comparison(
        place="weights",
        printed=str(judged.passage.printed["right"]),
        exact=here,
        finding=Finding.STATEMENT if turned else Finding.MISPRINT,
        meaning="they stand with the other sign than in (6): from here on the angle is counted down, not up",
    )
    return Judged(passage=judged.passage, comparisons=(*judged.comparisons, note), shown=judged.shown)
