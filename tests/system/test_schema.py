from pathlib import Path

import pytest
import sympy as sp

from ulna.base import FormulaError, NotAffineError, PlantError, UnitError
from ulna.design import Poles, controller_form, state_feedback
from ulna.plants import as_plant, model, models
from ulna.system import control_affine, read_system, system_from_mapping, write_system

PENDULUM = {
    "name": "pendulum",
    "parameters": {"g": {"value": "9.8", "unit": "m/s^2"}, "l": {"value": 1, "unit": "m"}},
    "states": {
        "theta": {"unit": "rad", "equation": "omega"},
        "omega": {"unit": "rad/s", "equation": "-g/l*sin(theta) + u"},
    },
    "inputs": {"u": {"unit": "rad/s^2"}},
    "outputs": {"y": {"unit": "rad", "equation": "theta"}},
}


def changed(**sections):
    return {**PENDULUM, **sections}


def test_the_control_affine_view_is_found_by_differentiation():
    view = control_affine(system_from_mapping(PENDULUM))
    g, l, theta, omega = (sp.Symbol(n, real=True) for n in ("g", "l", "theta", "omega"))
    assert view.f == sp.Matrix([omega, -g * sp.sin(theta) / l])
    assert view.g == sp.Matrix([0, 1])
    assert view.h == sp.Matrix([theta])


@pytest.mark.parametrize("name", [entry.name for entry in models()])
@pytest.mark.parametrize("ending", ["toml", "json"])
def test_a_written_plant_reads_back_to_the_same_system(name, ending, tmp_path):
    path = tmp_path / f"plant.{ending}"
    write_system(model(name), path)
    assert read_system(path) == model(name)


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_a_static_law_is_written_and_read_but_is_no_plant(ending, tmp_path):
    arm = model("one_link_arm")
    law = state_feedback(controller_form(arm), Poles(-2, -3, -4)).system
    path = tmp_path / f"law.{ending}"
    write_system(law, path)
    assert read_system(path) == law
    with pytest.raises(PlantError, match="no states, so nothing in it moves"):
        as_plant(path)


def test_units_may_be_left_out_of_a_whole_plant():
    system = system_from_mapping({"states": {"x": "-x + 3*u"}, "inputs": {"u": {}}})
    assert system.states[0].unit == ""


def test_a_parameter_keeps_its_unit_and_has_an_si_value():
    arm = model("one_link_arm")
    inductance = next(p for p in arm.parameters if p.name == "La")
    assert inductance.value == 100
    assert inductance.si_value == sp.Rational(1, 10)


@pytest.mark.parametrize(
    ("sections", "error", "reason"),
    [
        (
            {"states": {**PENDULUM["states"], "omega": {"unit": "rad/s", "equation": "-g/l*sin(thet) + u"}}},
            FormulaError,
            "thet",
        ),
        ({"inputs": {"theta": {"unit": "V"}, "u": {"unit": "rad/s^2"}}}, PlantError, "declared in"),
        ({"states": {"theta": {"unit": "rad"}, "omega": PENDULUM["states"]["omega"]}}, PlantError, "missing"),
        ({"states": {**PENDULUM["states"], "theta": {"unit": "rad", "equation": "theta"}}}, UnitError, "rad/s"),
        ({"states": {**PENDULUM["states"], "theta": {"unit": "furlongz", "equation": "omega"}}}, UnitError, "furlongz"),
        ({"states": {**PENDULUM["states"], "theta": {"unit": "deg", "equation": "omega"}}}, PlantError, "write 'rad'"),
        ({"operating_point": {"theta": "2 m"}}, UnitError, "'m' measures length"),
        ({"definitions": {"a": "b", "b": "a"}}, PlantError, "cyclic"),
        ({"parameters": {**PENDULUM["parameters"], "g": {"value": "nan", "unit": "m/s^2"}}}, FormulaError, "nan"),
        (
            {"parameters": {**PENDULUM["parameters"], "g": {"value": float("inf"), "unit": "m/s^2"}}},
            PlantError,
            "finite",
        ),
        ({"parameters": {**PENDULUM["parameters"], "l": {"value": 0, "unit": "m"}}}, PlantError, "divides by zero"),
        (
            {"parameters": {**PENDULUM["parameters"], "l": {"value": 3, "unit": "m", "range": [0, 1]}}},
            PlantError,
            "outside",
        ),
        (
            {"parameters": {**PENDULUM["parameters"], "l": {"value": 3, "unit": "m", "range": [1, 0]}}},
            PlantError,
            "empty",
        ),
        ({"operating_point": {"phi": 0}}, PlantError, "neither a state nor an input"),
        ({"states": {"sin": "1"}, "outputs": {}}, PlantError, "function"),
        ({"states": {}, "outputs": {}}, PlantError, "neither states nor outputs"),
        ({"formt": 1}, PlantError, "unknown key 'formt'"),
        ({"format": 2}, PlantError, "format 2"),
        ({"dimensions": "maybe"}, PlantError, "dimensions = 'maybe'"),
        ({"inputs": {"u": {"units": "V"}}}, PlantError, "unknown key 'units'"),
    ],
)
def test_a_plant_that_contradicts_itself_is_refused(sections, error, reason):
    with pytest.raises(error, match=reason):
        system_from_mapping(changed(**sections))


