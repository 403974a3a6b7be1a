"""The same muscles in many layouts of text, as devices, programs and spreadsheets write them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


def muscles(rate: float, seconds: float = 4.0, *, seed: int = 0) -> np.ndarray:
    """(N, 2) V: quiet, then the first muscle, quiet, then the second one; nothing for the first 1.5 s."""
    count = int(rate * seconds)
    times = np.arange(count) / rate
    noise = np.random.default_rng(seed).standard_normal((count, 2))
    effort = np.full((count, 2), 2e-6)
    effort[(times > 1.5) & (times < 2.3), 0] = 4e-4
    effort[(times > 3.0) & (times < 3.7), 1] = 3e-4
    return effort * noise


@dataclass(frozen=True, kw_only=True)
class Layout:
    """How a file is written, and what the line about it must say."""

    key: str
    write: Callable[[np.ndarray], str | bytes]
    rate: float = 1000.0
    said: tuple[str, ...] = ()
    options: dict[str, object] = field(default_factory=dict)
    scale: float = 1.0
    """What is read for 1 V."""
    rounding: float = 1e-9
    one: bool = False
    envelope: bool = False


def rows(
    samples: np.ndarray,
    *,
    time: Callable[[int], str] | None = None,
    between: str = ",",
    value: str = ".9g",
    comma: bool = False,
    more: str = "",
) -> list[str]:
    """Lines of a time and the values."""
    lines = []
    for k, each in enumerate(samples):
        cells = [] if time is None else [time(k)]
        text = between.join([*cells, *(format(number, value) for number in each)]) + more
        lines.append(text.replace(".", ",") if comma else text)
    return lines


def _file(*above: str, **how: object) -> Callable[[np.ndarray], str]:
    return lambda samples: "\n".join([*above, *rows(samples, **how)]) + "\n"  # type: ignore[arg-type]


def _seconds(rate: float, places: int = 6) -> Callable[[int], str]:
    return lambda k: f"{k / rate:.{places}f}"


def _lost(samples: np.ndarray) -> str:
    lines = rows(samples, time=_seconds(1000))
    lines[100] = lines[100].split(",")[0] + ",,"
    lines[200] = lines[200].split(",")[0] + ",NaN,NaN"
    return "\n".join(["Time (s),EMG_flexor,EMG_extensor", *lines[:300], *lines[305:]])


def _open_bci(samples: np.ndarray) -> str:
    clock = np.floor(np.arange(len(samples)) / 8) * 8 / 250
    lines = [
        f"{k % 256}, {1e6 * a:.5f}, {1e6 * b:.5f}, 0.01, 0.02, 0.98, {1.6e9 + t:.5f}, 2020-09-13 12:26:{40 + t:09.6f}"
        for k, ((a, b), t) in enumerate(zip(samples, clock, strict=True))
    ]
    above = ["%OpenBCI Raw EXG Data", "%Number of channels = 2", "%Sample Rate = 250 Hz", "%Board = OpenBCI_GUI"]
    heads = "Sample Index, EXG Channel 0, EXG Channel 1, Accel Channel 0, Accel Channel 1, Accel Channel 2, Timestamp, "
    return "\n".join([*above, heads + "Timestamp (Formatted)", *lines])


def _open_signals(samples: np.ndarray) -> str:
    counts = np.round(512 + 1e6 * samples).astype(int)
    lines = [f"{k % 16}\t0\t0\t0\t0\t{a}\t{b}\t" for k, (a, b) in enumerate(counts)]
    head = '# {"20:15": {"sampling rate": 1000, "column": ["nSeq", "I1", "I2", "O1", "O2", "A1", "A2"]}}'
    return "\n".join(["# OpenSignals Text File Format", head, "# EndOfHeader", *lines])


def _envelope(samples: np.ndarray) -> np.ndarray:
    size = np.abs(samples)
    window = np.hanning(401) / np.hanning(401).sum()
    return np.stack([np.convolve(each, window, mode="same") for each in size.T], axis=1)


def _my_ware(samples: np.ndarray) -> str:
    smooth = np.round(60 + 2e6 * _envelope(samples)[:, :1]).astype(int)
    return "\n".join(["millis,envelope", *(f"{20 * k},{v[0]}" for k, v in enumerate(smooth[::20]))])


def _arduino(samples: np.ndarray) -> str:
    counts = np.round(512 + 1e6 * samples[:, :1]).astype(int)
    return "\n".join(["2", *(f"12:30:{5 + k // 500:02d}.{k % 500 * 2:03d} -> {v[0]}" for k, v in enumerate(counts))])


def _jitter(samples: np.ndarray) -> str:
    wobble = np.random.default_rng(3).uniform(-0.4, 0.4, len(samples))
    times = (np.arange(len(samples)) + wobble) / 1000
    return "\n".join(["time,flexor,extensor", *rows(samples, time=lambda k: f"{times[k]:.7f}")])


LAYOUTS = (
    Layout(key="plain", write=_file("time,flexor,extensor", time=_seconds(1000)), said=("s",)),
    Layout(key="no titles", write=_file(time=_seconds(1000))),
    Layout(key="milliseconds", write=_file("Time [ms],biceps,triceps", time=str), said=("; ms",)),
    Layout(key="time without unit", write=_file("time,biceps,triceps", time=str), said=("ms (no unit stated)",)),
    Layout(
        key="microseconds",
        write=_file("t_us\tbiceps\ttriceps", time=lambda k: str(k * 500), between="\t"),
        rate=2000.0,
        said=("; us", "tabs"),
    ),
    Layout(key="tabs", write=_file("time\tbiceps\ttriceps", time=_seconds(1000), between="\t"), said=("tabs",)),
    Layout(
        key="spaces",
        write=_file("  Time [s]   EMG flexor [mV]   EMG extensor [mV]", time=_seconds(1000), between="   "),
        scale=1e-3,
        said=("spaces",),
    ),
    Layout(key="spaces without titles", write=_file(time=_seconds(1000), between="  "), said=("spaces",)),
    Layout(
        key="semicolons",
        write=_file('"Zeit [s]";"Beuger [µV]";"Strecker [µV]"', time=_seconds(1000), between=";", comma=True),
        scale=1e-6,
        said=("semicolons", "decimal commas"),
    ),
    Layout(
        key="tabs and commas",
        write=_file("Time\tEMG1\tEMG2", "s\tmV\tmV", time=_seconds(1000), between="\t", comma=True),
        scale=1e-3,
        said=("decimal commas",),
    ),
    Layout(key="units", write=_file("time,biceps,triceps", "s,V,V", time=_seconds(1000)), said=()),
    Layout(
        key="three titles",
        write=_file(
            "Subject 7", "5 kg curl", "Sampling frequency: 1000 Hz", "Sample,EMG 1,EMG 2", time=lambda k: str(k + 1)
        ),
        said=("sample numbers, the rate in its titles",),
    ),
    Layout(
        key="sample numbers",
        write=_file("sample,a,b", time=str),
        rate=200.0,
        options={"rate": 200.0},
        said=("sample numbers, the rate given", "band 20 to 90 Hz"),
    ),
    Layout(key="no times", write=_file(between="\t"), options={"rate": 1000.0}, said=("no times, the rate given",)),
    Layout(
        key="numpy", write=_file("# fs = 2000", "# flexor extensor", between=" "), rate=2000.0, said=("in its titles",)
    ),
    Layout(key="lost", write=_lost, said=("7 lost samples bridged",)),
    Layout(key="rounded", write=_file("time,flexor,extensor", time=_seconds(1259.0, 4)), rate=1259.0),
    Layout(
        key="rounded to milliseconds", write=_file("time_ms,flexor,extensor", time=lambda k: str(k // 2)), rate=2000.0
    ),
    Layout(key="jitter", write=_jitter, said=("ms of clock jitter smoothed",)),
    Layout(
        key="mark",
        write=lambda s: ("\n".join(["time,flexor,extensor", *rows(s, time=_seconds(1000))])).encode("utf-8-sig"),
    ),
    Layout(
        key="spreadsheet",
        write=lambda s: "\r\n".join(["time\tflexor\textensor", *rows(s, time=_seconds(1000), between="\t")]).encode(
            "utf-16"
        ),
        said=("tabs",),
    ),
    Layout(
        key="eight channels",
        write=lambda s: "\n".join(
            [
                "time\t" + "\t".join(f"channel{k}" for k in range(1, 9)) + "\tclass",
                *(
                    f"{k}\t" + "\t".join([f"{a:.9g}", "1e-6", f"{b:.9g}", *["-2e-5"] * 5, "0"])
                    for k, (a, b) in enumerate(s)
                ),
            ]
        ),
        options={"muscles": ("channel1", "4")},
        said=("(channel1, channel3)",),
    ),
    Layout(
        key="open bci",
        write=_open_bci,
        rate=250.0,
        scale=1e6,
        rounding=1e-5,
        said=("the rate in its titles", "3 other columns left out"),
    ),
    Layout(
        key="open signals",
        write=_open_signals,
        scale=1e6,
        rounding=0.5,
        options={"muscles": ("A1", "A2")},
        said=("offset 512 removed",),
    ),
    Layout(
        key="arduino",
        write=_arduino,
        rate=500.0,
        scale=1e6,
        rounding=0.5,
        one=True,
        said=("1 muscle", "counts as silent"),
    ),
    Layout(key="my ware", write=_my_ware, rate=50.0, envelope=True, one=True, said=("envelopes", "1 muscle")),
    Layout(
        key="packets",
        write=_file("time,flexor,extensor", time=lambda k: f"{k // 8 * 0.04:.3f}"),
        rate=200.0,
        said=("clock jitter smoothed",),
    ),
    Layout(
        key="a comma at each end",
        write=_file("Time,s;Biceps,uV;Triceps,uV", time=_seconds(1500), between=";", more=";"),
        rate=1500.0,
        scale=1e-6,
        said=("(Biceps, Triceps)",),
    ),
    Layout(
        key="row numbers",
        write=lambda s: "\n".join(
            ["time,flexor,extensor", *(f"{k + 1},{each}" for k, each in enumerate(rows(s, time=_seconds(1000))))]
        ),
        said=("(flexor, extensor)",),
    ),
    Layout(
        key="lab chart",
        write=_file(
            "Interval=\t0.5 ms",
            "ChannelTitle=\tbiceps\ttriceps",
            "Range=\t10.000 V\t10.000 V",
            time=_seconds(2000),
            between="\t",
        ),
        rate=2000.0,
        said=("(biceps, triceps)",),
    ),
    Layout(
        key="acq knowledge",
        write=lambda s: "\n".join(
            ["record.acq", "0.5 msec/sample", "2 channels", "EMG100C\tEMG100D", *rows(s, between="\t")]
        ),
        rate=2000.0,
        said=("(EMG100C, EMG100D)",),
    ),
)
