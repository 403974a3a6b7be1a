"""The best input obeys its limits and beats a step; what cannot be told is named."""

from __future__ import annotations

import numpy as np
import pytest

import ulna
from ulna.identification import IdentificationError, sensitivities
from ulna.identification.excitation.precision import precision
from ulna.plants import arm_with_drive, preset

HANGING = np.pi / 2
LIMITS = {"u": 6.0, "i": 1.0, "theta": (HANGING - 1, HANGING + 1)}
FREE = ["m2", "Ra", "B"]


@pytest.fixture(scope="module")
def servo():
    return arm_with_drive(preset("bench_servo"))


@pytest.fixture(scope="module")
def best(servo):
    return ulna.excite(servo, FREE, limits=LIMITS, duration=4.0, samples=200, initial={"theta": HANGING}, tries=16)


def test_it_beats_the_best_step_by_three_in_the_largest_error(best):
    values = {name: best.standard_errors[name] / best.relative_errors[name] for name in FREE}
    by_step = max(best.step_errors[name] / values[name] for name in FREE)
    assert np.isfinite(by_step)
    assert by_step >= 3 * max(best.relative_errors.values())


def test_a_new_run_of_the_input_obeys_the_limits(servo, best):
    times = np.linspace(0, 4, 1601)
    run = ulna.simulate(servo, [HANGING, 0.0, 0.0], times, inputs=dict(best.inputs))
    for name, limit in LIMITS.items():
        lower, upper = limit if isinstance(limit, tuple) else (-limit, limit)
        reached = best.inputs["u"].values if name == "u" else run[name]
        assert lower <= reached.min()
        assert reached.max() <= upper


def test_errors_are_those_of_least_squares_with_free_starts(servo, best):
    along = [*FREE, "theta", "omega", "i"]
    slopes = sensitivities(servo, {"theta": HANGING}, best.motion.times, along=along, inputs=best.inputs)
    rows = slopes.output_slopes.reshape(-1, len(along)) / 1e-3
    sizes = np.linalg.norm(rows, axis=0)
    covariance = np.linalg.inv((rows / sizes).T @ (rows / sizes)) / np.outer(sizes, sizes)
    assert [*best.standard_errors.values()] == pytest.approx(np.sqrt(np.diag(covariance))[:3], rel=1e-5)


def test_repeated_slopes_tell_nothing(best):
    doubled = best.motion.output_slopes.copy()
    doubled[:, :, 1] = 2 * doubled[:, :, 0]
    motion = ulna.identification.Sensitivities(
        times=best.motion.times,
        along=best.motion.along,
        states=best.motion.states,
        outputs=best.motion.outputs,
        state_slopes=best.motion.state_slopes,
        output_slopes=doubled,
    )
    told = precision(motion, 3, np.array([1e-3]), np.ones(3))
    assert told.hidden.tolist() == [True, True, False]


def test_an_input_that_goes_one_way_only_begins_at_its_limit(servo):
    limits = LIMITS | {"u": (0.0, 6.0)}
    found = ulna.excite(servo, ["m2"], limits=limits, duration=1.0, samples=50, initial={"theta": HANGING}, tries=4)
    assert found.inputs["u"].values.min() >= 0.0
    assert found.standard_errors["m2"] <= found.step_errors["m2"] < np.inf
    assert max(found.reached.values()) <= 1.0


def test_the_table_is_read_back(best):
    title, *rows = best.csv().splitlines()
    assert title == "time [s],u [V]"
    assert np.array([row.split(",") for row in rows], dtype=float)[:, 1] == pytest.approx(best.inputs["u"].values)


@pytest.mark.parametrize(
    ("free", "changed", "said"),
    [
        (["m3"], {}, "parameter 'm3'"),
        (["m2"], {"limits": {"i": 1.0}}, "'u' has no limit"),
        (["m2"], {"limits": {"u": 6, "v": 1}}, "limit of 'v'"),
        (["m2"], {"limits": {"u": (6, -6)}}, "6 to -6 is empty"),
        (["m2"], {"limits": {"u": 6, "theta": 0.1}}, "the start, 1.5708"),
        (["m2"], {"initial": {"angle": 1}}, "initial state 'angle'"),
        (["m2"], {"noise": {"y": 0}}, "not positive"),
        (["m2"], {"duration": -1}, "-1 s"),
        ([], {}, "no parameter"),
        (["m2", "m1", "b"], {"tries": 2}, "distinguishes m2, m1, b"),
    ],
)
def test_what_cannot_be_asked_is_one_line(servo, free, changed, said):
    asked = {"limits": LIMITS, "duration": 2.0, "samples": 50, "initial": {"theta": HANGING}} | changed
    with pytest.raises(IdentificationError, match=said) as caught:
        ulna.excite(servo, free, **asked)
    assert "\n" not in str(caught.value)
