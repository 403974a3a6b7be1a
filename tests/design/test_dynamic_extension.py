"""Dynamic extension and flat outputs: what they give, what they refuse and why."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp
from output_plants import UNICYCLE, plant

from ulna.base import Status, UlnaError
from ulna.design.forms.extension import DynamicExtension, dynamic_extension
from ulna.design.forms.flatness import flat_output
from ulna.geometry import relative_degree_of
from ulna.symbolic.exact import is_zero
from ulna.system import control_affine


def decoupled(found: DynamicExtension) -> bool:
    """Whether the extended plant has the relative degrees said, and its feedback gives back the plant's rates."""
    if found.system is None:
        return False
    degree = relative_degree_of(found.outputs, control_affine(found.system))
    rates = found.plant.inline(found.plant.rates)
    fed = dict(zip(found.plant.input_symbols, found.feedback, strict=True))
    same = all(is_zero(a.xreplace(fed) - b).holds for a, b in zip(rates, found.system.rates, strict=False))
    return same and degree.per_output == found.indices and degree.invertible.holds


CAR = ({"x": "v*cos(q)", "y": "v*sin(q)", "q": "v*tan(d)/l", "d": "w"}, ["v", "w"], ["x", "y"], {}, {"l": 1})
VTOL = (
    {"x": "a", "a": "-sin(q)*F", "z": "b", "b": "cos(q)*F - g", "q": "w", "w": "M"},
    ["F", "M"],
    ["x", "z"],
    {},
    {"g": 9.81},
)
ROWS = {
    "unicycle": (UNICYCLE, (2, 2), 1, True),
    "kinematic car": (CAR, (3, 3), 2, True),
    "aircraft with thrust and moment": (VTOL, (4, 4), 2, True),
    "chained form": (({"x1": "u1", "x2": "u2", "x3": "x2*u1"}, ["u1", "u2"], ["x1", "x3"]), (2, 2), 1, True),
    "third input left alone": (
        (
            {"x1": "u1*cos(x3)", "x2": "u1*sin(x3)", "x3": "u2", "x4": "x5", "x5": "u3 + x4**2"},
            ["u1", "u2", "u3"],
            ["x1", "x2", "x4"],
        ),
        (2, 2, 2),
        1,
        True,
    ),
    "one state stays behind": (
        ({"x1": "u1", "x2": "x3*u1 + x4", "x3": "x4", "x4": "u2"}, ["u1", "u2"], ["x1", "x2"]),
        (2, 2),
        1,
        False,
    ),
}


@pytest.mark.parametrize("name", ROWS)
def test_extension_decouples_and_gives_back_the_plant(name: str) -> None:
    arguments, indices, added, complete = ROWS[name]
    found = dynamic_extension(plant(*arguments))
    assert found.verdict.status is Status.PROVED
    assert found.indices == indices
    assert len(found.added) == added
    assert found.complete.status is (Status.PROVED if complete else Status.REFUTED)
    assert decoupled(found)
    assert flat_output(plant(*arguments), list(found.outputs)).status is (Status.PROVED if complete else Status.REFUTED)


def test_extension_brings_singularities_of_its_own() -> None:
    found = dynamic_extension(plant(*UNICYCLE))
    assert found.at_point.fails  # at rest
    assert found.singular is not None
    assert found.singular.free_symbols == set(found.added)
    hover = dynamic_extension(plant(*VTOL))
    assert hover.system is not None
    assert hover.at_point.holds
    assert dict(hover.system.operating_point)["xi1"] == sp.Rational(981, 100)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (({"x1": "x2", "x2": "x3**3", "x3": "u"}, ["u"], ["x1"]), "single input"),
        (({"x1": "u1", "x2": "u2", "x3": "x1"}, ["u1", "u2"], ["x1", "x3"]), "steered independently"),
        (({"x1": "u1", "x2": "u2", "x3": "-x3"}, ["u1", "u2"], ["x1", "x3"]), "no input ever reaches"),
        (({"x1": "u1", "x2": "u2", "x3": "x1"}, ["u1", "u2"], ["x1", "x2", "x3"]), "3 outputs and 2 inputs"),
    ],
)
def test_extension_is_refused_with_the_reason(arguments: tuple[Any, ...], reason: str) -> None:
    found = dynamic_extension(plant(*arguments))
    assert found.verdict.fails
    assert found.system is None
    assert reason in found.verdict.evidence["reason"]


def test_extension_is_not_needed_where_the_decoupling_matrix_is_invertible() -> None:
    found = dynamic_extension(plant({"x1": "u1", "x2": "u2 + x1*u1"}, ["u1", "u2"], ["x1", "x2"]))
    assert found.verdict.status is Status.PROVED
    assert found.added == ()


def test_flat_output_of_foreign_symbols_is_refused() -> None:
    with pytest.raises(UlnaError, match="neither a state nor a parameter"):
        flat_output(plant(*UNICYCLE), [sp.Symbol("a", real=True), sp.Symbol("x", real=True)])
    single = plant({"x1": "x2", "x2": "u"}, ["u"], ["x1"])
    assert flat_output(single, [sp.Symbol("x1", real=True)]).status is Status.PROVED
    assert flat_output(single, [sp.Symbol("x2", real=True)]).fails
