"""A sampled run says where its fixed steps go to and fro about dry friction, and nothing where they do not."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.loop import Hardware, Loop
from ulna.sim import simulate
from ulna.system import Signal, System

x, v, u = sp.symbols("x v u", real=True)


@pytest.mark.parametrize(("start", "says"), [(1.0, True), (9.0, False)])
def test_fixed_steps_about_dry_friction_are_told_of(start: float, says: bool) -> None:
    block = System(
        name="block",
        states=(Signal(name="x"), Signal(name="v")),
        rates=(v, u - sp.sign(v)),
        inputs=(Signal(name="u"),),
        outputs=(Signal(name="x"),),
        readouts=(x,),
    )
    push = System(
        name="push",
        states=(),
        rates=(),
        inputs=(Signal(name="x"),),
        outputs=(Signal(name="u"),),
        readouts=(sp.Float(0.5) + 0 * x,),
    )
    loop = Loop(plant=block, controller=push, hardware=Hardware(period=1e-2))
    run = simulate(loop, [0.0, start], 5.0)
    assert bool(run.note) is says
    if says:
        # It comes to rest at 2 s, and is within two steps of that a little before.
        assert run.note.startswith("v = 0 holds the plant from about t = 1.97 s on")
