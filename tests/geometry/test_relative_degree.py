"""Relative degree, decoupling matrix, and the difference between "nowhere" and "not here"."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

from ulna.base import UlnaError
from ulna.geometry import accessibility, relative_degree, relative_degree_of
from ulna.symbolic.exact import is_zero
from ulna.system import System, control_affine, system_from_mapping

KNOWN = [
    entry
    for entry in json.loads((Path(__file__).parents[1] / "data" / "systems.json").read_text(encoding="utf-8"))
    if entry["kind"] == "system"
]


def text_of(formula: str) -> str:
    return re.sub(r"Rational\(([^,]*),([^)]*)\)", r"(\1/\2)", formula)


def value_of(entry: dict[str, Any], formula: str) -> sp.Expr:
    names = {n: sp.Symbol(n, real=True) for n in (*entry["states"], *entry["params"], *entry["inputs"])}
    return sp.sympify(formula, locals=names)


def plant_of(entry: dict[str, Any]) -> System:
    states = {}
    for i, name in enumerate(entry["states"]):
        terms = [f"({text_of(g[i])})*{u}" for g, u in zip(entry["g"], entry["inputs"], strict=True)]
        states[name] = {"equation": " + ".join([text_of(entry["f"][i]), *terms])}
    return system_from_mapping(
        {
            "name": entry["name"],
            "states": states,
            "inputs": {u: {} for u in entry["inputs"]},
            "outputs": {f"out{k + 1}": {"equation": text_of(h)} for k, h in enumerate(entry["h"])},
            "parameters": {p: {"value": v} for p, v in entry["params"].items()},
            "operating_point": {x: entry.get("x0", {}).get(x, 0) for x in entry["states"]},
        }
    )


def knowing(*keys: str) -> list[Any]:
    return [pytest.param(e, id=e["name"]) for e in KNOWN if any(k in e["expect"] for k in keys)]


def double_integrator(output: str) -> System:
    return system_from_mapping(
        {
            "name": "double integrator",
            "states": {"x1": {"equation": "x2"}, "x2": {"equation": "u"}},
            "inputs": {"u": {}},
            "outputs": {"y": {"equation": output}},
        }
    )


@pytest.mark.parametrize("entry", knowing("relative_degree", "relative_degree_at_x0"))
def test_relative_degrees_of_the_literature(entry: dict[str, Any]) -> None:
    found = relative_degree(plant_of(entry))
    assert list(found.per_output) == entry["expect"]["relative_degree"]
    assert found.certainty.holds
    here = entry["expect"].get("relative_degree_at_x0")
    if here is not None:
        assert found.at_point.holds is here
        assert found.at_point.fails is not here


@pytest.mark.parametrize("entry", knowing("decoupling_matrix", "decoupling_det"))
def test_decoupling_matrices_of_the_literature(entry: dict[str, Any]) -> None:
    found = relative_degree(plant_of(entry))
    for i, row in enumerate(entry["expect"].get("decoupling_matrix", [])):
        for j, text in enumerate(row):
            assert is_zero(found.decoupling[i, j] - value_of(entry, text)).holds
            assert is_zero(found.decoupling[i, j] - 2 * value_of(entry, text)).fails
    determinant = entry["expect"].get("decoupling_det")
    if determinant:
        assert found.singular is not None
        assert found.invertible.holds
        assert is_zero(found.singular - value_of(entry, determinant)).holds


@pytest.mark.parametrize("entry", knowing("controllability_rank", "controllability_rank_at_x0", "distribution_dims"))
def test_controllability_ranks_of_the_literature(entry: dict[str, Any]) -> None:
    found, expect = accessibility(plant_of(entry)), entry["expect"]
    if "controllability_rank" in expect:
        assert found.rank == expect["controllability_rank"]
    if "controllability_rank_at_x0" in expect:
        assert found.rank_at_point == expect["controllability_rank_at_x0"]
    if "distribution_dims" in expect:
        assert list(found.dimensions) == expect["distribution_dims"]


def test_never_is_told_from_not_here() -> None:
    here = relative_degree(double_integrator("x1 + x2**2"))
    assert here.per_output == (1,)
    assert here.invertible.holds
    assert here.at_point.fails
    assert here.at_point.evidence["generically"] is True
    assert here.singular == 2 * sp.Symbol("x2", real=True)
    never = relative_degree(
        system_from_mapping(
            {
                "name": "apart",
                "states": {"x1": {"equation": "-x1"}, "x2": {"equation": "u"}},
                "inputs": {"u": {}},
                "outputs": {"y": {"equation": "x1"}},
            }
        )
    )
    assert never.per_output == (None,)
    assert never.total is None
    assert never.at_point.fails
    assert never.at_point.evidence["generically"] is False


def test_the_lie_chain_holds_the_derivatives_of_the_output() -> None:
    found = relative_degree(double_integrator("x1"))
    assert found.lie_chain == ((sp.Symbol("x1", real=True), sp.Symbol("x2", real=True), sp.Integer(0)),)
    assert found.decoupling == sp.ImmutableDenseMatrix([[1]])


def test_any_function_of_the_state_can_be_asked_for() -> None:
    view = control_affine(double_integrator("x1"))
    found = relative_degree_of((view.x[1],), view)
    assert found.per_output == (1,)


@pytest.mark.parametrize(
    ("inputs", "outputs"), [("", ""), ("u", ""), ("", "x1"), ("u", "x1 x2"), ("u1 u2", "x1"), ("u1 u2", "x1 x1 + x2")]
)
def test_any_numbers_of_inputs_and_outputs_get_an_answer(inputs: str, outputs: str) -> None:
    names = inputs.split()
    readouts = ["x1", "x2"][: len(outputs.split()[:2])] if outputs else []
    system = system_from_mapping(
        {
            "name": "odd",
            "states": {"x1": {"equation": "x2"}, "x2": {"equation": " + ".join(["0", *names])}},
            "inputs": {name: {} for name in names},
            "outputs": {f"y{k}": {"equation": text} for k, text in enumerate(readouts)},
        }
    )
    found = relative_degree(system)
    assert len(found.per_output) == len(readouts)
    assert found.decoupling.shape == (len(readouts), len(names))
    if not names or not readouts or len(readouts) > len(names):
        assert found.invertible.fails
        assert found.at_point.fails
        assert found.invertible.evidence["reason"]


def test_one_output_and_two_inputs_have_full_row_rank() -> None:
    system = system_from_mapping(
        {
            "name": "wide",
            "states": {"x1": {"equation": "x2*u1 + u2"}, "x2": {"equation": "u1"}},
            "inputs": {"u1": {}, "u2": {}},
            "outputs": {"y": {"equation": "x1"}},
        }
    )
    found = relative_degree(system)
    assert found.per_output == (1,)
    assert found.invertible.holds
    assert found.at_point.holds


def test_outputs_driven_by_the_same_input_alone_are_dependent() -> None:
    system = system_from_mapping(
        {
            "name": "shared",
            "states": {"x1": {"equation": "u1"}, "x2": {"equation": "2*u1"}, "x3": {"equation": "u2"}},
            "inputs": {"u1": {}, "u2": {}},
            "outputs": {"y1": {"equation": "x1"}, "y2": {"equation": "x2"}},
        }
    )
    found = relative_degree(system)
    assert found.per_output == (1, 1)
    assert found.invertible.fails
    assert found.invertible.evidence["rank"] == 1


def test_friction_without_a_derivative_is_named_only_where_it_is_differentiated() -> None:
    states = {"x1": {"equation": "x2"}, "x2": {"equation": "-sign(x2) + x3"}, "x3": {"equation": "u"}}
    data = {"name": "dry", "states": states, "inputs": {"u": {}}, "outputs": {"y": {"equation": "x1"}}}
    with pytest.raises(UlnaError, match=r"sign\(x2\)"):
        relative_degree(system_from_mapping(data))
    velocity = {**data, "states": {"x1": {"equation": "x2"}, "x2": {"equation": "-sign(x2) + u"}}}
    assert relative_degree(system_from_mapping(velocity)).per_output == (2,)


def test_relative_degree_does_not_change_under_feedback() -> None:
    plain = relative_degree(double_integrator("sin(x1)"))
    fed_back = relative_degree(
        system_from_mapping(
            {
                "name": "fed back",
                "states": {"x1": {"equation": "x2"}, "x2": {"equation": "x1**3 + (2 + cos(x1))*u"}},
                "inputs": {"u": {}},
                "outputs": {"y": {"equation": "sin(x1)"}},
            }
        )
    )
    assert plain.per_output == fed_back.per_output == (2,)
