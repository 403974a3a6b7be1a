"""Observer forms: known answers, plants disguised on purpose, and plants that have none."""

from __future__ import annotations

from dataclasses import replace

import pytest
import sympy as sp
from observer_plants import MEASURED, Y, disguised, random_disguise

from ulna.base import NoFormError
from ulna.design.observers.bracket_conditions import observer_conditions
from ulna.design.observers.linear_error_form import ObserverForm, check_observer_form
from ulna.design.observers.observer_coordinates import find_observer_form, observer_form
from ulna.design.observers.refutation_at_points import refutation_at_a_point
from ulna.design.observers.transformed_output import output_transformation, transformed_observer_form
from ulna.geometry import observability
from ulna.symbolic.exact import are_zero
from ulna.system import System, read_system, system_from_mapping

ARM = "src/ulna/plants/data/one_link_arm.toml"
X1, X2, X3, X4 = sp.symbols("x1:5", real=True)


def plant(
    states: dict[str, str], outputs: dict[str, str], inputs: str = "", parameters: str = "", **more: object
) -> System:
    sections = {"inputs": {u: {} for u in inputs.split()}, "parameters": {p: {} for p in parameters.split()}}
    return system_from_mapping({"name": "plant", "states": states, "outputs": outputs} | sections | more)


LOTKA_VOLTERRA = plant(
    {"x1": "x1*(a - b*x2)", "x2": "x2*(-c + d*x1)"},
    {"y": "x1"},
    parameters="a b c d",
    operating_point={"x1": 1, "x2": 1},
)
SERIES_MOTOR = plant(
    {"x1": "-(R/L)*x1 - (K/L)*x1*x2 + u/L", "x2": "(K/J)*x1**2 - (B/J)*x2"},
    {"y": "x1"},
    "u",
    "R L K J B",
    operating_point={"x1": 1, "x2": 1},
)
CHUA = plant(
    {"x1": "al*(x2 - x1 - (m1*x1 + m3*x1**3))", "x2": "x1 - x2 + x3", "x3": "-be*x2"},
    {"y": "x3"},
    parameters="al be m1 m3",
)
BRACKETS = plant(
    {"x1": "(x2 - 1)**2 + 1/x3", "x2": "x1 + 7", "x3": "-x3**2*(x2 - 1)"},
    {"y": "x2"},
    operating_point={"x1": 0, "x2": 0, "x3": 1},
)
TWO_OUTPUTS = plant(
    {
        "x1": "x2*exp(x3)",
        "x2": "-x2*(x4 - x1) + x1*x3*exp(-x3) + exp(-x3)*u",
        "x3": "x4 - x1",
        "x4": "x2*exp(x3) - x3**3 + x1*u",
    },
    {"y1": "x1", "y2": "x3"},
    "u",
)


def verified(form: ObserverForm) -> bool:
    return check_observer_form(form).holds


def test_the_papers_arm_takes_the_form_of_its_equation_48() -> None:
    form = observer_form(read_system(ARM).with_values())
    y, u = sp.Symbol("y", real=True), sp.Symbol("u", real=True)
    assert form.starting_fields[0] == sp.Matrix([0, 0, sp.Rational(51, 100)])
    assert form.jacobian[:, 1] == sp.Matrix([0, 1, -sp.Rational(51, 10)])
    due = [
        sp.Rational(5880, 17) * sp.cos(y) + 1000 * u / 51,
        sp.Rational(588, 17) * sp.cos(y) - 1000 * y / 51,
        -10 * y,
    ]
    assert are_zero([a - b for a, b in zip(form.injection, due, strict=True)]).holds


def test_start_field_chain_and_coordinates_of_a_published_example() -> None:
    conditions = observer_conditions(BRACKETS)
    assert [list(field) for field in conditions.fields] == [[0, 0, -(X3**2)], [1, 0, 0], [0, 1, 0]]
    form = observer_form(BRACKETS)
    assert list(form.map.forward) == [1 / X3, X1, X2]
    assert are_zero([a - b for a, b in zip(form.injection, [Y - 1, (Y - 1) ** 2, 7], strict=True)]).holds


def test_a_form_in_free_parameters() -> None:
    joint = plant(
        {"x1": "x2", "x2": "-(m/I)*sin(x1) - (k/I)*(x1 - x3)", "x3": "x4", "x4": "(k/J)*(x1 - x3) + u/J"},
        {"y": "x1"},
        "u",
        "m I k J",
    )
    form = observer_form(joint)
    assert form.indices == (4,)
    assert verified(form)


