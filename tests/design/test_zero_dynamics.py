"""Zero dynamics and their class for plants of many kinds; input-output and normal forms, their refusals."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp
from output_plants import PLANTS, UNICYCLE, plant

from ulna.base import Status, UlnaError
from ulna.design.forms.input_output import input_output_form
from ulna.design.forms.normal_coordinates import normal_form
from ulna.design.internal.output_zeroing import ZeroDynamics, zero_dynamics
from ulna.design.internal.phase import minimum_phase
from ulna.geometry import lie_derivative
from ulna.symbolic.exact import is_zero
from ulna.system import control_affine, system_from_mapping


def stays(found: ZeroDynamics) -> bool:
    """Whether the inputs found keep the outputs and the manifold, and the rates are the plant's on it."""
    assert found.system is not None
    view = control_affine(found.plant)
    closed = (view.f + view.g * sp.Matrix([found.inputs[u] for u in view.u])).xreplace(dict(found.manifold))
    zeta = found.system.state_symbols
    field = sp.Matrix(len(zeta), 1, found.system.rates)
    place = {x: k for k, x in enumerate(view.x)}
    held = [h.xreplace(dict(found.manifold)) - y for h, y in zip(view.h, found.set_point, strict=True)]
    moved = [closed[place[x]] - lie_derivative(e, field, zeta) for x, e in found.manifold.items()]
    rates = [closed[place[z]] - r for z, r in zip(zeta, found.system.rates, strict=True)]
    return all(is_zero(e).holds for e in [*held, *moved, *rates])


@pytest.mark.parametrize("name", PLANTS)
def test_zero_dynamics_keep_the_output_and_have_the_known_class(name: str) -> None:
    arguments, dimension, stability = PLANTS[name]
    found = zero_dynamics(plant(*arguments))
    assert found.verdict.status is Status.PROVED
    assert found.dimension == dimension
    assert stays(found)
    assert minimum_phase(found).stability == stability


def test_operating_point_sets_the_output_where_the_plant_rests() -> None:
    tanks = plant({"a": "-sqrt(a) + u", "b": "sqrt(a) - sqrt(b)"}, ["u"], ["a"], {"a": 4, "b": 4})
    assert zero_dynamics(tanks).set_point == (4,)
    assert zero_dynamics(tanks, set_point=[sp.Integer(9)]).manifold == {sp.Symbol("a", real=True): 9}


def test_output_that_cannot_be_held_is_not_accepted() -> None:
    found = zero_dynamics(plant({"x": "u"}, ["u"], ["exp(x)"]), set_point=[sp.Integer(-1)])
    assert not found.verdict.holds
    assert found.system is None


def test_inputs_that_the_outputs_do_not_determine_are_refuted_with_the_rank() -> None:
    found = zero_dynamics(plant(*UNICYCLE))
    assert found.verdict.fails
    assert found.verdict.evidence["rank"] == 1
    assert minimum_phase(found).verdict.status is Status.UNDECIDED


def test_zero_dynamics_without_output_are_undecided() -> None:
    assert zero_dynamics(plant({"x": "u"}, ["u"], [])).verdict.status is Status.UNDECIDED


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (({"x": "u"}, ["u"], []), "no outputs"),
        (({"x": "-x"}, [], ["x"]), "no inputs"),
        (({"x": "u", "y": "x"}, ["u"], ["x", "y"]), "2 outputs and 1 inputs"),
        (({"x": "-x", "y": "u"}, ["u"], ["x"]), "no input ever reaches"),
        (UNICYCLE, "singular everywhere"),
    ],
)
def test_form_that_does_not_exist_says_why(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(UlnaError, match=message) as caught:
        input_output_form(plant(*arguments))
    assert caught.value.value is not None


def test_singularity_at_a_point_is_told_and_refused_when_asked_for() -> None:
    x1, x2 = sp.symbols("x1 x2", real=True)
    system = plant({"x1": "x2", "x2": "x1*u"}, ["u"], ["x1"])
    form = input_output_form(system)
    assert form.at_point.fails
    assert form.singular == x1
    assert input_output_form(system, at={x1: sp.Integer(1), x2: sp.Integer(0)}).at_point.holds
    with pytest.raises(UlnaError, match="singular at the point"):
        input_output_form(system, at={x1: sp.Integer(0), x2: sp.Integer(0)})


def test_chains_are_coordinates_only_where_they_are_the_whole_state() -> None:
    whole = input_output_form(plant({"x1": "x2", "x2": "-sin(x1) + u"}, ["u"], ["x1"]))
    assert whole.internal_dimension == 0
    assert whole.map.forward == whole.chain
    part = input_output_form(plant({"x1": "x2 + u", "x2": "-x2"}, ["u"], ["x1"]))
    assert part.internal_dimension == 1
    with pytest.raises(UlnaError, match="1 of 2. Use `normal_form`"):
        part.map.forward  # noqa: B018


def test_law_is_a_system_of_the_states_and_the_new_inputs() -> None:
    law = input_output_form(plant({"x1": "x2", "x2": "-sin(x1) + u"}, ["u"], ["x1"])).law
    assert [s.name for s in law.inputs] == ["x1", "x2", "v"]
    assert [s.name for s in law.outputs] == ["u"]


def test_internal_coordinates_are_free_of_the_input() -> None:
    cart = plant(*PLANTS["cart_pendulum_cart_up"][0])
    found = normal_form(cart)
    view = control_affine(cart)
    assert found.input_free.status is Status.PROVED
    assert all(is_zero(lie_derivative(h, view.g[:, 0], view.x)).holds for h in found.internal)
    assert len(found.coordinates) == 4


def test_input_fields_that_are_not_involutive_refute_input_free_coordinates() -> None:
    # [g1, g2] leaves the span, so that no function of the third state is constant along both.
    system = plant({"x1": "u1", "x2": "u2", "x3": "x1*u2 - x3"}, ["u1", "u2"], ["x1", "x2"])
    found = normal_form(system)
    assert found.input_free.fails
    assert len(found.coordinates) == 3
    assert any(e != 0 for e in found.slopes)


def test_an_output_that_cannot_be_zero_is_held_where_the_point_has_it() -> None:
    system = system_from_mapping(
        {
            "format": 1,
            "name": "reactor with a jacket, not at rest",
            "parameters": {"k": 5, "a": 3},
            "states": {"c": "1 - c - k*exp(-a/T)*c", "T": "1 - T + k*exp(-a/T)*c + u"},
            "inputs": {"u": {}},
            "outputs": {"y": "T"},
            "operating_point": {"c": 0.5, "T": 1.2},
        }
    )
    found = zero_dynamics(system)
    assert found.verdict.holds
    assert found.set_point == (sp.Rational(6, 5),)
    assert minimum_phase(found).stability == "exponential"


@pytest.mark.parametrize("output", ["cos(x1)", "x1*sin(x1)"])
def test_an_output_flat_at_the_point_is_held_by_staying_there(output: str) -> None:
    system = system_from_mapping(
        {
            "format": 1,
            "name": "pendulum",
            "states": {"x1": "x2", "x2": "u - sin(x1)"},
            "inputs": {"u": {}},
            "outputs": {"y": output},
        }
    )
    found = zero_dynamics(system)
    assert found.verdict.holds
    assert set(found.manifold.values()) == {0}
    assert found.dimension == 0
