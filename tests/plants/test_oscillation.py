"""Small oscillations: closed forms, and every equilibrium in a range."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from ulna.base import PlantError
from ulna.plants import model, small_oscillation, small_oscillations
from ulna.system import system_from_mapping


def _pendulum():
    return system_from_mapping(
        {
            "format": 1,
            "name": "damped pendulum",
            "parameters": {"l": {"value": 1}, "g": {"value": 9}, "d": {"value": 3}},
            "states": {"q": "v", "v": "-(g/l)*sin(q) - d*v"},
        }
    )


def test_the_pendulum_swings_with_the_root_of_g_over_l():
    hanging = small_oscillation(_pendulum(), {"q": sp.Integer(0)})
    g, length, d = sp.symbols("g l d", real=True)
    assert hanging.residual == 0
    assert sp.simplify(hanging.natural_frequency - sp.sqrt(g / length)) == 0
    assert hanging.damping == d


def test_every_rest_of_the_pendulum_is_found_and_only_the_hanging_ones_swing():
    found = small_oscillations(_pendulum(), (-4.0, 4.0))
    assert found.complete.holds
    angles = [float(next(iter(point.equilibrium.values()))) for point in found.points]
    assert angles == pytest.approx([-math.pi, 0.0, math.pi])
    assert [point.swings for point in found.points] == [False, True, False]
    middle = found.points[1]
    assert float(middle.natural_frequency) == pytest.approx(3.0)
    assert float(middle.damping_ratio) == pytest.approx(0.5)


def test_the_forearm_obeys_the_papers_equations_10_to_12():
    names = "m1 m2 b g a1 a2 c1 c2 thetabar"
    m1, m2, b, g, a1, a2, c1, c2, bar = sp.symbols(names, real=True)
    found = small_oscillation(model("forearm"), {"theta": bar})
    inertia, weight = b**2 * (m2 + m1 / 3), g * b * (m2 + m1 / 2)
    assert sp.simplify(found.residual * inertia + weight * sp.cos(bar) + c2 * a2 * bar) == 0
    assert sp.simplify(found.damping * inertia - c1 * a1**2) == 0
    assert sp.simplify(found.stiffness * inertia - (c2 * a2 - sp.sin(bar) * weight)) == 0


def test_the_linear_system_is_the_linearisation():
    found = small_oscillation(_pendulum(), {"q": sp.Integer(0)})
    q, v, g, length, d = sp.symbols("dq dv g l d", real=True)
    assert sp.simplify(found.linear.rates[1] + g / length * q + d * v) == 0
    assert found.linear.readouts == (q,)


def test_a_weak_biceps_leaves_more_than_one_equilibrium():
    forearm = model("forearm")
    assert len(small_oscillations(forearm, (-40.0, 40.0)).points) == 1
    weak = forearm.with_parameters({"c2": 100})
    assert len(small_oscillations(weak, (-40.0, 40.0)).points) > 1


def test_a_plant_of_third_order_is_refused():
    with pytest.raises(PlantError, match="a position and its rate"):
        small_oscillation(model("one_link_arm"))


def test_a_velocity_is_no_equilibrium():
    with pytest.raises(PlantError, match="Give q alone"):
        small_oscillation(_pendulum(), {"v": sp.Integer(0)})
