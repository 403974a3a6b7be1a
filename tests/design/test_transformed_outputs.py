"""Observer forms of plants with several outputs after a transformation of each output."""

from __future__ import annotations

import sympy as sp

from ulna.base import Status
from ulna.design.observers.observer_coordinates import ObserverFormSearch, find_observer_form
from ulna.design.observers.transformed_output import output_transformation
from ulna.geometry import lie_derivative
from ulna.symbolic.exact import are_zero
from ulna.system import System, system_from_mapping

Y1, Y2 = sp.symbols("y1 y2", real=True)


def plant(states: dict[str, str], outputs: dict[str, str], inputs: str = "", **point: object) -> System:
    data = {"name": "plant", "states": states, "outputs": outputs, "inputs": {u: {} for u in inputs.split()}}
    return system_from_mapping(data | ({"operating_point": point} if point else {}))


def obeys(found: ObserverFormSearch) -> bool:
    """Whether z = T(x) moves as the form says, by differentiation in the plant's own coordinates."""
    form = found.form
    assert form is not None
    view = form.view
    at = dict(zip(form.y, view.h, strict=True))
    z = form.map.forward
    slopes = z.jacobian(list(view.x))
    rates = slopes * (view.f + view.g * sp.Matrix(len(view.u), 1, list(view.u)))
    due = form.A * z + form.injection.xreplace(at)
    measured = form.C * z - sp.Matrix(form.measured).xreplace(at)
    return slopes.rank() == len(view.x) and are_zero([*(rates - due), *measured]).holds


def test_a_plain_form_needs_the_identity_only() -> None:
    found = output_transformation(plant({"x1": "x2", "x2": "-sin(x1)", "x3": "-x3 + x1"}, {"y1": "x1", "y2": "x3"}))
    assert found.verdict.holds
    assert found.functions == (Y1, Y2)


def test_two_preys_need_two_logarithms() -> None:
    rates = {"a": "a*(1 - b)", "b": "b*(a - 1)", "c": "c*(1 - d)", "d": "d*(c - 1) + a"}
    found = output_transformation(plant(rates, {"y1": "a", "y2": "c"}, a=1, b=1, c=1, d=1))
    assert found.functions == (sp.log(Y1), sp.log(Y2))
    assert obeys(found)


def test_the_output_of_the_longer_block_alone_is_transformed_and_inputs_stay() -> None:
    rates = {"x1": "x2", "x2": "x2**2 - x1 + x3*u", "x3": "-x3 + x1 + u"}
    system = plant(rates, {"y1": "x1", "y2": "x3"}, "u")
    assert find_observer_form(system).verdict.fails
    found = output_transformation(system)
    assert found.verdict.holds
    assert found.functions is not None
    assert found.functions[1] == Y2
    assert are_zero([sp.diff(found.functions[0], Y1, 2) + sp.diff(found.functions[0], Y1)]).holds
    assert obeys(found)


def test_outputs_that_are_no_states_are_transformed() -> None:
    rates = {"x1": "x1*(x2 + x3)", "x2": "x1 - x3", "x3": "x4", "x4": "-sin(x3)"}
    found = output_transformation(plant(rates, {"y1": "2*x1", "y2": "x3"}, x1=1))
    assert found.functions is not None
    assert are_zero([sp.diff(found.functions[0], Y1) * Y1 - sp.diff(found.functions[0], Y1).subs(Y1, 1)]).holds
    assert obeys(found)


def test_a_block_of_three_is_transformed() -> None:
    """z1' = y2, z2' = z1, z3' = z2 with z3 = log(y1), and a block of one."""
    rates = {"x1": "x1*x2", "x2": "x3", "x3": "x4*x1", "x4": "-x4"}
    found = output_transformation(plant(rates, {"y1": "x1", "y2": "x4"}, x1=1))
    assert found.functions is not None
    assert found.functions[0] == sp.log(Y1)
    assert obeys(found)


def test_a_cube_of_a_velocity_is_refused_for_every_transformation() -> None:
    found = output_transformation(plant({"x1": "x2", "x2": "x2**3 - x1", "x3": "-x3 + x1"}, {"y1": "x1", "y2": "x3"}))
    assert found.verdict.fails
    assert found.verdict.evidence["any_psi"]
    x2 = sp.Symbol("x2", real=True)
    assert found.verdict.evidence["function"].free_symbols == {x2}


def test_a_slope_that_hangs_on_the_other_output_has_curvature_and_is_refused() -> None:
    rates = {"x1": "x2", "x2": "x2**2*x3", "x3": "x4", "x4": "0"}
    found = output_transformation(plant(rates, {"y1": "x1", "y2": "x3"}))
    assert found.verdict.fails
    assert found.verdict.evidence["curvature"] != 0


def test_outputs_that_would_have_to_be_mixed_are_left_undecided() -> None:
    """Outputs x1 and x3 + x1² of two double integrators: flat, but only a mixture is linear."""
    rates = {"x1": "x2", "x2": "-x1", "x3": "x4", "x4": "2*x2**2"}
    found = output_transformation(plant(rates, {"y1": "x1", "y2": "x3"}))
    assert found.verdict.status is Status.UNDECIDED
    assert "mixing" in found.verdict.evidence


def test_an_input_that_breaks_the_form_in_every_output_function_is_refused() -> None:
    rates = {"x1": "x2", "x2": "x2**2 + x4*u", "x3": "x4", "x4": "-x3"}
    system = plant(rates, {"y1": "x1", "y2": "x3"}, "u")
    found = output_transformation(system)
    assert found.verdict.fails
    # Without the input the form exists: the input alone is to blame.
    free = plant({**rates, "x2": "x2**2"}, {"y1": "x1", "y2": "x3"})
    good = output_transformation(free)
    assert obeys(good)
    assert good.form is not None
    view = good.form.view
    assert are_zero([lie_derivative(good.form.map.forward[0], view.f, view.x)]).holds


def test_a_motor_with_measured_currents_is_refused_by_two_points_with_the_same_outputs() -> None:
    rates = {
        "pa": "-5*pa - w*pb + ia/2",
        "pb": "-5*pb + w*pa + ib/2",
        "ia": "-50*ia + 100*pa + 20*w*pb + ua",
        "ib": "-50*ib + 100*pb - 20*w*pa + ub",
        "w": "0",
    }
    found = output_transformation(plant(rates, {"y1": "ia", "y2": "ib"}, "ua ub", pa=1, w=1))
    assert found.verdict.fails
    first, second = found.verdict.evidence["points"]
    ia, ib = sp.symbols("ia ib", real=True)
    assert (first[ia], first[ib]) == (second[ia], second[ib])
    assert found.verdict.evidence["any_psi"]
