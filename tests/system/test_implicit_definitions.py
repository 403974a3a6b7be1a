"""Definitions that say what an unknown makes zero: accelerations behind a mass matrix."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ulna.base import PlantError, UnitError
from ulna.program import to_numpy
from ulna.system import connect, read_system, system_from_mapping, system_kernel, write_system

CART = {
    "name": "cart and pendulum",
    "parameters": {
        "M": {"value": 2, "unit": "kg"},
        "m": {"value": "0.5", "unit": "kg"},
        "l": {"value": "0.4", "unit": "m"},
        "g": {"value": "9.81", "unit": "m/s^2"},
    },
    "definitions": {
        "c": "m*l*cos(theta)",
        "a": {"zero": "(M + m)*a + c*e - m*l*sin(theta)*w**2 - F", "unit": "m/s^2"},
        "e": {"zero": "c*a + m*l**2*e - tip", "unit": "rad/s^2"},
        "tip": "m*g*l*sin(theta)",
    },
    "states": {
        "x": {"unit": "m", "equation": "v"},
        "v": {"unit": "m/s", "equation": "a"},
        "theta": {"unit": "rad", "equation": "w"},
        "w": {"unit": "rad/s", "equation": "e"},
    },
    "inputs": {"F": {"unit": "N"}},
    "outputs": {"y": {"unit": "m/s^2", "equation": "a"}},
}
AT = {"x": 0.1, "v": -0.3, "theta": 0.7, "w": 1.2, "F": 2.5}


def accelerations() -> np.ndarray:
    """By hand, from the mass matrix."""
    c, s = np.cos(AT["theta"]), np.sin(AT["theta"])
    matrix = np.array([[2.5, 0.2 * c], [0.2 * c, 0.08]])
    return np.linalg.solve(matrix, [AT["F"] + 0.2 * s * AT["w"] ** 2, 0.5 * 9.81 * 0.4 * s])


def test_the_unknowns_are_put_in_as_formulas():
    cart = system_from_mapping(CART)
    point = {sp.Symbol(name, real=True): value for name, value in AT.items()} | cart.values
    rates = cart.inline(cart.rates)
    assert all(not e.free_symbols & {d.symbol for d in cart.definitions} for e in rates)
    found = [float(e.xreplace(point)) for e in (*rates, *cart.inline(cart.readouts))]
    a, e = accelerations()
    assert found == pytest.approx([AT["v"], a, AT["w"], e, a], rel=1e-13)
    assert cart.with_values().definitions == ()


def test_the_program_solves_for_them():
    field = system_kernel(system_from_mapping(CART))
    assert field.kernel.inputs == ("x", "v", "theta", "w", "F")
    a, e = accelerations()
    assert to_numpy(field.kernel)(*AT.values()) == pytest.approx([AT["v"], a, AT["w"], e, a], rel=1e-13)


@pytest.mark.parametrize("ending", ["toml", "json"])
def test_a_written_plant_reads_back(ending, tmp_path):
    cart = system_from_mapping(CART)
    write_system(cart, tmp_path / f"cart.{ending}")
    assert read_system(tmp_path / f"cart.{ending}") == cart
    assert [d.name for d in cart.unknowns] == ["a", "e"]


def test_a_connection_keeps_them_apart():
    cart = system_from_mapping(CART)
    brake = system_from_mapping({"states": {"a": "s - a"}, "inputs": {"s": {}}, "outputs": {"y": "-a"}})
    wires = {"brake.s": "cart.y", "cart.F": "brake.y"}
    loop = connect({"cart": cart, "brake": brake}, wires, name="loop", outputs=["cart.y"])
    at = {"x": 0.1, "v": -0.3, "theta": 0.7, "w": 1.2, "a": -2.5}  # a brake at -2.5 pushes with F = 2.5
    rates = dict(zip((s.name for s in loop.states), loop.inline(loop.rates), strict=True))
    point = {sp.Symbol(name, real=True): value for name, value in at.items()} | loop.values
    values = {name: float(e.xreplace(point)) for name, e in rates.items()}
    a, e = accelerations()
    assert (values["v"], values["w"], values["a"]) == pytest.approx((a, e, a + 2.5), rel=1e-12)


@pytest.mark.parametrize(
    ("definitions", "error", "reason"),
    [
        ({"a": {"zero": "M*a*sin(a*x/v**2) - F", "unit": "m/s^2"}}, PlantError, "not affine"),
        ({"a": {"zero": "M*v - F", "unit": "m/s^2"}}, UnitError, "dimension"),
        ({"a": {"zero": "m*a - M*a + (M - m)*a - F", "unit": "m/s^2"}}, PlantError, "singular"),
        ({"a": {"unit": "m/s^2"}}, PlantError, "without `zero`"),
        ({"a": {"zero": "M*a - F", "unit": "m"}}, UnitError, "dimension"),
        ({"a": {"zero": "M*a - F", "units": "m/s^2"}}, PlantError, "unknown key 'units'"),
        ({"a": {"zero": "M*a - F - lost", "unit": "m/s^2"}}, Exception, "lost"),
    ],
)
def test_what_cannot_be_solved_is_refused(definitions, error, reason):
    definitions = {**CART["definitions"], **definitions}
    with pytest.raises(error, match=reason):
        system_from_mapping({**CART, "definitions": definitions})
