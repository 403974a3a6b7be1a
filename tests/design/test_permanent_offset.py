"""The permanent offset of a law that only cancels its model: the closed form, and simulation."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError
from ulna.design import Poles, close_loop, controller_form, permanent_offset, state_feedback
from ulna.plants import model
from ulna.sim import simulate

PAPER_POLES = ("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8)


def test_the_offset_of_a_wrong_load_under_the_third_order_law_in_closed_form() -> None:
    arm = model("one_link_arm")
    law = state_feedback(controller_form(arm), Poles(*PAPER_POLES))
    carried = 4.0
    plant = arm.with_parameters({"m2": sp.Rational(carried)})
    offset = permanent_offset(plant, law, "theta")
    m, m0, b, g, m1, theta = (sp.Symbol(n, real=True) for n in ("plant_m2", "controller_m2", "b", "g", "m1", "theta"))
    # By hand: a0 theta + a2 (G0 - G) cos(theta)/J0 = 0 with a0 = 128, a2 = 12, G - G0 = (m - m0) g b.
    inertia = m0 * b**2 + m1 * b**2 / 3
    hand = 128 * theta * inertia - 12 * (m - m0) * g * b * sp.cos(theta)
    ratio = sp.simplify(offset.equation / hand)
    assert not ratio.has(theta)
    assert sp.simplify(offset.first_order - sp.Rational(12, 128) * (m - m0) * g * b / inertia) == 0
    run = simulate(close_loop(plant, law).system, [0.5, 0.0, 0.0], np.linspace(0, 20, 21))
    assert offset.value() == pytest.approx(run["theta"][-1], abs=1e-9)
    assert offset.value({"plant_m2": 5}) == pytest.approx(0.0, abs=1e-12)
    assert float(offset.first_order.subs(offset.system.values)) == pytest.approx(offset.value(), rel=0.2)


def test_a_state_that_does_not_exist_and_a_loop_that_rests_nowhere_are_refused() -> None:
    arm = model("one_link_arm").with_values()
    law = state_feedback(controller_form(arm), Poles(*PAPER_POLES))
    with pytest.raises(DesignError, match="no state 'phi'"):
        permanent_offset(arm, law, "phi")
    with pytest.raises(DesignError, match="no equilibrium was found between"):
        permanent_offset(arm, law, "theta").value(within=(0.5, 1.0))
