"""The terminal has what Python has: each verb of the front with its command and flag, or why it has none."""

from __future__ import annotations

import inspect
from typing import Any

import pytest
from typer.main import get_command

import ulna
from ulna.cli.main import app

AT_THE_TERMINAL = {
    "analyse": "analyse",
    "check": "check",
    "controller_for": "design",
    "local_law": "design --local",
    "local_observer": "design --local",
    "input_output_form": "design --input-output",
    "normal_form": "design --input-output",
    "dynamic_extension": "design --extend",
    "extended_law": "design --extend",
    "flat_output": "design --extend",
    "gain_schedule": "design --schedule",
    "swing_up": "design --swing-up",
    "substitute_input": "design --substitute",
    "controller_form": "design",
    "state_feedback": "design --controller-poles",
    "state_linearisation": "analyse --question",
    "observer_form": "design --observer-poles",
    "transformed_observer_form": "design --observer-poles",
    "exact_observer": "design --observer-poles",
    "injected_observer": "simulate --discretise",
    "high_gain_observer": "design --high-gain",
    "extended_kalman_filter": "design --kalman",
    "compensator": "design --observer-poles",
    "zero_dynamics": "analyse --question",
    "relative_degree": "analyse --question",
    "accessibility": "analyse --question",
    "observability": "analyse --question",
    "involutive": "analyse --question",
    "equilibria": "analyse --within",
    "equilibrium": "analyse",
    "linearise": "analyse --question",
    "close_loop": "simulate",
    "simulate": "simulate",
    "metrics": "simulate",
    "plot_trajectory": "simulate --plot",
    "plot_poles": "design --plot",
    "plot_region": "prove --plot --plane",
    "sweep": "sweep",
    "open_campaign": "replay",
    "replay": "replay",
    "posterior": "sweep --vary",
    "quantiles": "sweep",
    "settled_fraction": "sweep",
    "worst_cases": "sweep --worst-by",
    "sensitivity": "sweep --sampling",
    "identifiability": "analyse --identify",
    "identify": "identify",
    "fit_page": "identify --page",
    "read_record": "identify --column",
    "prove": "prove",
    "report_page": "report",
    "studio": "studio",
    "model": "models --export",
    "models": "models",
    "read_system": "analyse",
    "write_system": "design --out",
    "with_uses": "analyse --output",
    "excite": "excite --free",
}
"""Command and flag of each function; empty where it is for Python alone."""

FOR_PYTHON = {
    "accessible_decomposition": "a change of coordinates, used inside analysis",
    "bode": "a figure of python-control, for notebooks",
    "step_response": "of python-control, for notebooks; `ulna simulate` runs the plant itself",
    "connect": "wires systems; a plant file holds one",
    "control_affine": "a view of a plant",
    "distribution": "vector fields as values",
    "first_integrals": "of vector fields as values",
    "from_control": "of another library",
    "integrate": "of one-forms as values",
    "lie_bracket": "of vector fields as values",
    "lie_derivative": "of vector fields as values",
    "observable_decomposition": "a change of coordinates, used inside analysis",
    "one_form": "one-forms as values",
    "recursive_estimator": "an estimator beside a loop; `ulna identify` fits its log",
    "plot_trajectories": "several runs in one figure; the terminal runs one",
    "plot_phase": "a figure for notebooks",
    "sensitivities": "slopes along a run, used inside fits",
    "save_figure": "every command that draws saves",
    "system_from_mapping": "a plant file is that mapping",
    "to_control": "to another library",
}
"""Functions that have no command, and why."""

PACKAGES = ("design", "geometry", "sim", "system", "plants", "plot", "campaign", "certify", "identification", "page")
"""Packages whose verbs are gone over; the commands of others have tests of their own."""


def functions() -> list[str]:
    found = {name: getattr(ulna, name) for name in ulna.__all__}
    return [name for name, f in found.items() if inspect.isfunction(f) and f.__module__.split(".")[1] in PACKAGES]


def missing(names: list[str]) -> list[str]:
    return [name for name in names if name not in AT_THE_TERMINAL and name not in FOR_PYTHON]


def test_every_verb_has_its_command_or_a_reason():
    assert missing(functions()) == []
    assert missing([*functions(), "strange_verb"]) == ["strange_verb"]


@pytest.mark.parametrize(("verb", "typed"), [row for row in AT_THE_TERMINAL.items() if row[1]])
def test_a_named_command_has_its_flag(verb, typed):
    command, *flags = typed.split()
    commands: Any = get_command(app)
    found = commands.commands[command]
    options = {name for parameter in found.params for name in parameter.opts}
    assert set(flags) <= options, (verb, flags)
