"""Jumps and kinks: what an input switches is no input field, and a point beside a jump lies in a smooth plant."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.base import NotAffineError, UlnaWarning
from ulna.design import analyse, controller_for
from ulna.system import control_affine, on_one_side, system_from_mapping

DEAD_ZONE = "Piecewise((u - 0.2, u > 0.2), (u + 0.2, u < -0.2), (0, True))"
x, w, u = sp.symbols("x w u", real=True)


def plant(rate, state="x", **point):
    return system_from_mapping(
        {
            "name": "plant",
            "states": {state: rate},
            "inputs": {"u": {}},
            "outputs": {"y": state},
            "operating_point": point,
        }
    )


@pytest.mark.parametrize(
    "rate",
    [
        f"-x + {DEAD_ZONE}",
        "Piecewise((-1, u < -1), (1, u > 1), (u, True))",
        "sign(u)",
        "Piecewise((2*u, u > 0), (u, True))",
    ],
)
def test_what_an_input_switches_is_not_affine_in_it(rate):
    with pytest.raises(NotAffineError, match="not affine in the input u"):
        control_affine(plant(rate))


def test_an_input_inside_a_piece_that_a_state_switches_is_affine():
    view = control_affine(plant("Piecewise((u, x > 0), (2*u, True))"))
    assert view.g[0] == sp.Piecewise((1, x > 0), (2, True))


@pytest.mark.parametrize(
    ("rate", "point", "piece"),
    [
        ("u - 3*sign(x)", {"x": 2}, u - 3),
        ("u - 3*sign(x)", {"x": -2}, u + 3),
        ("u - x*abs(x)", {"x": -2}, u + x**2),
        ("min(max(u, -1), 1) - x**3", {"x": 0}, u - x**3),
        (f"-x + {DEAD_ZONE}", {"x": 2}, -x + u - sp.Rational(1, 5)),
        ("Piecewise((u, (x > 1) & (x < 3)), (-u, True))", {"x": 2}, u),
        ("u + floor(x/2)", {"x": 3}, u + 1),
        ("u - max(abs(x) - 1, 0)", {"x": 3}, u - x + 1),
    ],
)
def test_a_plant_beside_its_jumps_is_the_smooth_one_there(rate, point, piece):
    found = on_one_side(plant(rate, **point))
    assert found is not None
    assert sp.expand(found.system.rates[0] - piece) == 0


@pytest.mark.parametrize(
    ("rate", "point"),
    [("u - x", {"x": 1}), ("u - sign(x)", {"x": 0}), ("u - max(x, 1)", {"x": 1}), (DEAD_ZONE, {"u": 0})],
)
def test_a_smooth_plant_a_point_on_a_kink_and_the_inside_of_a_dead_zone_have_no_side(rate, point):
    assert on_one_side(plant(rate, **point)) is None


def motor(speed):
    return system_from_mapping(
        {
            "name": "motor with dry friction",
            "states": {"w": "i - w - 0.3*sign(w)", "i": "u - 2*i"},
            "inputs": {"u": {}},
            "outputs": {"y": "w"},
            "operating_point": {"w": speed},
        }
    )


def test_a_motor_that_runs_is_answered_and_controlled_in_spite_of_its_dry_friction():
    found = analyse(motor(10), questions=["relative_degree", "control", "involutive"])
    assert found["relative_degree"].value == [2]
    i, v = sp.symbols("i v", real=True)
    acceleration = i - w - sp.Rational(3, 10)
    assert sp.expand(found["control"].value[0] - (v + 2 * i + acceleration)) == 0
    assert found["control"].verdict.evidence["side"] == {sp.sign(w): 1}
    with pytest.warns(UlnaWarning, match=r"where sign\(w\) is 1"):
        made = controller_for(motor(10), law=[-4, -5])
    assert made.law is not None
    wanted = -9 * acceleration - 20 * (w - 10) + 2 * i + acceleration
    assert sp.expand(made.law.expressions[0] - wanted) == 0
    assert "sign(w) is 1" in made.law.method


def test_a_motor_at_rest_is_left_open_with_the_term_that_jumps():
    found = analyse(motor(0), questions=["relative_degree", "rest_points"])
    assert "sign(w)" in found["relative_degree"].verdict.evidence["reason"]
    assert found["rest_points"].value[0]["states"] == {"w": 0.0, "i": 0.0}
