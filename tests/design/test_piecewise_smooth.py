"""Plants with abs, min and max: the answer counts where the derivatives that it needs exist, and only there."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.base import UlnaError
from ulna.design import controller_form, state_feedback
from ulna.geometry import relative_degree
from ulna.system import system_from_mapping


def plant(states, output="z", **parameters):
    return system_from_mapping(
        {
            "name": "plant",
            "parameters": {name: {"value": value} for name, value in parameters.items()},
            "states": states,
            "inputs": {"u": {}},
            "outputs": {"y": output},
        }
    )


def test_the_law_of_an_underwater_vehicle_keeps_its_drag():
    vehicle = plant({"z": "w", "w": "(u - 5 - 60*w*abs(w))/30"})
    assert relative_degree(vehicle).per_output == (2,)
    z, w = sp.symbols("z w", real=True)
    (law,) = state_feedback(vehicle, [-1, -2]).expressions
    assert sp.expand(law - (60 * w * sp.Abs(w) - 90 * w - 60 * z + 5)) == 0


@pytest.mark.parametrize("drag", ["w*abs(w)", "max(0, w)**2 - min(0, w)**2", "w**2*abs(w)", "(w - 1)*abs(w - 1)"])
def test_drag_behind_an_actuator_needs_one_derivative_and_has_it(drag):
    actuated = plant({"z": "w", "w": f"F - {drag}", "F": "u - F"})
    found = controller_form(actuated)
    w = sp.Symbol("w", real=True)
    third = found.map.forward[2].diff(w)
    for number in (-2, -sp.Rational(1, 3), sp.Rational(1, 2), 3):
        expected = -sp.diff(actuated.rates[1], w).subs(w, number).doit()
        assert sp.N(third.subs(w, number) + expected) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("friction", ["abs(w)", "sign(w)", "max(-1, min(1, w))", "w*sign(w - 1)"])
def test_what_jumps_or_has_a_corner_is_refused_where_it_is_differentiated(friction):
    with pytest.raises(UlnaError, match="not smooth"):
        relative_degree(plant({"z": "w", "w": f"F - {friction}", "F": "u - F"}))
    assert relative_degree(plant({"z": "w", "w": f"u - {friction}"})).per_output == (2,)