def test_two_outputs_give_two_blocks() -> None:
    form = observer_form(TWO_OUTPUTS)
    assert form.indices == (2, 2)
    assert are_zero([a - b for a, b in zip(form.map.forward, [X2 * sp.exp(X3), X1, X4 - X1, X3], strict=True)]).holds
    assert verified(form)


def test_blocks_of_unequal_size() -> None:
    # z = (x1 + x2 x3, x2, x3): block (z1, z2) of y1 = x2, block z3 of y2 = x3.
    x1 = "y1*y2 + u - (x1 + x2*x3 + x2**2)*x3 - x2*(sin(x3) + x2)".replace("y1", "x2").replace("y2", "x3")
    form = observer_form(
        plant({"x1": x1, "x2": "x1 + x2*x3 + x2**2", "x3": "sin(x3) + x2"}, {"y1": "x2", "y2": "x3"}, "u")
    )
    assert form.indices == (2, 1)
    assert verified(form)


def test_outputs_that_must_be_combined() -> None:
    # y2' holds y1'': the last coordinate of the second block is a combination of the outputs.
    form = observer_form(
        plant({"x1": "x2", "x2": "-sin(x1) + x3*u", "x3": "x2 + x1*x3"}, {"y1": "x1", "y2": "x3"}, "u")
    )
    assert sorted(form.indices) == [1, 2]
    assert verified(form)


@pytest.mark.parametrize(
    "seed", [2, 3, 4, 8, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 1, 5, 6, 7, 9, 10))]
)
def test_disguised_forms_are_found(seed: int) -> None:
    assert verified(observer_form(random_disguise(seed)))


@pytest.mark.parametrize("seed", [104, *(pytest.param(k, marks=pytest.mark.slow) for k in (100, 101, 102, 103))])
def test_disguised_forms_with_bent_outputs_are_found(seed: int) -> None:
    assert verified(observer_form(random_disguise(seed, bent=True)))


@pytest.mark.parametrize("name", MEASURED)
@pytest.mark.parametrize("seed", [8, pytest.param(7, marks=pytest.mark.slow)])
def test_output_transformations_are_found(name: str, seed: int) -> None:
    system = random_disguise(seed, transformed=name)
    form = transformed_observer_form(system)
    assert verified(form)
    # ψ is unique up to scale and a constant: ψ''/ψ' must agree.
    due, found = MEASURED[name](Y), form.measured[0]
    ratio = sp.diff(due, Y, 2) / sp.diff(due, Y) - sp.diff(found, Y, 2) / sp.diff(found, Y)
    assert are_zero([ratio]).holds


def test_lotka_volterra_needs_the_logarithm() -> None:
    assert find_observer_form(LOTKA_VOLTERRA).verdict.fails
    found = output_transformation(LOTKA_VOLTERRA)
    assert found.functions == (sp.log(Y),)
    a, b, c, d = sp.symbols("a b c d", real=True)
    assert found.form is not None
    z = [-b * X2 + c * sp.log(X1) - d * X1, sp.log(X1)]
    assert are_zero([p - q for p, q in zip(found.form.map.forward, z, strict=True)]).holds
    injection = [a * c - a * d * Y, a - c * sp.log(Y) + d * Y]
    assert are_zero([p - q for p, q in zip(found.form.injection, injection, strict=True)]).holds


def test_series_motor_keeps_its_input_through_the_logarithm() -> None:
    found = output_transformation(SERIES_MOTOR)
    assert found.functions == (sp.log(Y),)
    assert found.form is not None
    assert verified(found.form)


def test_chua_from_its_third_state_has_no_form_under_any_transformation() -> None:
    assert find_observer_form(CHUA).verdict.fails
    found = output_transformation(CHUA)
    assert found.verdict.fails
    assert found.functions is None


def test_only_the_input_condition_fails() -> None:
    z1, z2 = X1 + X2**2, X2
    good = disguised([z1, z2], z2, Y, [sp.sin(Y), Y], [[Y, sp.Integer(1)]])
    assert find_observer_form(good).verdict.holds
    # The same drift, an input that enters through z1.
    rates = {s.name: str(r) for s, r in zip(good.states, good.rates, strict=True)}
    bad = plant({"x1": rates["x1"] + " + x1*u2", "x2": rates["x2"]}, {"y": "x2"}, "u1 u2", "p")
    conditions = observer_conditions(bad)
    assert conditions.commuting.holds
    assert conditions.inputs.fails
    assert conditions.inputs.evidence["input"] == "u2"
    assert output_transformation(bad).verdict.fails


