"""Electromyograms: silent at rest, monotone in effort, causal, the same in chunks; unusable files are refused."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import DesignError, UlnaError
from ulna.plants import preset
from ulna.sim.references import MotionLimits
from ulna.studies.prosthesis.demonstration import demonstrate
from ulna.studies.prosthesis.emg_pipeline import Pipeline, activations, calibrated, fresh_memory
from ulna.studies.prosthesis.emg_recording import read_recording, write_recording
from ulna.studies.prosthesis.emg_signal import BAND, Recording, RecordingError, SyntheticMuscles, synthetic_recording
from ulna.studies.prosthesis.intent import (
    AbstractProportion,
    CoContractionSwitch,
    IntentMemory,
    ProportionalPosition,
    ProportionalSpeed,
    read_intent,
)
from ulna.studies.prosthesis.plant import bench_of

RATE = 1000.0
LIMITS = MotionLimits(speed=1.5, lower=-0.9, upper=1.2)


def _recorded(flexor: float, extensor: float, *, seconds: float = 4.0, seed: int = 1, hum: float = 50.0) -> Recording:
    count = int(seconds * RATE)
    muscles = SyntheticMuscles(rate=RATE, seed=seed, hum_frequency=hum)
    return synthetic_recording(muscles, np.full(count, flexor), np.full(count, extensor))


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    return calibrated(_recorded(1.0, 1.0, seed=7))


def _settled(pipeline: Pipeline, recording: Recording) -> np.ndarray:
    return activations(pipeline, recording.samples, fresh_memory())[0][int(RATE) :]


def test_the_noise_fills_its_band_at_the_given_strength() -> None:
    muscles = SyntheticMuscles(rate=2000.0, hum=0.0, floor=0.0, crosstalk=0.0, seed=3)
    recording = synthetic_recording(muscles, np.full(60000, 0.5), np.zeros(60000))
    flexor, extensor = recording.samples.T
    assert np.sqrt(np.mean(flexor**2)) == pytest.approx(0.5 * muscles.amplitude, rel=0.02)
    assert not extensor.any()
    power = np.abs(np.fft.rfft(flexor)) ** 2
    frequencies = np.fft.rfftfreq(len(flexor), 1 / 2000.0)
    inside = (frequencies > BAND[0]) & (frequencies < BAND[1])
    assert power[inside].sum() / power.sum() > 0.97


def test_the_hum_is_where_it_was_put() -> None:
    for hum in (50.0, 60.0):
        recording = _recorded(0.0, 0.0, hum=hum)
        spectrum = np.abs(np.fft.rfft(recording.samples[:, 0]))
        assert np.fft.rfftfreq(len(recording.samples), 1 / RATE)[spectrum.argmax()] == pytest.approx(hum)


def test_the_same_seed_gives_the_same_bits_and_another_one_does_not() -> None:
    assert np.array_equal(_recorded(0.3, 0.1).samples, _recorded(0.3, 0.1).samples)
    assert not np.array_equal(_recorded(0.3, 0.1).samples, _recorded(0.3, 0.1, seed=2).samples)


@pytest.mark.parametrize("seed", range(4))
def test_at_rest_the_activation_is_exactly_zero(pipeline: Pipeline, seed: int) -> None:
    assert not _settled(pipeline, _recorded(0.0, 0.0, seed=seed)).any()


def test_without_the_notch_frequency_right_the_hum_passes(pipeline: Pipeline) -> None:
    """The test above is not silent by the dead band alone: a strong hum passes a notch that is tuned elsewhere."""
    muscles = SyntheticMuscles(rate=RATE, seed=1, hum=3e-4, hum_frequency=60.0)
    recording = synthetic_recording(muscles, np.zeros(4000), np.zeros(4000))
    assert _settled(pipeline, recording).any()
    tuned = calibrated(_recorded(1.0, 1.0, seed=7), mains=60.0)
    assert not _settled(tuned, recording).any()


def test_more_effort_gives_more_activation(pipeline: Pipeline) -> None:
    means = [_settled(pipeline, _recorded(effort, 0.0)).mean(axis=0) for effort in np.linspace(0, 1, 11)]
    flexor, extensor = np.array(means).T
    assert (np.diff(flexor) >= 0).all()
    assert (np.diff(flexor[1:]) > 0).all()
    assert flexor[-1] > 0.8
    assert not extensor.any()


@settings(max_examples=15)
@given(cut=st.integers(1, 2999), size=st.floats(1e-5, 1e-2))
def test_the_future_does_not_change_the_past(cut: int, size: float) -> None:
    pipeline = Pipeline(rate=RATE, contraction=(2e-4, 2e-4))
    samples = _recorded(0.4, 0.2, seconds=3.0).samples
    changed = samples.copy()
    changed[cut:] += size
    before, after = (activations(pipeline, each, fresh_memory())[0] for each in (samples, changed))
    assert np.array_equal(before[:cut], after[:cut])
    assert not np.array_equal(before, after)


@settings(max_examples=15)
@given(cuts=st.lists(st.integers(0, 2500), max_size=6))
def test_chunks_give_the_bits_of_the_whole(cuts: list[int]) -> None:
    pipeline = Pipeline(rate=RATE, contraction=(1e-4, 1e-4))
    samples = _recorded(0.7, 0.6, seconds=2.5).samples
    speed = ProportionalSpeed(speed=1.0)
    whole, _ = activations(pipeline, samples, fresh_memory())
    wanted, _ = read_intent(speed, whole, IntentMemory(), rate=RATE, limits=LIMITS)
    memory, mind, parts, positions = fresh_memory(), IntentMemory(), [], []
    edges = [0, *sorted(cuts), 2500]
    for first, last in pairwise(edges):
        part, memory = activations(pipeline, samples[first:last], memory)
        want, mind = read_intent(speed, part, mind, rate=RATE, limits=LIMITS)
        parts.append(part)
        positions.append(want.position)
    assert np.array_equal(np.concatenate(parts), whole)
    assert np.array_equal(np.concatenate(positions), wanted.position)


def test_flexing_lifts_the_arm_to_the_end_of_its_range_at_the_given_speed() -> None:
    activation = np.tile([1.0, 0.0], (3000, 1))
    wanted, memory = read_intent(ProportionalSpeed(speed=1.0), activation, IntentMemory(), rate=RATE, limits=LIMITS)
    assert wanted.position[499] == pytest.approx(-0.5, abs=1e-9)
    assert wanted.position[-1] == LIMITS.lower
    assert memory.position == LIMITS.lower


def test_a_proportional_position_goes_where_it_should_no_faster_than_allowed() -> None:
    activation = np.tile([0.0, 0.5], (3000, 1))
    proportion = ProportionalPosition(rest=0.1, span=1.0)
    wanted, _ = read_intent(proportion, activation, IntentMemory(), rate=RATE, limits=LIMITS)
    assert wanted.position[-1] == pytest.approx(0.6)
    assert np.abs(np.diff(wanted.position)).max() <= 1.5 / RATE + 1e-12


@pytest.mark.parametrize("proportion", [ProportionalSpeed(speed=1.0), ProportionalPosition(rest=0.0, span=1.0)])
def test_one_long_co_contraction_switches_once_and_the_elbow_waits(proportion: AbstractProportion) -> None:
    activation = np.zeros((3000, 2))
    activation[500:1500] = 0.8
    activation[2000:2600, 0] = 0.9
    wanted, memory = read_intent(proportion, activation, IntentMemory(), rate=RATE, limits=LIMITS)
    assert memory.selected == 1
    assert list(np.flatnonzero(np.diff(wanted.selected))) == [648]
    assert np.ptp(wanted.position[1000:]) == 0.0


def test_a_short_co_contraction_does_not_switch() -> None:
    activation = np.zeros((1000, 2))
    activation[300:420] = 0.9
    switch = CoContractionSwitch(level=0.4, hold=0.15)
    _, memory = read_intent(
        ProportionalSpeed(speed=1.0), activation, IntentMemory(), rate=RATE, limits=LIMITS, switch=switch
    )
    assert memory.selected == 0


def test_a_recording_comes_back_from_its_file_to_the_last_bit(tmp_path: Path) -> None:
    recording = _recorded(0.5, 0.1, seconds=1.0)
    back = read_recording(write_recording(recording, tmp_path / "arm.csv"), rate=RATE)
    assert back.rate == RATE
    assert np.array_equal(back.samples, recording.samples)
    assert read_recording(tmp_path / "arm.csv").rate == pytest.approx(RATE)


def _lines(count: int = 50) -> list[str]:
    return [f"{k / RATE!r},{k % 3},{k % 2}" for k in range(count)]


@pytest.mark.parametrize(
    ("lines", "rate", "text"),
    [
        (_lines()[:20] + _lines()[30:], None, "lost 10 of 50 samples"),
        (_lines(), 2000.0, "its times increase by 0.001"),
        ([f"{k / 50},{k % 3 - 1},0" for k in range(50)], None, "50 samples a second"),
        ([*_lines(30), "0.030,inf,0", "0.031,0,0"], None, "line 31"),
        ([*_lines(30), "0.030,high,0"], None, "line 31"),
        ([f"{k / RATE}" for k in range(50)], None, "no channels"),
        ([f"{k / RATE},{k % 2},{k % 3},{k % 5}" for k in range(50)], None, "3 channels"),
        (["time,flexor,extensor"], None, "0 samples"),
        ([], None, "0 samples"),
        ([*_lines(30), *_lines(5)], None, "goes back in line 31"),
        ([f"{(k / 30) ** 2 / 10:.6f},0,0" for k in range(1, 100)], None, "uneven|missing"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_one_clear_error(
    tmp_path: Path, lines: list[str], rate: float | None, text: str
) -> None:
    path = tmp_path / "arm.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(RecordingError, match=text):
        read_recording(path, rate=rate)


def test_a_file_that_is_not_there_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read"):
        read_recording(tmp_path / "none.csv")
    (tmp_path / "picture.csv").write_bytes(b"\xff\xfe\x00\xd8")
    with pytest.raises(RecordingError, match="cannot be read"):
        read_recording(tmp_path / "picture.csv")


@pytest.mark.parametrize("samples", [np.zeros((10, 1)), np.zeros(10), np.full((10, 2), np.nan)])
def test_samples_of_another_shape_or_not_finite_are_refused(samples: np.ndarray) -> None:
    with pytest.raises(RecordingError):
        Recording(rate=RATE, samples=samples)


@pytest.mark.parametrize(
    "wrong",
    [
        {"rate": 80.0},
        {"contraction": (0.0, 1.0)},
        {"dead_band": 1.0},
        {"mains": 0.0},
        {"envelope": 0.0},
    ],
)
def test_settings_that_cannot_be_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UlnaError):
        Pipeline(**{"rate": RATE, "contraction": (1.0, 1.0), **wrong})


def test_a_silent_calibration_is_refused() -> None:
    with pytest.raises(DesignError, match="contraction"):
        calibrated(Recording(rate=RATE, samples=np.zeros((4000, 2))))


def test_a_calibration_of_its_own_scales_the_activations_and_one_that_does_not_fit_is_refused() -> None:
    bench = bench_of(preset("transhumeral_elbow"))
    recording = _recorded(0.5, 0.1, seconds=4.0)
    greatest = _recorded(1.0, 1.0, seconds=4.0)
    stronger = Recording(rate=RATE, samples=2 * greatest.samples)
    plain, halved = (demonstrate(bench, recording, calibration=each).activation for each in (greatest, stronger))
    late = slice(len(plain) // 2, None)
    assert plain[late, 0].mean() == pytest.approx(0.5, abs=0.12)
    # The dead band is taken off after the scaling.
    dead = Pipeline(rate=RATE, contraction=(1.0, 1.0)).dead_band
    expected = ((1 - dead) * plain[late, 0].mean() + dead) / 2
    assert (1 - dead) * halved[late, 0].mean() + dead == pytest.approx(expected, rel=1e-9)
    with pytest.raises(DesignError, match="no recording"):
        demonstrate(bench, calibration=greatest)
    with pytest.raises(DesignError, match="samples a second"):
        demonstrate(bench, recording, calibration=Recording(rate=2 * RATE, samples=greatest.samples))
