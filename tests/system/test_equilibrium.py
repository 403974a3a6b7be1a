"""`equilibrium` near a point, `equilibria` in a range, and what `linearise` takes."""

from __future__ import annotations

import math
from typing import Any

import pytest
import sympy as sp

from ulna.base import PlantError, Status
from ulna.plants import model
from ulna.system import Equilibrium, System, equilibria, equilibrium, linearise, system_from_mapping


def pendulum(**parameters: Any) -> System:
    return system_from_mapping(
        {
            "name": "pendulum",
            "parameters": {"g": {"value": 9}, "d": {"value": 3}, **parameters},
            "states": {"q": "v", "v": "-g*sin(q) - d*v + u"},
            "inputs": {"u": {}},
            "outputs": {"height": "1 - cos(q)"},
            "operating_point": {"q": 3},
        }
    )


def test_newton_starts_at_what_is_given_else_at_the_files_point() -> None:
    assert equilibrium(pendulum(), near={"q": -0.4})["q"] == 0
    assert equilibrium(pendulum(), near={}).numbers == pytest.approx({"q": math.pi, "v": 0})
    assert equilibrium(pendulum(), inputs={"u": 4.5})["q"] == pytest.approx(math.pi - math.asin(0.5))


def test_an_exact_equilibrium_is_exact_on_demand() -> None:
    q = sp.Symbol("q", real=True)
    found = equilibrium(pendulum(), near={"q": 3.1}, exact=True)
    assert found.states[q] == sp.pi
    assert found.exact
    assert found.verdict.status is Status.PROVED
    assert equilibrium(pendulum(), near={"q": sp.pi}, exact=True).verdict.evidence["method"] == "as given"
    decimal = equilibrium(pendulum(), near={"q": 3.1})
    assert not decimal.exact
    assert decimal.verdict.status is Status.SUPPORTED
    assert decimal.verdict.evidence["digits"] == 12


def test_a_point_tells_the_numbers_of_states_inputs_and_outputs() -> None:
    found = equilibrium(pendulum(), near={"q": 3}, inputs={"u": 4.5})
    assert found["u"] == 4.5
    assert found["height"] == pytest.approx(1 + math.sqrt(0.75))
    with pytest.raises(PlantError, match="Known: height, q, v, u"):
        _ = found["omega"]


def test_what_is_not_reached_is_said_with_the_reason() -> None:
    with pytest.raises(PlantError, match=r"equilibrium of 'pendulum': no equilibrium was found near the point"):
        equilibrium(pendulum(), inputs={"u": 10})
    with pytest.raises(PlantError, match="there is no equilibrium: x has the rate 2 everywhere"):
        equilibrium(system_from_mapping({"states": {"x": "2"}}), near={})
    with pytest.raises(PlantError, match="parameters without a value: d"):
        equilibrium(pendulum(d={}), near={})
    with pytest.raises(PlantError, match=r"'w' of a point of 'pendulum': there is no such state.*Known: q, v, u"):
        equilibrium(pendulum(), near={"w": 1})
    with pytest.raises(PlantError, match="not a finite number"):
        equilibrium(pendulum(), near={"q": math.nan})


def test_symbolic_parameters_stay_where_the_equilibrium_is_exact() -> None:
    plant = system_from_mapping({"states": {"x": "a - x**2"}, "parameters": {"a": {"range": [1, 4]}}})
    a, x = sp.symbols("a x", real=True)
    assert equilibrium(plant, near={"x": -5}, exact=True).states[x] == -sp.sqrt(a)
    assert equilibrium(plant, near={"x": 5}, exact=True).states[x] == sp.sqrt(a)


def test_linearise_takes_an_equilibrium_a_mapping_or_nothing() -> None:
    plant = pendulum()
    point = equilibrium(plant, near={"q": 3.1}, exact=True)
    by_name = linearise(plant, {"q": sp.pi, "v": 0, "u": 0})
    assert linearise(plant, point).A.subs(plant.values) == by_name.A.subs(plant.values)
    assert linearise(point) == linearise(plant, point)
    assert linearise(point).eigenvalues == pytest.approx([(-3 + 45**0.5) / 2, (-3 - 45**0.5) / 2])
    assert not linearise(point).stable
    arm = model("one_link_arm")
    assert linearise(arm) == linearise(arm, equilibrium(arm))
    assert linearise(arm).A.subs(arm.values)[1, 0] == 0
    with pytest.raises(PlantError, match=r"'w' of a point of 'pendulum'"):
        linearise(plant, {"w": 1})


def test_eigenvalues_need_numbers() -> None:
    with pytest.raises(PlantError, match="no value is given for q"):
        _ = linearise(pendulum(), {"v": 0}).eigenvalues
    with pytest.raises(PlantError, match="no value is given for d"):
        _ = linearise(pendulum(d={}), {"q": 0}).eigenvalues


def test_equilibria_are_a_sequence_of_equilibria() -> None:
    found = equilibria(pendulum(), {"q": (-4, 4)}, inputs={"u": 4.5})
    assert found.complete.status is Status.PROVED
    assert [p["q"] for p in found] == pytest.approx(
        sorted([math.pi / 6, 5 * math.pi / 6, math.pi / 6 - 4 * math.pi / 3])
    )
    assert all(isinstance(p, Equilibrium) and p["u"] == 4.5 for p in found)
    assert [linearise(p).stable for p in found] == [False, True, False]
    for point in found:
        again = equilibrium(pendulum(), near=point, inputs={"u": 4.5})
        assert again["q"] == pytest.approx(point["q"], rel=1e-11)
