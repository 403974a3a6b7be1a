"""The picture of a proof, and the level set behind it, read back from the certificate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ulna
from ulna.base import UlnaError, Verdict
from ulna.certify import CertifyError, GloballyStable, LevelSet, StableWithin, level_set, prove
from ulna.loop import Hardware, Loop, Saturation
from ulna.plot import plot_region
from ulna.system import system_from_mapping

LIMIT = 8.0


def _loop(limit: float = LIMIT, force: str = "-sin(q) - p + u") -> Loop:
    plant = system_from_mapping(
        {"name": "swing", "states": {"q": "p", "p": force}, "inputs": {"u": {}}, "outputs": {"y": "q"}}
    )
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2, -3))
    return Loop(plant=plant, controller=law, hardware=Hardware(saturation=Saturation(lower=-limit, upper=limit)))


@pytest.fixture(scope="module")
def proved() -> Verdict:
    return prove(_loop(), StableWithin(box={"q": 0.5, "p": 0.5}))


@pytest.fixture(scope="module")
def found(proved: Verdict) -> LevelSet:
    return level_set(proved.evidence["certificate"])


def test_v_is_at_most_one_in_the_box_that_was_proved_and_is_the_level_at_the_shadow(found: LevelSet) -> None:
    corners = np.array([[0.5, 0.5, -0.5, -0.5], [0.5, -0.5, 0.5, -0.5]])
    assert (found.value(corners) <= 1.0).all()
    shadow = found.shadow(("q", "p"))
    assert shadow is not None
    # With two states the shadow is the edge itself.
    assert found.value(shadow) == pytest.approx(1.0, abs=1e-12)
    assert (found.value(1.01 * shadow) > 1.0).all()
    assert np.abs(shadow).max(axis=1) == pytest.approx(found.reach(), rel=1e-3)


def test_the_shadow_of_more_states_touches_what_projects_there() -> None:
    """Of a diagonal P the shadow is the ellipse of its two entries, by any row of ζ."""
    swing = level_set(prove(_loop(), StableWithin(box={"q": 0.1})).evidence["certificate"])
    wide = replace(
        swing,
        states=("a", "b", "c"),
        rest=np.array([1.0, 0.0, 0.0]),
        P=np.diag([1.0, 4.0, 9.0]),
        level=36.0,
        lines={"a": np.array([1.0, 0.0, 0.0]), "b": np.array([0.0, 1.0, 1.0])},
    )
    shadow = wide.shadow(("a", "b"))
    assert shadow is not None
    assert np.abs(shadow[0] - 1.0).max() == pytest.approx(6.0, rel=1e-3)
    assert np.abs(shadow[1]).max() == pytest.approx(6.0 * np.hypot(1 / 2, 1 / 3), rel=1e-3)
    assert wide.shadow(("a", "c")) is None


def test_the_rates_are_those_of_the_loop_within_its_limits(found: LevelSet) -> None:
    q, p = np.array([[0.2, 3.0], [-0.1, 4.0]])
    wanted = np.clip(np.sin(q) + p - 6.0 * q - 5.0 * p, -LIMIT, LIMIT)
    assert found.rates(np.array([q, p])) == pytest.approx(np.array([p, -np.sin(q) - p + wanted]), abs=1e-12)
    assert abs(wanted[1]) == LIMIT
    assert found.slowest == pytest.approx(2.0, rel=1e-5)


def test_what_is_proved_what_runs_show_and_the_limits_are_told_apart(proved: Verdict) -> None:
    figure = plot_region(proved, ("p", "q"), units={"p": "rad/s"})
    axes, below = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel(), below.get_ylabel()) == ("p (rad/s)", "q", "V / level")
    labels = set(axes.get_legend_handles_labels()[1])
    assert labels >= {"proved, others at rest", "limit of u", "run that enters it", "runs from its edge"}
    for line in below.lines:
        values = np.asarray(line.get_ydata())
        assert values[0] == pytest.approx(1.0, abs=1e-6)
        assert (np.diff(values) < 0).all()


def test_runs_that_stay_away_are_marked() -> None:
    """q'' = q + u within ±1 falls from beyond |q + p| = 1: some of the picture's points lie there."""
    verdict = prove(_loop(1.0, "q + u"), StableWithin(box={"q": 0.1, "p": 0.1}))
    wide = replace(verdict.evidence["certificate"], level=str(100 * verdict.evidence["level"]))
    axes = plot_region(wide).axes[0]
    away = next(line for line in axes.lines if line.get_label() == "run that does not")
    assert (np.abs(np.asarray(away.get_xdata()) + np.asarray(away.get_ydata())) > 1.0).all()


@pytest.mark.parametrize("states", [("q",), ("q", "q"), ("q", "r"), ("q", "p", "q")])
def test_what_is_no_plane_is_refused(states: tuple[str, ...], proved: Verdict) -> None:
    with pytest.raises(UlnaError, match="Name two of q, p"):
        plot_region(proved, states)


def test_what_has_no_level_set_is_refused() -> None:
    with pytest.raises(UlnaError, match="nothing was proved"):
        plot_region(Verdict.undecided("it converges"))
    free = replace(_loop(), hardware=None)
    with pytest.raises(CertifyError, match="another theorem"):
        plot_region(prove(free, GloballyStable()))
