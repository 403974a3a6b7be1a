"""Natural types at the verbs of design: names, files, laws, loops and the user's own systems where a plant or a
controller is meant; and what refuses them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

import ulna
from ulna.base import DesignError, PlantError, SimulationError
from ulna.design import (
    SetPoint,
    analyse,
    close_cascade,
    close_loop,
    compensator,
    controller_for,
    controller_form,
    dynamic_extension,
    exact_observer,
    extended_kalman_filter,
    flat_output,
    high_gain_observer,
    injected_observer,
    inner_loop,
    input_output_form,
    linearisability,
    linearising_outputs,
    load_robust_compensator,
    normal_form,
    observer_form,
    permanent_offset,
    reduced_order,
    state_feedback,
    state_linearisation,
    transformed_observer_form,
    with_disturbance,
)
from ulna.plants import model
from ulna.plot import plot_poles
from ulna.system import System, equilibrium, linearise, system_from_mapping, write_system

ARM = model("one_link_arm").with_values()
OBSERVER = exact_observer(observer_form(ARM), [-9, -10, -11])
LAW = state_feedback(ARM, [-4, -5, -6], reference=SetPoint())
PID = system_from_mapping(
    {
        "name": "proportional and integral",
        "states": {"sum": "y_ref - y"},
        "inputs": {"y": {}, "y_ref": {}},
        "outputs": {"u": "8*(y_ref - y) + 2*sum", "error": "y_ref - y"},
    }
)
x1 = sp.Symbol("x1", real=True)


@pytest.fixture(scope="module")
def duffing_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plants") / "duffing.toml"
    write_system(model("duffing"), path)
    return path


VERBS: dict[str, Callable[[Any], Any]] = {
    "analyse": lambda plant: list(analyse(plant).items()),
    "state_feedback": lambda plant: state_feedback(plant, [-1, -2]).expressions,
    "controller_form": lambda plant: controller_form(plant).chain,
    "input_output_form": lambda plant: input_output_form(plant).control,
    "normal_form": lambda plant: normal_form(plant).coordinates,
    "linearisability": lambda plant: linearisability(plant).indices,
    "linearising_outputs": lambda plant: linearising_outputs(plant).functions,
    "state_linearisation": lambda plant: state_linearisation(plant).verdict,
    "dynamic_extension": lambda plant: dynamic_extension(plant).verdict,
    "flat_output": lambda plant: flat_output(plant, [x1]),
    "observer_form": lambda plant: observer_form(plant).injection,
    "transformed_observer_form": lambda plant: transformed_observer_form(plant).injection,
    "exact_observer": lambda plant: exact_observer(plant, [-1, -2]).system,
    "injected_observer": lambda plant: injected_observer(plant, [-1, -2]).system,
    "high_gain_observer": lambda plant: high_gain_observer(plant, "-1, -2").system,
    "extended_kalman_filter": lambda plant: extended_kalman_filter(plant).system,
    "with_disturbance": lambda plant: with_disturbance(plant, {"x2": 1}),
    "controller_for": lambda plant: controller_for(plant, law=[-1, -2], observer=[-3, -4]).system,
    "close_loop": lambda plant: close_loop(plant, state_feedback("duffing", [-1, -2])).system,
    "load_robust_compensator": lambda plant: (
        load_robust_compensator(plant, {"x2": 1}, law=[-1, -2], observer=[-3, -4, -5]).system
    ),
}


@pytest.mark.parametrize("verb", VERBS.values(), ids=VERBS.keys())
def test_a_plant_may_be_given_by_its_name_its_file_or_what_holds_it(verb: Callable[[Any], Any], duffing_file: Path):
    due = str(verb(model("duffing")))
    assert str(verb("duffing")) == due
    assert str(verb(str(duffing_file))) == due
    assert str(verb(controller_form("duffing"))) == due


def test_what_is_no_plant_is_refused_with_what_to_do():
    with pytest.raises(PlantError, match="duffing"):
        analyse("dufing")
    with pytest.raises(PlantError, match="no_such_file"):
        controller_form("no_such_file.toml")


def test_poles_given_to_a_form_are_sent_to_the_law():
    for misplaced in ({"poles": [-1, -2]}, {"gains": [-1, -2]}):
        with pytest.raises(DesignError, match=r"belong to a law. Use state_feedback\(plant, poles\)"):
            controller_form("duffing", **misplaced)


def test_a_law_is_designed_in_any_of_the_forms():
    due = state_feedback("duffing", [-1, -2]).expressions
    for form in (controller_form("duffing"), input_output_form("duffing"), normal_form("duffing")):
        assert sp.simplify(state_feedback(form, "-1, -2").expressions - due) == sp.zeros(1, 1)


def test_an_analysis_is_a_mapping():
    analysis = analyse("duffing")
    assert "relative_degree" in analysis
    assert "relative_degrees" not in analysis
    assert list(analysis) == [key for key, _ in analysis.items()]
    assert len(analysis) == len(list(analysis)) > 20
    assert analysis["relative_degree"].value == [2]


def test_a_controller_that_a_user_wrote_closes_the_loop():
    loop = close_loop("one_link_arm", PID)
    assert [s.name for s in loop.system.inputs] == ["y_ref"]
    assert [s.name for s in loop.system.outputs] == ["y", "u", "error"]
    rest = equilibrium(close_loop(ARM, PID), near={"i": -17}, inputs={"y_ref": 0.3})
    assert rest["theta"] == pytest.approx(0.3, abs=1e-9)


def test_a_user_s_controller_may_read_states_that_are_not_measured():
    omega, u = sp.symbols("omega u", real=True)
    damper = replace(PID, states=(), rates=(), inputs=(ARM.states[1],), outputs=ARM.inputs, readouts=(-3 * omega,))
    whole = close_loop(ARM, damper).system
    driven = dict(zip(whole.state_symbols, whole.inline(whole.rates), strict=True))[sp.Symbol("i", real=True)]
    plant = dict(zip(ARM.state_symbols, ARM.rates, strict=True))[sp.Symbol("i", real=True)]
    assert sp.expand(driven - plant.subs(u, -3 * omega)) == 0
    assert [s.name for s in whole.outputs] == ["y", "u"]


def test_a_controller_read_from_a_file_closes_the_same_loop(tmp_path: Path):
    whole = compensator(LAW, OBSERVER)
    write_system(whole, tmp_path / "controller.toml")
    assert close_loop(ARM, ulna.read_system(tmp_path / "controller.toml")).system == close_loop(ARM, whole).system


def test_a_controller_that_drives_nothing_is_refused():
    stray = replace(PID, outputs=tuple(replace(o, name=f"{o.name}_1") for o in PID.outputs))
    with pytest.raises(
        SimulationError, match="outputs u_1, error_1 is an input of the plant, or the estimate .* inputs: u;"
    ):
        close_loop(ARM, stray)


# The output has a state's name without being that state.
CUBE = system_from_mapping(
    {"name": "cube", "states": {"x1": "x2", "x2": "u"}, "inputs": {"u": {}}, "outputs": {"x2": "x1 + x1**3"}}
)


def test_a_law_reads_states_also_where_an_output_took_their_name():
    poles = linearise(close_loop(CUBE, state_feedback(CUBE, [-1, -2]))).eigenvalues
    assert sorted(p.real for p in poles) == pytest.approx([-2, -1])


def test_an_observer_reads_the_output_that_took_a_state_s_name():
    made = controller_for(CUBE, law=[-1, -2], observer=ulna.HighGain(gains=[-4, -5]))
    poles = linearise(close_loop(CUBE, made)).eigenvalues
    assert sorted(p.real for p in poles) == pytest.approx([-5, -4, -2, -1])


def test_an_observer_of_the_user_s_own_serves_a_compensator():
    own = replace(OBSERVER.system, name="my own")
    assert compensator(LAW, own).system == compensator(LAW, OBSERVER).system


def test_whatever_holds_a_controller_serves_where_one_is_meant():
    made = controller_for(ARM, law=LAW, observer=OBSERVER)
    assert made.law is LAW
    assert made.observer is OBSERVER
    assert close_loop(ARM, made).system == close_loop(ARM, compensator(LAW, OBSERVER)).system
    symbolic = model("one_link_arm")
    assert permanent_offset(symbolic, LAW, "theta").system == permanent_offset(symbolic, LAW.system, "theta").system
    inner = inner_loop(ARM, "i", [-200, -300])
    outer = state_feedback(inner.outer, [-3, -4])
    assert close_cascade(inner, outer) == close_cascade(inner, outer.system)
    assert isinstance(reduced_order("one_link_arm", ["i"]).slow, System)


def test_poles_are_drawn_from_whatever_has_them():
    figures = {
        "law": (LAW, {"poles": 3}),
        "observer": (OBSERVER, {"poles": 3}),
        "controller": (controller_for(ARM, law=LAW, observer=OBSERVER), {"law": 3, "observer": 3}),
        "loop": (close_loop(ARM, LAW), {"poles": 3}),
        "linearisation": (linearise(ARM), {"poles": 3}),
        "list": ([-1, -2 + 1j, -2 - 1j], {"poles": 3}),
        "mapping": ({"a": [-1], "b": [-2, -3]}, {"a": 1, "b": 2}),
    }
    for given, due in figures.values():
        (axes,) = plot_poles(given).axes
        drawn = {line.get_label(): len(line.get_xdata()) for line in axes.lines if line.get_linestyle() == "None"}  # pyright: ignore[reportArgumentType]
        assert drawn == due