@pytest.mark.parametrize(
    ("equation", "dimension"),
    [
        ("omega + theta", "adds"),
        ("sin(omega)", "pure number"),
        ("omega**theta", "power"),
    ],
)
def test_dimensions_are_checked_inside_formulas(equation, dimension):
    states = {**PENDULUM["states"], "theta": {"unit": "rad", "equation": equation}}
    with pytest.raises(UnitError, match=dimension):
        system_from_mapping(changed(states=states))


def test_an_input_that_enters_nonlinearly_is_refused_with_its_term():
    system = system_from_mapping({"states": {"x": "-x + 3*x*u + u**2"}, "inputs": {"u": {}}})
    with pytest.raises(NotAffineError, match=r"u\*\*2"):
        control_affine(system)


def test_an_output_that_depends_on_an_input_is_refused():
    system = system_from_mapping({"states": {"x": "-x + u"}, "inputs": {"u": {}}, "outputs": {"y": "x + u"}})
    with pytest.raises(NotAffineError, match="output 'y'"):
        control_affine(system)


def test_inputs_that_cancel_are_no_offence():
    system = system_from_mapping({"states": {"x": "(u + 1)**2 - u**2 - x"}, "inputs": {"u": {}}})
    assert control_affine(system).g == sp.Matrix([2])


def test_a_syntax_error_shows_its_line(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text('name = "x"\n[states]\nx = "-x\n')
    with pytest.raises(PlantError, match=r'Line 3: x = "-x'):
        read_system(path)


def test_a_missing_file_is_one_clear_error(tmp_path):
    with pytest.raises(PlantError, match="cannot be read"):
        read_system(tmp_path / "nowhere.toml")


def test_an_unwritable_place_leaves_nothing_behind(tmp_path):
    with pytest.raises(PlantError, match="cannot be written"):
        write_system(model("forearm"), tmp_path / "no" / "such" / "folder.toml")
    assert list(Path(tmp_path).iterdir()) == []


def test_a_parameter_without_value_stays_symbolic():
    system = system_from_mapping({"parameters": {"a": {}}, "states": {"x": "-a*x"}})
    assert system.with_values().parameters == system.parameters
    assert system.with_values({"a": 2}).rates == (-2 * sp.Symbol("x", real=True),)
    with pytest.raises(PlantError, match="no such parameter"):
        system.with_values({"b": 2})


@pytest.mark.parametrize(("levels", "refused"), [(60, True), (6, False)])
def test_definitions_that_would_grow_into_billions_of_terms_are_refused(levels: int, refused: bool) -> None:
    rows = {f"d{k + 1}": f"sin(d{k}) + cos(d{k})" for k in range(levels)}
    data = {"states": {"x": f"d{levels}"}, "definitions": {"d0": "x", **rows}}
    if refused:
        with pytest.raises(PlantError, match="definitions that it uses"):
            system_from_mapping(data)
    else:
        assert system_from_mapping(data).states


def test_an_operating_point_may_carry_units():
    point = system_from_mapping({**PENDULUM, "operating_point": {"theta": "30 deg", "omega": "60 rpm"}}).operating_point
    assert dict(point) == {"theta": sp.pi / 6, "omega": 2 * sp.pi}
