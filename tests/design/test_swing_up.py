"""Swing-up by energy: from hanging at rest to upright, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from ulna.base import DesignError
from ulna.design import LinearQuadratic, close_loop, local_law, swing_up
from ulna.plants import model
from ulna.sim import simulate


@pytest.mark.parametrize(
    ("name", "angle", "energy"),
    [
        ("cart_pole", "th", "om**2/8 + 4.9*(cos(th) - 1)"),
        ("cart_pendulum_accelerated", "x3", "x4**2/2 + 9.81*(cos(x3) - 1)"),
    ],
)
def test_a_pendulum_that_hangs_at_rest_is_swung_up_and_stays(name, angle, energy):
    plant = model(name).with_values()
    catch = local_law(plant, LinearQuadratic(state_weights=[1, 1, 10, 1]))
    law = swing_up(catch, energy=energy, push=5, gain=5, within={angle: 0.4}, pivot="y", hold=[-0.5, -0.5])
    run = simulate(close_loop(plant, law), [0, 0, np.pi, 0], np.linspace(0, 60, 121))
    late = np.linspace(0, 60, 121) >= 50
    assert np.cos(np.asarray(run[angle])[late]) == pytest.approx(1, abs=1e-6)
    assert np.asarray(run["y"])[late] == pytest.approx(0, abs=1e-3)


def test_what_cannot_be_swung_up_is_refused():
    catch = local_law(model("cart_pole"), LinearQuadratic())
    options = {"push": 5, "gain": 5, "within": {"th": 0.4}}
    with pytest.raises(DesignError, match="does not change cos"):
        swing_up(catch, energy="cos(th)", **options)
    with pytest.raises(DesignError, match="within= gives angle"):
        swing_up(catch, energy="om**2", **{**options, "within": {"angle": 0.4}})
    moving = local_law(model("cart_pole"), LinearQuadratic(), integral=True)
    with pytest.raises(DesignError, match="without memory"):
        swing_up(moving, energy="om**2", **options)
