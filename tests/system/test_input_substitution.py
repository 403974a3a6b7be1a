"""Inputs that act through a function of theirs: the function is the input, and the law is turned back."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from ulna.base import NotAffineError
from ulna.design import state_feedback
from ulna.system import control_affine, equilibrium, substitute_input, system_from_mapping


def plant(states, inputs, point=None):
    return system_from_mapping(
        {"name": "plant", "states": states, "inputs": inputs, "outputs": {"y": "z"}, "operating_point": point or {}}
    )


def test_a_rotor_is_commanded_by_the_root_of_its_squared_speed():
    rotor = plant({"z": "w", "w": "8e-5*n**2 - 9.81"}, {"n": {"range": [0, 2000]}}, {"z": 10})
    found = substitute_input(rotor)
    (v,) = found.system.input_symbols
    assert control_affine(found.system).g[1] == sp.Rational(8, 100000)
    assert found.commands[sp.Symbol("n", real=True)] == sp.sqrt(v)
    upper = found.system.inputs[0].upper
    assert upper is not None
    assert float(upper) == 4e6
    law = found.undo(state_feedback(found.system, [-1, -2]).system)
    assert [o.name for o in law.outputs] == ["n"]
    held = (
        law.readouts[0]
        .subs({"z": 0, "w": 0})
        .subs(law.values)
        .subs({sp.Symbol("z", real=True): 10, sp.Symbol("w", real=True): 0})
    )
    assert float(held) == pytest.approx(equilibrium(rotor)["n"])
    assert float(held) == pytest.approx(math.sqrt(9.81 / 8e-5))


@pytest.mark.parametrize(
    ("entry", "signal", "expected"),
    [
        ("tan(d)", {}, sp.atan),
        ("sin(d)", {}, sp.asin),
        ("exp(d)", {}, sp.log),
        ("d**3", {"range": [0, 5]}, lambda v: v ** sp.Rational(1, 3)),
        ("d**2", {"range": [-5, 0]}, lambda v: -sp.sqrt(v)),
    ],
)
def test_the_branch_follows_from_the_range(entry, signal, expected):
    found = substitute_input(plant({"z": f"-z + {entry}"}, {"d": signal}))
    (v,) = found.system.input_symbols
    assert sp.simplify(found.commands[sp.Symbol("d", real=True)] - expected(v)) == 0


@pytest.mark.parametrize("entry", ["d**2", "d + d**2", "sin(z*d)", "sin(d) + cos(d)"])
def test_what_has_no_single_branch_or_function_is_refused(entry):
    with pytest.raises(NotAffineError, match="Declare its range"):
        substitute_input(plant({"z": f"-z + {entry}"}, {"d": {}}))


def test_the_refusal_of_a_plant_that_is_not_affine_offers_what_helps_and_nothing_else():
    with pytest.raises(NotAffineError, match=r"`ulna.substitute_input\(plant\)` makes tan\(d\) the input"):
        control_affine(plant({"z": "-z + tan(d)"}, {"d": {}}))
    with pytest.raises(NotAffineError, match="Make that input a state"):
        control_affine(plant({"z": "v*tan(d)"}, {"d": {}, "v": {}}))


def test_a_propeller_pulls_with_the_square_of_its_speed_and_its_sign():
    vehicle = plant({"z": "w", "w": "(0.02*n*abs(n) - 12*w*abs(w))/30"}, {"n": {"range": [-100, 100]}})
    found = substitute_input(vehicle)
    (v,) = found.system.input_symbols
    assert v.name == "n_squared"
    assert [found.system.inputs[0].lower, found.system.inputs[0].upper] == [-10_000, 10_000]
    back = found.commands[sp.Symbol("n", real=True)]
    assert [back.subs(v, value) for value in (-9, 0, 16)] == [-3, 0, 4]
    w = sp.Symbol("w", real=True)
    law = state_feedback(found.system, [-1, -2]).expressions[0]
    assert sp.simplify(law - (600 * w * sp.Abs(w) - 4500 * w - 3000 * sp.Symbol("z", real=True))) == 0
