"""Measured and controlled outputs are two lists: in the file, at the terminal, in Python."""

from __future__ import annotations

import tomllib

import pytest
import sympy as sp
from terminal import answered, refused

import ulna
from ulna.base import PlantError
from ulna.system import controlled_part, measured_part, system_from_mapping, system_to_mapping, with_uses

# Two carts joined by a spring; u pushes the first. p = a has relative degree 2, q = b four, s = a - b two.
CARTS = """
name = "two carts"
[states]
a = "va"
b = "vb"
va = "u - 4*(a - b)"
vb = "4*(a - b)"
[inputs]
u = {}
[outputs]
p = "a"
q = "b"
[operating_point]
a = 0
b = 0
"""
POLES = [-1, -2, -3, -4]


@pytest.fixture
def carts(tmp_path):
    path = tmp_path / "carts.toml"
    path.write_text(CARTS)
    return str(path)


def test_a_law_for_one_output_and_an_observer_of_another() -> None:
    plant = system_from_mapping(_mapping())
    made = ulna.controller_for(plant, law=POLES, observer=[-5, -6, -7, -8], controlled=["q"], measured=["p"])
    assert made.law is not None
    assert made.observer is not None
    assert made.law.form is not None
    assert [s.name for s in made.law.form.system.outputs] == ["q"]
    assert {s.name for s in made.system.inputs} == {"p"}
    # The loop as a whole has the poles of both: separation.
    found = ulna.linearise(ulna.Loop(plant=plant, controller=made).system).eigenvalues
    poles = sorted(complex(pole).real for pole in found)
    assert poles == pytest.approx([-8, -7, -6, -5, -4, -3, -2, -1], abs=1e-6)


def _mapping() -> dict:
    return tomllib.loads(CARTS)


def test_a_file_says_what_its_outputs_are_for_and_is_written_back() -> None:
    data = _mapping()
    data["outputs"] = {"p": {"equation": "a", "controlled": False}, "q": {"equation": "b", "measured": False}}
    plant = system_from_mapping(data)
    assert [s.name for s in controlled_part(plant).outputs] == ["q"]
    assert [s.name for s in measured_part(plant).outputs] == ["p"]
    assert system_to_mapping(plant)["outputs"] == data["outputs"]
    assert system_from_mapping(system_to_mapping(plant)) == plant
    law = ulna.controller_for(plant, law=POLES, reference=ulna.SetPoint()).law
    assert law is not None
    assert sp.Symbol("q_ref", real=True) in law.system.input_symbols
    data["outputs"]["p"]["controlled"] = "no"
    with pytest.raises(PlantError, match="Write controlled = true or controlled = false"):
        system_from_mapping(data)


def test_the_order_of_the_controlled_outputs_is_the_users() -> None:
    plant = with_uses(system_from_mapping(_mapping()), controlled=["q", "p"])
    assert [s.name for s in controlled_part(plant).outputs] == ["q", "p"]
    for names, reason in ((["z"], "there is no output 'z'"), (["p", "p"], "is given twice")):
        with pytest.raises(PlantError, match=reason):
            with_uses(plant, measured=names)


@pytest.mark.parametrize(("output", "degree"), [("p", [2]), ("q", [4])])
def test_analysis_is_about_the_output_that_is_named(carts, output, degree):
    answers = answered("analyse", carts, "--output", output)
    assert answers["relative_degree"]["value"] == degree
    assert answers["observability_rank"]["value"] == 4


def test_at_the_terminal_a_named_output_follows_its_reference(carts):
    asked = ["--controller-poles=-2,-2.5,-3,-4", "--observer-poles=-5,-6,-7,-8", "--set-point", "--reference", "q=0.7"]
    data = answered("simulate", carts, "--output", "q", "--measured", "p", *asked, "--settle", "q", "--horizon", "8")
    assert data["signals"]["q"][-1] == pytest.approx(0.7, abs=1e-5)
    assert data["settling"][0]["time"] < 8


def test_a_name_that_is_no_output_is_refused(carts):
    assert "Known: p, q." in refused("design", carts, "--controller-poles=-1,-2", "--output", "r")
