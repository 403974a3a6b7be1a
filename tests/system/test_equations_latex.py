"""The equations that a notebook shows define every name they use, of plants and of closed loops."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.base import mathml
from ulna.design import controller_for
from ulna.loop import Hardware, Loop
from ulna.plants import model
from ulna.symbolic.formulas import expression_latex, name_latex
from ulna.system import System
from ulna.system.equations import equations

CONTROLLED = {"one_link_arm": [-2, -3, -4], "mass_spring_damper": [-2, -3]}


def _undefined(system: System) -> set[str]:
    """Names that the equations use and do not define, as LaTeX."""
    rows = equations(system)
    known = {name_latex(s.name) for s in (*system.states, *system.inputs, *system.parameters)}
    known |= {left for left, _ in rows} | {name_latex(d.name) for d in system.unknowns}
    return {name_latex(s.name) for _, right in rows for s in right.free_symbols} - known


def _loop(name: str) -> Loop:
    plant = model(name)
    return Loop(plant=plant, controller=controller_for(plant, law=CONTROLLED[name], observer=[-6] * len(plant.states)))


@pytest.mark.parametrize("name", CONTROLLED)
def test_a_closed_loop_defines_every_name_that_it_uses(name: str) -> None:
    system = _loop(name).system
    assert _undefined(system) == set()
    assert "plant" not in system._repr_latex_()
    assert "controller" not in system._repr_latex_()


@pytest.mark.parametrize("name", ["one_link_arm", "cart_pole"])
def test_a_plant_shows_its_definitions_and_the_values_of_its_parameters(name: str) -> None:
    plant = model(name)
    assert _undefined(plant) == set()
    latex = plant._repr_latex_()
    assert all(f"{name_latex(p.name)} = " in latex for p in plant.parameters if p.value is not None)


def test_an_equation_that_uses_an_undefined_name_is_noticed() -> None:
    system = _loop("one_link_arm").system
    kept = tuple(d for d in system.definitions if d.name != system.definitions[-1].name)
    bare = object.__new__(System)
    for field in System.__dataclass_fields__:
        object.__setattr__(bare, field, getattr(system, field))
    object.__setattr__(bare, "definitions", kept)
    assert _undefined(bare)


def test_a_loop_on_a_processor_shows_plant_and_controller() -> None:
    plant = model("one_link_arm").with_values()
    controller = controller_for(plant, law=[-2, -3, -4], observer=[-6, -7, -8])
    loop = Loop(plant=plant, controller=controller, hardware=Hardware(period=1e-3))
    latex = loop._repr_latex_()
    assert r"\dot{\theta} &=" in latex
    assert r"\dot{\hat{\theta}} &=" in latex
    table = loop._repr_html_()
    assert "0.001 s" in table
    assert table.count("<math") == 2


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("theta_hat", r"\hat{\theta}"),
        ("m1", "m_{1}"),
        ("y_ref", r"y_{\mathrm{ref}}"),
        ("speed", r"\mathrm{speed}"),
        ("e1_int", r"e_{1,\mathrm{int}}"),
        ("_x", r"\mathrm{ x}"),
    ],
)
def test_names_are_set_as_engineers_write_them(name: str, latex: str) -> None:
    assert name_latex(name) == latex
    assert mathml(name_latex(name))


def test_numbers_that_nobody_reads_are_rounded() -> None:
    x = sp.Symbol("x")
    assert expression_latex(sp.Rational(54072450001, 5000000000) * x) == "10.8145 x"
    assert expression_latex(sp.Float("0.123456789") * x) == "0.123457 x"
    assert expression_latex(sp.Rational(441, 250) * x) == r"\frac{441 x}{250}"
