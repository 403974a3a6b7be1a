"""Recordings as they come: read whatever the layout, silent where a muscle is silent, or refused in one line."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from emg_layouts import LAYOUTS, Layout, muscles, rows
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ulna.base import DesignError, OptionalDependencyError
from ulna.studies.prosthesis import Recording, read_recording
from ulna.studies.prosthesis.emg_pipeline import activations, calibrated, calibrated_on_itself, fresh_memory
from ulna.studies.prosthesis.emg_signal import RecordingError


def _written(place: Path, text: str | bytes) -> Path:
    place.write_bytes(text if isinstance(text, bytes) else text.encode())
    return place


def _active(recording: Recording) -> np.ndarray:
    pipeline, _ = calibrated_on_itself(recording)
    return activations(pipeline, recording.samples, fresh_memory())[0]


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda each: each.key)
def test_a_layout_is_read_and_described(layout: Layout, tmp_path: Path) -> None:
    samples = muscles(1000.0 if layout.envelope else layout.rate)
    found = read_recording(_written(tmp_path / "arm.txt", layout.write(samples)), **layout.options)  # type: ignore[arg-type]
    assert found.rate == pytest.approx(layout.rate, rel=1e-6 if layout.key != "jitter" else 1e-3)
    assert found.envelope is layout.envelope
    assert found.said.isprintable()
    for words in layout.said:
        assert words in found.said
    assert len(found.muscles) == 1 + (not layout.one)
    if not layout.envelope:
        wanted = layout.scale * samples
        kept = np.ones(len(wanted), dtype=bool)
        if layout.key == "lost":
            kept[[100, 200, *range(300, 305)]] = False
        size = np.abs(wanted).max()
        assert found.samples[kept, 0] == pytest.approx(
            wanted[kept, 0], abs=1e-8 * size + layout.rounding * (layout.rounding > 1e-6)
        )
        if not layout.one:
            assert found.samples[kept, 1] == pytest.approx(
                wanted[kept, 1], abs=1e-8 * size + layout.rounding * (layout.rounding > 1e-6)
            )
    active = _active(found)
    quiet = int(1.4 * found.rate)
    assert not active[:quiet].any()
    assert active[:, 0].max() > 0.9
    assert layout.one == (not active[:, 1].any())


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_the_same_signal_reads_back_the_same_from_every_layout(data: st.DataObject, tmp_path: Path) -> None:
    draw = data.draw
    rate = draw(st.sampled_from([200.0, 250.0, 500.0, 1000.0, 1259.0, 1926.0, 2000.0]))
    between = draw(st.sampled_from(["\t", ";", ",", " ", "   "]))
    comma = between != "," and draw(st.booleans())
    ending = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    unit, scale = draw(st.sampled_from([("s", 1.0), ("ms", 1e3), ("us", 1e6)]))
    seed = draw(st.integers(0, 5))
    samples = np.random.default_rng(seed).standard_normal((200, 2))
    titled = draw(st.booleans())
    first = draw(st.sampled_from([0.0, 12.5, 3600.0]))
    above = draw(st.lists(st.sampled_from(["# made by hand", "Subject 3", "", "% left arm"]), max_size=3))
    if titled:
        above.append(between.join([f"time_[{unit}]", "flexor", "extensor"]))
        if draw(st.booleans()):
            above.append(between.join([unit, "V", "V"]))
    else:
        unit, scale = "s", 1.0
    places = {"s": 7, "ms": 4, "us": 1}[unit]
    lines = rows(
        samples, time=lambda k: f"{scale * (first + k / rate):.{places}f}", between=between, value=".12g", comma=comma
    )
    if draw(st.booleans()):
        lines.insert(50, "")
        lines.insert(90, "# a pause")
    text = ending.join([*above, *lines]) + draw(st.sampled_from(["", ending]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]))
    found = read_recording(_written(tmp_path / "arm.csv", text.encode(encoding)))
    assert found.rate == pytest.approx(rate, rel=1e-5)
    assert found.samples == pytest.approx(samples, abs=1e-9)


@settings(max_examples=25)
@given(
    offset=st.floats(-1e4, 1e4),
    size=st.floats(1e-3, 10.0),
    rate=st.sampled_from([200.0, 250.0, 1000.0, 2000.0]),
    seed=st.integers(0, 9),
)
def test_a_silent_muscle_with_an_offset_has_no_activation(offset: float, size: float, rate: float, seed: int) -> None:
    noise = size * np.random.default_rng(seed).standard_normal((int(3 * rate), 2))
    greatest = Recording(rate=rate, samples=50 * noise)
    active, _ = activations(calibrated(greatest), offset + noise, fresh_memory())
    assert not active.any()


def test_a_muscle_that_never_contracts_counts_as_silent_and_no_contraction_at_all_is_refused() -> None:
    samples = muscles(1000.0)
    samples[:, 1] = 2e-6 * np.random.default_rng(5).standard_normal(len(samples))
    pipeline, said = calibrated_on_itself(Recording(rate=1000.0, samples=samples, muscles=("biceps", "triceps")))
    assert said == "triceps never contracts and counts as silent"
    assert not activations(pipeline, samples, fresh_memory())[0][:, 1].any()
    quiet = Recording(rate=1000.0, samples=samples[:, [1, 1]])
    with pytest.raises(DesignError, match="no muscle contracts"):
        calibrated_on_itself(quiet)


@pytest.mark.parametrize("rate", [200.0, 250.0, 500.0, 1259.0, 2000.0])
def test_the_band_fits_every_rate_and_full_effort_is_full(rate: float) -> None:
    noise = np.random.default_rng(2).standard_normal((int(6 * rate), 2))
    pipeline = calibrated(Recording(rate=rate, samples=noise))
    later = activations(pipeline, 0.5 * noise, fresh_memory())[0][int(rate) :]
    assert later.mean(axis=0) == pytest.approx((0.5 - 0.08) / 0.92, abs=0.02)


def test_envelopes_are_recognised_and_can_be_ordered_or_denied(tmp_path: Path) -> None:
    samples = muscles(1000.0)
    rectified = np.abs(samples)
    text = "\n".join(["time,flexor,extensor", *rows(rectified, time=lambda k: f"{k / 1000:.3f}")])
    place = _written(tmp_path / "arm.csv", text)
    assert read_recording(place).envelope
    assert not read_recording(place, envelope=False).envelope
    raw = "\n".join(["time,flexor,extensor", *rows(1.65 + samples, time=lambda k: f"{k / 1000:.3f}")])
    assert not read_recording(_written(place, raw)).envelope
    assert "by order" in read_recording(place, envelope=True).said


def _lines(count: int = 3000) -> list[str]:
    return rows(muscles(1000.0)[:count], time=lambda k: f"{k / 1000:.3f}")


def _with(line: int, text: str) -> list[str]:
    return ["time,flexor,extensor", *_lines()[: line - 2], text, *_lines()[line - 1 :]]


@pytest.mark.parametrize(
    ("lines", "options", "words"),
    [
        (_with(40, "0.038,high,0"), {}, ["line 40, column 2 (flexor)", "'high'", "Correct"]),
        (_with(40, "0.038,1e400,0"), {}, ["line 40, column 2", "'1e400' is not a number"]),
        (_with(40, "0.038,1e99999999999,0"), {}, ["line 40, column 2"]),
        (_with(40, "0.038,1"), {}, ["line 40 has 2 columns", "3"]),
        (_with(40, "0.010,1,1"), {}, ["goes back in line 40", "Cut it there"]),
        (_with(40, ",1,1"), {}, ["line 40", "time is missing"]),
        (_lines()[:1000] + _lines()[1500:], {}, ["500 of 3000", "line 1000", "0.5 s", "bridged"]),
        (["sample,a,b", *rows(muscles(200.0), time=str)], {}, ["sample numbers", "rate=1000"]),
        (rows(muscles(200.0)), {}, ["no column holds times", "rate=1000"]),
        (_lines(), {"rate": 500.0}, ["its times increase by 0.001", "500"]),
        (["time [s],a,b", *_lines()], {"rate": 500.0}, ["its times say 1000", "rate=500"]),
        (["Sampling rate: 2000 Hz", "time [s],a,b", *_lines()], {}, ["its times say 1000", "titles 2000"]),
        (
            ["time,a,b,c", *(f"{each},{k % 7}" for k, each in enumerate(_lines()))],
            {},
            ["3 channels", "2 a, 3 b, 4 c", "muscles="],
        ),
        (_lines(), {"muscles": ("biceps",)}, ["'biceps'", "none has that name"]),
        (["time,emg a,emg b", *_lines()], {"muscles": ("emg",)}, ["2 columns fit"]),
        (["time,a,b", *_lines()], {"muscles": ("a", "2")}, ["twice"]),
        (_lines(), {"muscles": ("1", "2", "3")}, ["3 muscles"]),
        (_lines(), {"rate": -1.0}, ["above 0"]),
        ([f"{k / 60:.4f},{(-1) ** k * k % 7}" for k in range(200)], {}, ["60 samples a second", "envelope=True"]),
        (["time,a,b\x9b2J\u202e", *(f"{k / 1000},x{k},\x9b" for k in range(9))], {}, ["0 samples"]),
    ],
)
def test_a_file_that_cannot_be_used_is_one_clear_line(
    lines: list[str], options: dict[str, object], words: list[str], tmp_path: Path
) -> None:
    place = _written(tmp_path / "arm.csv", "\n".join(lines))
    with pytest.raises(RecordingError) as caught:
        read_recording(place, **options)  # type: ignore[arg-type]
    said = str(caught.value)
    assert said.isprintable()
    for each in words:
        assert each in said


def test_edf_and_bdf_are_read(tmp_path: Path) -> None:
    edfio = pytest.importorskip("edfio")
    samples = muscles(1000.0)
    for kind, signal, write in (("EDF", edfio.EdfSignal, edfio.Edf), ("BDF", edfio.BdfSignal, edfio.Bdf)):
        signals = [
            signal(1e6 * samples[:, k], sampling_frequency=1000, label=name, physical_dimension="uV")
            for k, name in enumerate(("EMG triceps", "EMG biceps"))
        ]
        slow = signal(np.arange(4.0), sampling_frequency=1, label="Temp")
        place = tmp_path / f"arm.{kind.lower()}"
        write([*signals, slow]).write(place)
        found = read_recording(place)
        assert found.rate == 1000.0
        assert found.unit == "V"
        assert kind in found.said
        assert "1 signals at other rates left out" in found.said
        assert found.samples[:, ::-1] == pytest.approx(samples, abs=1e-3 * samples.max())
        place.write_bytes(place.read_bytes()[:700])
        with pytest.raises(RecordingError):
            read_recording(place)


def _chunk(tag: int, content: bytes) -> bytes:
    body = tag.to_bytes(2, "little") + content
    return b"\x04" + len(body).to_bytes(4, "little") + body


def test_xdf_is_read(tmp_path: Path) -> None:
    pytest.importorskip("pyxdf")
    samples = muscles(500.0)
    head = (
        "<?xml version='1.0'?><info><name>arm</name><type>EMG</type><channel_count>2</channel_count>"
        "<nominal_srate>500</nominal_srate><channel_format>double64</channel_format><desc><channels>"
        "<channel><label>biceps</label><unit>microvolts</unit></channel>"
        "<channel><label>triceps</label><unit>microvolts</unit></channel></channels></desc></info>"
    )
    one = (1).to_bytes(4, "little")
    content = b"\x04" + len(samples).to_bytes(4, "little")
    for k, each in enumerate(samples):
        content += b"\x08" + np.float64(10 + k / 500).tobytes() + (1e6 * each).astype("<f8").tobytes()
    footer = b"<?xml version='1.0'?><info><first_timestamp>10</first_timestamp></info>"
    place = tmp_path / "arm.xdf"
    place.write_bytes(
        b"XDF:"
        + _chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")
        + _chunk(2, one + head.encode())
        + _chunk(3, one + content)
        + _chunk(6, one + footer)
    )
    found = read_recording(place)
    assert (found.rate, found.unit, found.muscles) == (500.0, "V", ("biceps", "triceps"))
    assert found.samples == pytest.approx(samples, abs=1e-15)


@pytest.mark.parametrize("start", [b"0       ", b"\xffBIOSEMI", b"XDF:"])
def test_without_the_extra_one_line_names_it(start: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("edfio", "pyxdf"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(OptionalDependencyError, match=r"extra \[emg\] is not installed"):
        read_recording(_written(tmp_path / "arm.bin", start + bytes(300)))
    monkeypatch.undo()
    with pytest.raises(RecordingError, match=r"arm\.bin"):
        read_recording(tmp_path / "arm.bin")
