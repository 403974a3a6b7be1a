"""A point where the plant divides by zero is no equilibrium, however small the rates are beside it."""

from __future__ import annotations

import pytest

from ulna.base import PlantError
from ulna.system import equilibrium, system_from_mapping


@pytest.mark.parametrize("rate", ["x**2/(x**2 + x**3) - 1", "x**4/(x**4 + x**6) - 1", "(x**3 + x**2)/x**2 - 1"])
def test_a_removable_pole_is_no_equilibrium(rate: str) -> None:
    plant = system_from_mapping({"states": {"x": rate, "z": "-z"}})
    found = equilibrium(plant)
    x, _z = plant.state_symbols
    assert not found.verdict.holds or found.states[x] != 0
    for start in (0.0, 0.1):
        try:
            near = equilibrium(plant, near={"x": start, "z": 0.0})
        except PlantError:
            continue
        assert abs(float(near.states[x])) > 1e-3


def test_an_equilibrium_beside_a_pole_is_found() -> None:
    plant = system_from_mapping({"states": {"x": "(x**2 - x)/x", "z": "cos(z)/z"}})
    found = equilibrium(plant, near={"x": 0.9, "z": 1.5})
    assert [float(v) for v in found.states.values()] == pytest.approx([1.0, 1.5707963267948966])
