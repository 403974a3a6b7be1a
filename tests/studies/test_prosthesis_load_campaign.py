"""The load-robust controllers over random loads, resistances and motions, behind the limits of their drives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ulna.campaign import CampaignResult, open_campaign
from ulna.plants import preset
from ulna.studies.prosthesis.load_campaign import (
    CURRENT,
    WINDOW,
    missed,
    overshoot,
    peak_current,
    rest_errors,
    run_load_campaign,
)

NAMES = ["paper", "bench_servo", "transhumeral_elbow", "human_scale"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_one_controller_holds_every_load_as_on_hardware(name: str) -> None:
    found = run_load_campaign(preset(name), 1000, seed=1)
    assert rest_errors(found).max() <= 0.2
    assert not missed(found).any()
    # 2 % of a motion of less than 10° is about the encoder's step.
    wide = np.abs(found["end"]) > np.radians(10)
    assert found["settled"][wide].all()
    assert peak_current(found).max() <= 1.02 * float(preset(name).limits.current_peak or CURRENT)
    # Picked up and dropped, and far from all of it at once.
    assert np.ptp(found["m2_after"] - found["m2"]) > 1.5 * found["m2"].max()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_motion_with_the_nominal_load_overshoots_less_than_5_percent(name: str) -> None:
    found = run_load_campaign(preset(name), 200, seed=1, load=float(preset(name).value("m2")))
    wide = np.abs(found["end"]) > np.radians(10)
    assert overshoot(found)[wide].max() < 0.05


@pytest.fixture(scope="module")
def weak() -> CampaignResult:
    return run_load_campaign(preset("bench_servo"), 80, seed=3, current=0.8)


def test_a_drive_that_cannot_give_the_current_of_the_heaviest_load_misses_and_says_so(weak: CampaignResult) -> None:
    """0.8 A is less than what 0.15 kg takes held level: the bench servo's continuous current is its boundary."""
    heaviest = np.maximum(weak["m2"], weak["m2_after"])
    level = np.abs(weak["end"]) < np.radians(30)
    assert (heaviest > 0.14).any()
    assert missed(weak)[(heaviest > 0.14) & level].all()
    assert weak["mean_u_cut"][(heaviest > 0.14) & level].min() > WINDOW / 10
    assert not missed(weak)[heaviest < 0.05].any()


def test_the_first_runs_are_the_same_in_a_longer_campaign_that_is_kept(weak: CampaignResult, tmp_path: Path) -> None:
    run_load_campaign(preset("bench_servo"), 100, seed=3, current=0.8, store=tmp_path / "kept")
    kept = open_campaign(tmp_path / "kept")
    assert np.array_equal(rest_errors(kept)[:80], rest_errors(weak))


def test_a_run_that_is_lost_misses_with_an_infinite_error() -> None:
    """Two runs at rest at −0.3 and 0.3 rad, but for 0.1°; the second one was lost on the way back."""
    near = np.full(2, np.radians(0.1))
    columns = {
        "end": np.full(2, 0.3),
        "least_theta_first": np.full(2, -0.3),
        "most_theta_first": near - 0.3,
        "least_theta_second": np.array([0.3, np.nan]),
        "most_theta_second": np.array([0.3, np.nan]),
    }
    assert rest_errors(columns) == pytest.approx(np.array([[0.1, 0.0], [0.1, np.inf]]))
    assert missed(columns).tolist() == [False, True]
    assert missed(columns, 0.05).tolist() == [True, True]
