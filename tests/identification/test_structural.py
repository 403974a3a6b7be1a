"""What the question is refused for, what spoils an answer, motions and starts, the command."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pytest
import sympy as sp
from typer.testing import CliRunner

import ulna
from ulna.cli.main import app
from ulna.identification import Extent, IdentificationError, Motion, identifiability
from ulna.identification.structural.input_output import input_output
from ulna.identification.structural.recovery import recovered
from ulna.identification.structural.scalings import scalings
from ulna.system import System, system_from_mapping

A, B, C = sp.symbols("a b c", real=True)


def _plant(rates: dict[str, str], outputs: dict[str, str], parameters: Sequence[str], u: bool = False) -> System:
    return system_from_mapping(
        {
            "format": 1,
            "name": "plant",
            "parameters": {name: {} for name in parameters},
            "states": {x: {"equation": e} for x, e in rates.items()},
            "inputs": {"u": {}} if u else {},
            "outputs": outputs,
        }
    )


def test_the_flagship_arm_tells_its_parameters_in_combinations_only() -> None:
    arm = ulna.model("one_link_arm")
    found = ulna.identifiability(arm, ["m1", "m2", "N", "km", "kb"])
    assert {answer.extent for answer in found.parameters.values()} == {Extent.NOT}
    assert "N*kb" in {str(c.expression) for c in found.combinations}
    assert found.combinations_complete
    assert found.verdict.fails
    alone = ulna.identifiability(arm, ["m2", "Ra", "km"])
    assert alone.verdict.holds
    assert "m2: globally (proved)" in repr(alone)


def test_rotor_and_load_inertia_are_told_as_their_sum() -> None:
    plant = _plant({"w": "(u - B*w)/(J + 100*Jm)"}, {"y": "w"}, ["J", "Jm", "B"], u=True)
    found = identifiability(plant, ["J", "Jm", "B"])
    assert found.parameters["B"].extent is Extent.GLOBALLY
    [together] = found.combinations
    ratio = sp.simplify(
        together.expression.diff(sp.Symbol("Jm", real=True)) / together.expression.diff(sp.Symbol("J", real=True))
    )
    assert ratio == 100


def test_a_sum_inside_a_function_is_found_without_input_output_equations() -> None:
    plant = _plant({"x": "-sin((a + 2*b)*x) + u"}, {"y": "x"}, ["a", "b"], u=True)
    found = identifiability(plant, ["a", "b"])
    assert [str(c.expression) for c in found.combinations] == ["a + 2*b"]


def test_which_motion_of_the_input_a_parameter_needs() -> None:
    tank = _plant({"x": "-k*x + u"}, {"y": "x/V"}, ["k", "V"], u=True)
    answers = identifiability(tank, ["k", "V"]).parameters
    assert answers["k"].needs is Motion.NONE
    assert answers["k"].without_input
    assert answers["V"].needs is Motion.CONSTANT
    glucose = ulna.model("glucose_minimal_model")
    assert identifiability(glucose, ["p1", "p3", "Gb"]).parameters["p3"].needs is not None


def test_starts_that_hide_a_parameter_are_named() -> None:
    prey = identifiability(ulna.model("lotka_volterra"), ["a", "c", "d"])
    assert prey.lost["x2 = 0"] == ("c", "d")


def test_outputs_and_known_starts_change_the_answer() -> None:
    plant = _plant({"x": "-a*x", "z": "b*x"}, {"y1": "c*x", "y2": "x"}, ["a", "b", "c"])
    assert identifiability(plant, ["c"], outputs=["y1"]).parameters["c"].extent is Extent.NOT
    assert identifiability(plant, ["c"], outputs=["y1"], known_start=["x"]).parameters["c"].extent is not Extent.NOT
    assert identifiability(plant, ["c"]).parameters["c"].extent is Extent.GLOBALLY


def test_a_parameter_that_nothing_sees_is_not_known_and_in_no_combination() -> None:
    plant = _plant({"x": "-a*x", "z": "b*x"}, {"y": "x"}, ["a", "b"])
    found = identifiability(plant, ["a", "b"])
    assert found.parameters["b"].extent is Extent.NOT
    assert found.combinations == ()


@pytest.mark.parametrize(
    ("functions", "known"),
    [
        ([A + B, A * B], set()),
        ([A**2], set()),
        ([A**3], {"a"}),
        ([A * B, A / B], set()),
        ([A * B, B * C, A * C], set()),
        ([A + B, A + 2 * B], {"a", "b"}),
        ([A * B, A * (B + 1)], {"a", "b"}),
        ([(A + 1) / (A + B), B], {"a", "b"}),
    ],
)
def test_functions_are_solved_only_where_one_solution_is_left(functions: list[sp.Expr], known: set[str]) -> None:
    assert recovered(functions, [A, B, C], frozenset()).keys() == known


def test_a_bound_makes_a_square_enough() -> None:
    assert recovered([A**2], [A], frozenset({"a"}))["a"].holds


def test_a_term_more_takes_a_scaling_away() -> None:
    assert scalings(_plant({"x": "-a*x"}, {"y": "b*x"}, ["a", "b"]), ["a", "b"]) == ({"b": -1, "x": 1},)
    assert scalings(_plant({"x": "-a*x + 1"}, {"y": "b*x"}, ["a", "b"]), ["a", "b"]) == ()
    assert scalings(_plant({"x": "-a*x"}, {"y": "b*x + sin(x)"}, ["a", "b"]), ["a", "b"]) == ()


def test_terms_that_stand_still_in_one_record_are_no_proof() -> None:
    """z never moves, so that a·z + b·z² shows as one number; many records would tell a from b."""
    plant = _plant({"x": "a*z + b*z**2", "z": "0"}, {"y1": "x", "y2": "z"}, ["a", "b"])
    equations = input_output(plant, ["a", "b"], seconds=3)
    assert equations is not None
    assert not equations.one_record.holds
    found = identifiability(plant, ["a", "b"])
    assert {answer.extent for answer in found.parameters.values()} == {Extent.NOT}


@pytest.mark.parametrize(
    ("names", "outputs", "message"),
    [
        (["m22"], None, "no parameter 'm22'. Did you mean 'm2'"),
        (["m2", "m2"], None, "is given twice"),
        ([], None, "no parameter is named"),
        (["m2"], ["angle"], "no output 'angle'"),
        (["m2"], [], "no output is measured"),
    ],
)
def test_bad_questions_are_refused(names: list[str], outputs: list[str] | None, message: str) -> None:
    with pytest.raises(IdentificationError, match=message):
        identifiability(ulna.model("one_link_arm"), names, outputs=outputs)


def test_discrete_plants_are_refused() -> None:
    from dataclasses import replace

    plant = _plant({"x": "a*x"}, {"y": "x"}, ["a"])
    with pytest.raises(IdentificationError, match="discrete time"):
        identifiability(replace(plant, period=sp.Rational(1, 100)), ["a"])


def test_the_command_answers_beside_the_analysis() -> None:
    run = CliRunner().invoke(
        app, ["analyse", "mass_spring_damper", "--question", "observability_rank", "--identify", "m, d", "--json"]
    )
    assert run.exit_code == 0, run.output
    found = json.loads(run.stdout)["identifiability"]
    assert found["verdict"] == "proved"
    assert found["value"]["parameters"]["m"]["extent"] == "globally"
    assert found["value"]["parameters"]["m"]["needs"] == "no input"


def test_the_command_shows_a_row_for_each_parameter_and_combination() -> None:
    run = CliRunner().invoke(
        app, ["analyse", "lotka_volterra", "--question", "observability_rank", "--identify", "a,b"]
    )
    assert run.exit_code == 0, run.output
    assert "b from y" in run.stdout


def test_the_command_names_the_nearest_parameter() -> None:
    run = CliRunner().invoke(app, ["analyse", "one_link_arm", "--identify", "m22"])
    assert run.exit_code != 0
    assert "Did you mean 'm2'?" in run.output