@pytest.mark.parametrize(
    ("states", "why"),
    [
        ({"x1": "-x1", "x2": "-2*x2"}, "rank"),
        ({"x1": "x2", "x2": "x2**3 - x1"}, "bracket"),
        ({"x1": "x2", "x2": "exp(x2)"}, "bracket"),
        ({"x1": "x2", "x2": "x3", "x3": "x3**2"}, "bracket"),
        ({"x1": "x2", "x2": "x3 + x2**2*x1", "x3": "x2*x3"}, "bracket"),
    ],
)
def test_a_no_names_what_fails(states: dict[str, str], why: str) -> None:
    system = plant(states, {"y": "x1"})
    search = find_observer_form(system)
    assert search.verdict.fails
    assert why in search.verdict.evidence
    with pytest.raises(NoFormError, match=why) as raised:
        observer_form(system)
    assert raised.value.value is search
    assert raised.value.hint


@pytest.mark.parametrize("row", range(3))
def test_the_check_refuses_wrong_answers(row: int) -> None:
    form = observer_form(BRACKETS)
    y = form.y[0]

    def judged(T: sp.MatrixBase, a: sp.MatrixBase) -> bool:
        changed = replace(form.map, forward=sp.ImmutableDenseMatrix(T))
        return check_observer_form(replace(form, map=changed, drift_injection=sp.ImmutableDenseMatrix(a))).holds

    assert judged(form.map.forward, form.drift_injection)
    bent = sp.Matrix(form.map.forward)
    bent[row] += X1 * X2
    assert not judged(bent, form.drift_injection)
    wrong = sp.Matrix(form.drift_injection)
    wrong[row] += y / 1000
    assert not judged(form.map.forward, wrong)
    stray = sp.Matrix(form.drift_injection)
    stray[row] += X1
    assert not judged(form.map.forward, stray)


def test_the_check_refuses_dependent_coordinates() -> None:
    form = observer_form(plant({"x1": "x2", "x2": "0"}, {"y": "x1"}))
    assert verified(form)
    verdict = check_observer_form(replace(form, map=replace(form.map, forward=sp.ImmutableDenseMatrix([X1, X1]))))
    assert verdict.evidence["reason"] == "the coordinates are dependent"


def test_a_plant_too_large_for_brackets_is_refuted_at_a_point() -> None:
    ball_and_beam = plant(
        {"x1": "x2", "x2": "B*(x1*x4**2 - G*sin(x3))", "x3": "x4", "x4": "u"}, {"y": "x1"}, "u", "B G"
    )
    verdict = refutation_at_a_point(observability(ball_and_beam))
    assert verdict.fails
    assert verdict.evidence["any_psi"]
    assert output_transformation(ball_and_beam).verdict.fails


@pytest.mark.parametrize("system", [BRACKETS, random_disguise(4), random_disguise(8, transformed="exp")])
def test_a_point_never_refutes_what_has_a_form(system: System) -> None:
    verdict = refutation_at_a_point(observability(system))
    assert not (verdict.fails and verdict.evidence["any_psi"])
    assert output_transformation(system).verdict.holds


@pytest.mark.parametrize(("measured", "point"), [("sin(x2)", 0), ("sqrt(x2)", 1), ("cos(x2)", 1)])
def test_an_output_with_branches_is_transformed_back_on_the_branch_of_the_point(measured, point) -> None:
    system = system_from_mapping(
        {
            "format": 1,
            "name": "integrators behind a sensor",
            "states": {"x1": f"u - {measured}", "x2": "x1"},
            "inputs": {"u": {}},
            "outputs": {"y": measured},
            "operating_point": {"x1": 0, "x2": point},
        }
    )
    assert find_observer_form(system).verdict.fails
    found = output_transformation(system)
    assert found.verdict.holds
    assert found.form is not None
    x1, x2 = system.state_symbols
    shown = found.form.map.forward
    assert shown.free_symbols == {x1, x2}
    assert not shown.has(sp.sin, sp.cos, sp.Abs)
    assert shown[1].diff(x2).is_number
