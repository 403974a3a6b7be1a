"""Which controller to build: read off the comparison, and the full law judged before any run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ulna.plants import preset
from ulna.studies.prosthesis.comparison import Comparison, compare
from ulna.studies.prosthesis.plant import bench_of
from ulna.studies.prosthesis.verdict import advice_text, full_law_advice, recommendation, standings


@pytest.fixture(scope="module")
def found() -> Comparison:
    return compare(bench_of(preset("transhumeral_elbow")), count=4)


def _with_errors(found: Comparison, errors: dict[str, float]) -> Comparison:
    """The comparison with everybody's RMS error set by hand, the same at every task, 1° for those not named."""
    entries = {
        key: replace(e, measured={**e.measured, "rms_error": np.full(found.count, errors.get(e.contender.key, 1.0))})
        for key, e in found.entries.items()
    }
    return replace(found, entries=entries)


def test_the_least_error_is_built_and_who_is_lost_is_named(found: Comparison) -> None:
    made = _with_errors(found, {"pid": 0.5, "reduced": 0.75, "compensator": 40.0})
    table = {each.contender.key: each for each in standings(made)}
    assert table["pid"].score == pytest.approx(1.0)
    assert table["reduced"].score == pytest.approx(1.5)
    assert len(table["compensator"].lost) == 6
    assert [each.contender.key for each in standings(made)][::6] == ["pid", "compensator"]
    text = recommendation(made)
    assert text.startswith("Build the PID with gravity compensation")
    assert "the paper's compensator (lost at reach, hold, follow, pick up, drop, push)" in text


def test_a_best_controller_with_more_sensors_says_who_is_best_without(found: Comparison) -> None:
    text = recommendation(_with_errors(found, {"state_feedback": 0.5, "pid": 0.8}))
    assert "It needs sensors of speed and current; from the angle alone the PID" in text


def test_where_everybody_is_lost_nobody_is_recommended(found: Comparison) -> None:
    everybody = {c.key: 50.0 for c in found.contenders}
    assert recommendation(_with_errors(found, everybody)) == "No controller does every task on this arm."


def test_values_within_5_percent_lead_together(found: Comparison) -> None:
    made = _with_errors(found, {"pid": 0.5, "reduced": 0.52, "load_robust": 0.54})
    assert [c.key for c in made.leaders("hold", "rms_error", 0.95)] == ["pid", "reduced"]


@pytest.mark.parametrize(("name", "works"), [("paper", True), ("bench_servo", False), ("transhumeral_elbow", False)])
def test_the_full_law_is_judged_before_any_run(name: str, works: bool) -> None:
    assert full_law_advice(preset(name)).holds is works
    assert f"{'can' if works else 'cannot'} work here" in advice_text(preset(name))
