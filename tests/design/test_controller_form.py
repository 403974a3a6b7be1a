"""Linearising outputs and the controller form against the literature, wrong answers, and plants with known answers."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

from ulna.base import NoFormError, UlnaError
from ulna.design.forms.full_linearisation import controller_form
from ulna.design.forms.linearisability_conditions import linearisability
from ulna.design.forms.linearising_form import substituted_back
from ulna.design.forms.output_search import last_row, linearises, linearising_outputs
from ulna.geometry import relative_degree_of
from ulna.symbolic.exact import are_zero, generic_rank, inverse_last_row, is_zero
from ulna.system import System, control_affine, system_from_mapping

KNOWN = [
    entry
    for entry in json.loads((Path(__file__).parents[1] / "data" / "systems.json").read_text(encoding="utf-8"))
    if entry["kind"] == "system" and entry["inputs"]
]


def text_of(formula: str) -> str:
    return re.sub(r"Rational\(([^,]*),([^)]*)\)", r"(\1/\2)", formula)


def value_of(entry: dict[str, Any], formula: str) -> sp.Expr:
    z = [f"z{k + 1}" for k in range(len(entry["states"]))]
    names = (*entry["states"], *entry["params"], *entry["inputs"], *z, "v", "v1", "v2")
    return sp.sympify(formula, locals={n: sp.Symbol(n, real=True) for n in names})


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


def small(states: dict[str, str], inputs: str = "u", **more: Any) -> System:
    return system_from_mapping(
        {
            "name": "small",
            "states": {name: {"equation": text} for name, text in states.items()},
            "inputs": {name: {} for name in inputs.split()},
            **more,
        }
    )


def same_codistribution(first: tuple[sp.Expr, ...], second: list[sp.Expr], x: tuple[sp.Symbol, ...]) -> bool:
    rows = [[h.diff(s) for s in x] for h in (*first, *second)]
    return generic_rank(sp.Matrix(rows)).value == len(first) == len(second)


# ------------------------------------------------------------------------------------------------ the literature


@pytest.mark.parametrize("entry", knowing("involutive", "full_state_linearizable", "linearizable_at_x0"))
def test_verdicts_of_the_literature(entry: dict[str, Any]) -> None:
    found, expect = linearisability(plant_of(entry)), entry["expect"]
    for key, verdict in (
        ("involutive", found.involutive),
        ("full_state_linearizable", found.verdict),
        ("linearizable_at_x0", found.at_point),
    ):
        if key in expect:
            assert verdict.holds is expect[key], key
            assert verdict.fails is not expect[key], key
    if found.verdict.holds:
        assert sum(found.indices) == len(entry["states"])


@pytest.mark.parametrize("entry", knowing("linearizing_outputs"))
def test_linearising_outputs_of_the_literature_are_found(entry: dict[str, Any]) -> None:
    system = plant_of(entry)
    found = linearising_outputs(system)
    expected = [value_of(entry, text) for text in entry["expect"]["linearizing_outputs"]]
    x = system.state_symbols
    assert found.verdict.holds
    assert found.functions is not None
    assert same_codistribution(found.functions, expected, x)
    # A wrong answer is told from the right one.
    wrong = [*expected[:-1], expected[-1] + x[-1] ** 2 * x[0] + x[1]]
    assert not same_codistribution(found.functions, wrong, x)
    assert linearises(relative_degree_of(tuple(wrong), control_affine(system))).fails


@pytest.mark.parametrize("entry", knowing("T", "control", "inverse"))
def test_transformations_and_laws_of_the_literature_follow_from_their_outputs(entry: dict[str, Any]) -> None:
    expect = entry["expect"]
    outputs = tuple(value_of(entry, text) for text in expect["linearizing_outputs"])
    form = controller_form(plant_of(entry), outputs)
    if "T" in expect:
        assert are_zero([a - value_of(entry, b) for a, b in zip(form.chain, expect["T"], strict=True)]).holds
    if "control" in expect:
        law = form.control
        assert are_zero([a - value_of(entry, b) for a, b in zip(law, expect["control"], strict=True)]).holds
        assert is_zero(law[0] + value_of(entry, expect["control"][0])).fails
    for state, text in expect.get("inverse", {}).items():
        assert form.map.inverse is not None
        index = [s.name for s in form.view.x].index(state)
        assert is_zero(form.map.inverse[index] - value_of(entry, text)).holds


@pytest.mark.parametrize("entry", knowing("full_state_linearizable"))
def test_every_form_is_confirmed_by_substituting_back(entry: dict[str, Any]) -> None:
    system = plant_of(entry)
    if not entry["expect"]["full_state_linearizable"]:
        with pytest.raises(NoFormError) as caught:
            controller_form(system)
        assert caught.value.value is not None
        return
    form = controller_form(system)
    assert substituted_back(form).holds
    wrong_gain = replace(form, beta=form.beta * 2)
    assert substituted_back(wrong_gain).fails
    wrong_drift = replace(form, alpha=form.alpha + sp.ones(*form.alpha.shape) * system.state_symbols[0])
    assert substituted_back(wrong_drift).fails


@pytest.mark.parametrize("entry", knowing("q_exact", "integrating_factor"))
def test_the_last_row_and_its_integrating_factor(entry: dict[str, Any]) -> None:
    found = linearising_outputs(plant_of(entry))
    row = last_row(found)
    assert row is not None
    assert row.row is not None
    assert row.factor is not None
    assert row.closed.holds is entry["expect"]["q_exact"]
    access = found.linearisability.accessibility
    solved = inverse_last_row(access.matrix).solution
    assert solved is not None
    assert are_zero([a - b for a, b in zip(solved, row.row, strict=True)]).holds
    assert found.functions is not None
    slopes = [row.factor * q - found.functions[0].diff(s) for q, s in zip(row.row, access.view.x, strict=True)]
    assert are_zero(slopes).holds


@pytest.mark.parametrize("entry", knowing("singular"))
def test_the_law_is_singular_where_the_literature_says(entry: dict[str, Any]) -> None:
    if "linearizing_outputs" not in entry["expect"]:
        return
    form = controller_form(plant_of(entry))
    condition = value_of(entry, entry["expect"]["singular"])
    symbol = next(iter(condition.free_symbols))
    roots = sp.solve(condition, symbol)
    assert roots
    for root in roots:
        assert is_zero(form.singular.subs(symbol, root)).holds
    assert is_zero(form.singular.subs(symbol, roots[0] + 1)).fails


# ------------------------------------------------------------------------------------------------ the paper


def test_one_input_and_a_closed_last_row_give_the_paper_s_form() -> None:
    arm = small(
        {"x1": "x2", "x2": "-(98/10)*sin(x1) + (196/100)*x3", "x3": "-10*x2 - 10*x3 + 10*u"},
        outputs={"y": {"equation": "x1"}},
    )
    form = controller_form(arm)
    x = arm.state_symbols
    assert form.chain[0] == x[0] * sp.Rational(5, 98)
    assert form.beta == sp.ImmutableDenseMatrix([[1]])
    fields = form.input_fields_in_z
    assert fields == sp.ImmutableDenseMatrix([0, 0, 1])
    drift = form.drift_in_z
    assert list(drift[:2]) == [form.map.new[1], form.map.new[2]]
    assert is_zero(form.map.to_old(drift)[2] - form.alpha[0]).holds


def test_the_law_in_z_is_the_law_in_x() -> None:
    form = controller_form(small({"x1": "sin(x2)", "x2": "x1**2 + u"}))
    v = form.new_inputs[0]
    closed = form.drift_in_z + form.input_fields_in_z * form.map.to_new(form.control)
    assert is_zero(closed[1] - v).holds
    assert form.control[0].free_symbols == {*form.view.x, v}


def test_outputs_of_the_plant_keep_their_order() -> None:
    states = {"x1": "u1", "x2": "x3", "x3": "x1 + u2"}
    outputs = {"fast": {"equation": "x1"}, "slow": {"equation": "x2"}}
    form = controller_form(small(states, "u1 u2", outputs=outputs))
    assert form.indices == (1, 2)
    assert [str(h) for h in form.outputs] == ["x1", "x2"]


# ------------------------------------------------------------------------------------------ every no has its reason


def test_the_offending_bracket_is_named() -> None:
    pendulum = small({"x1": "x2", "x2": "u", "x3": "x4", "x4": "sin(x3) - cos(x3)*u"})
    with pytest.raises(NoFormError) as caught:
        controller_form(pendulum)
    text = str(caught.value)
    assert "(4 states, 1 input)" in text
    assert "[g, ad_f g] leaves span{g, ad_f g, ad_f^2 g}" in text
    assert "rank 4 instead of 3" in text
    assert "Dynamic extension cannot help with one input" in text
    assert caught.value.value is linearisability(pendulum)


def test_the_missing_rank_is_named() -> None:
    with pytest.raises(NoFormError, match="rank 1 instead of 2"):
        controller_form(small({"x1": "-x1", "x2": "u"}))


def test_wrong_outputs_are_refused_with_their_relative_degrees() -> None:
    chain = small({"x1": "x2", "x2": "x3", "x3": "u"})
    with pytest.raises(NoFormError, match=r"\(2,\) do not add up to 3"):
        controller_form(chain, (chain.state_symbols[1],))
    with pytest.raises(NoFormError, match="not one output for each input"):
        controller_form(chain, chain.state_symbols[:2])


def test_no_inputs_no_controller_form() -> None:
    with pytest.raises(NoFormError, match="there are no inputs"):
        controller_form(small({"x1": "-x1"}, ""))


def test_redundant_inputs_are_named() -> None:
    with pytest.raises(NoFormError, match="redundant"):
        controller_form(small({"x1": "x2", "x2": "u1 + u2"}, "u1 u2"))


def test_dry_friction_is_a_clear_answer() -> None:
    with pytest.raises(UlnaError, match=r"sign\(x2\)"):
        controller_form(small({"x1": "x2", "x2": "-sign(x2) + u"}))


def test_a_singular_operating_point_is_told_from_a_plant_without_a_form() -> None:
    states = {"x1": "x2**2", "x2": "u"}
    at_zero = linearisability(small(states, operating_point={"x1": 0, "x2": 0}))
    assert at_zero.verdict.holds
    assert at_zero.at_point.fails
    assert at_zero.at_point.evidence["generically"] is True
    away = controller_form(small(states, operating_point={"x1": 0, "x2": 1}))
    assert away.at_point.holds
    assert controller_form(small(states, operating_point={"x1": 0, "x2": 0})).at_point.fails


def test_a_given_output_that_is_singular_at_the_point_gives_way_to_a_regular_one() -> None:
    system = small({"x1": "x2", "x2": "u"}, outputs={"y": {"equation": "x1**3"}})
    form = controller_form(system)
    assert form.outputs == (system.state_symbols[0],)
    assert form.at_point.holds
