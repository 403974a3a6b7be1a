"""The rate of a recording and the samples it lost: from times, from sample numbers, or from what is stated."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from ulna.identification import Sheet
from ulna.studies.prosthesis.emg_signal import RecordingError

PLAUSIBLE = (10.0, 20_000.0)
"""Samples a second between which a unit of time that nobody stated must bring the rate."""
STRAYING = 0.03
"""s by which times may stray from even ones: nothing beside the 0.1 s in which an envelope rises."""
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
_TIME = re.compile(r"time(?!r)|zeit|temps|tiempo|tempo|^t$|^x$|^secs?$|seconds|^ms$|millis", re.IGNORECASE)
_INDEX = re.compile(r"sample|index|frame|^n$|^no\.?$|^nr\.?$|^nseq$|^#$|^i$|counter|point|^seq", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clock:
    """When the rows of a sheet were sampled.

    Attributes:
        rate: samples a second. rows: (N,) whole numbers that grow, the place of each row in an even grid.
        columns: those that are not muscles: times and sample numbers.
        said: where the rate comes from; what was smoothed.
    """

    rate: float
    rows: np.ndarray
    columns: frozenset[int]
    said: str


def read_clock(sheet: Sheet, rate: float | None) -> Clock:
    """The rate and the even grid of a sheet.

    Args:
        rate: samples a second that the user states; None: what the file says.

    Raises:
        RecordingError: times that go back, stray, or contradict the rate; no times and no rate.
    """
    if rate is not None and not (0 < rate < math.inf):
        raise RecordingError(f"a recording with rate={rate:g}", "expected a number above 0.")
    stated = rate if rate is not None else _stated_rate(sheet.titles)
    times, indices = _candidates(sheet)
    columns = frozenset(times + indices)
    failed: RecordingError | None = None
    for column in times:
        try:
            clock = _from_times(sheet, column, stated, asked=rate is not None, columns=columns)
        except RecordingError as error:
            failed = failed or error
            continue
        # Of a clock that jitters and sample numbers with a rate, the numbers tell what was lost.
        if not ("jitter" in clock.said and indices and stated is not None):
            return clock
    if failed is not None and not (indices and stated is not None):
        raise failed
    if stated is None:
        what = "it has sample numbers, but nothing says their rate." if indices else "no column holds times."
        raise RecordingError(f"the recording '{sheet.source}'", what, "Give the samples per second, rate=1000 say.")
    origin = "the rate given" if rate is not None else "the rate in its titles"
    if indices:
        steps = _unwrapped_steps(sheet, indices[0])
        return Clock(rate=stated, rows=_summed(steps), columns=columns, said=f"sample numbers, {origin}")
    return Clock(rate=stated, rows=np.arange(len(sheet.lines)), columns=columns, said=f"no times, {origin}")


def _candidates(sheet: Sheet) -> tuple[list[int], list[int]]:
    """Columns of times and of sample numbers; without names the first one, where it grows by even steps."""
    named = [j for j, name in enumerate(sheet.names) if _TIME.search(name) or sheet.units[j] in _SECONDS]
    numbered = [j for j, name in enumerate(sheet.names) if j not in named and _INDEX.search(name)]
    # 'time' before 'timestamp': what a computer wrote down when the data came is the last resort.
    named.sort(key=lambda j: "stamp" in sheet.names[j].lower())
    if named or numbered or len(sheet.lines) < 3:
        return named, numbered
    first = sheet.values[:, 0]
    steps = np.diff(first[np.isfinite(first)])
    if (
        len(steps)
        and np.median(steps) > 0
        and (steps >= 0).mean() > 0.9
        and np.median(steps) * 5 > np.abs(steps).mean()
    ):
        whole = bool((steps == 1).mean() > 0.5)
        return ([], [0]) if whole else ([0], [])
    return [], []


def _stated_rate(titles: str) -> float | None:
    """The samples a second that the titles state, as a rate or as an interval."""
    many = re.search(
        r"(?:sampl\w*|acquisition|\brate|frequency|\bfs\b|\bfreq)[^0-9\n]{0,30}?(\d+(?:[.,]\d+)?)\s*(k?)(?:hz|sps|/s|samples|\b)",
        titles,
        re.IGNORECASE,
    )
    step = re.search(
        r"(?:interval[^0-9\n]{0,12}(\d+(?:[.,]\d+)?)\s*(m?s)|(\d+(?:[.,]\d+)?)\s*(m?s)(?:ec)?\s*/\s*sample)",
        titles,
        re.IGNORECASE,
    )
    if step:
        value = float((step[1] or step[3]).replace(",", ".")) * _SECONDS[(step[2] or step[4]).lower()]
        return 1 / value if value else None
    if many:
        return float(many[1].replace(",", ".")) * (1000 if many[2] else 1) or None
    return None


def _from_times(sheet: Sheet, column: int, stated: float | None, *, asked: bool, columns: frozenset[int]) -> Clock:
    times = sheet.values[:, column]
    known = np.isfinite(times)
    steps = np.diff(times[known])
    back = np.flatnonzero(steps < 0)
    if len(back):
        line = sheet.lines[known][back[0] + 1]
        raise RecordingError(
            f"the recording '{sheet.source}'",
            f"time goes back in line {line}: {times[known][back[0] + 1]:g} after {times[known][back[0]]:g}.",
            "Cut it there, or sort it.",
        )
    if not known.all() or len(steps) < 2 or not steps.any():
        line = sheet.lines[~known][0] if not known.all() else sheet.lines[-1]
        what = "the time is missing" if not known.all() else "time stands still"
        raise RecordingError(f"the recording '{sheet.source}'", f"line {line}: {what}.", "Correct or delete that line.")
    step = _step(steps)
    unit, assumed = _unit(sheet, column, step, stated)
    scale = _SECONDS[unit]
    place = float(sheet.places[column]) * scale
    rows, jitter = _even(sheet, times * scale, step * scale, place)
    duration = (times[-1] - times[0]) * scale
    exact = rows[-1] / duration if not jitter else 1 / (float(np.polyfit(rows, times, 1)[0]) * scale)
    doubt = 2 * max(place, jitter) / duration + 1e-9
    smoothed = f", {1e3 * jitter:.2g} ms of clock jitter smoothed" if jitter else ""
    if stated is not None and abs(exact - stated) > max(1e-3, doubt) * stated:
        where = "its titles" if not asked else f"rate={stated:g}"
        raise RecordingError(
            f"the recording '{sheet.source}'",
            f"its times say {exact:.6g} samples a second, {where} {stated:.6g}.",
            "Give the rate that its times have, or leave out what is wrong.",
        )
    rate = (
        stated if stated is not None else float(round(exact)) if abs(exact - round(exact)) <= exact * doubt else exact
    )
    said = f"{unit}{' (no unit stated)' if assumed and unit != 's' else ''}{smoothed}"
    return Clock(rate=float(f"{rate:.9g}"), rows=rows, columns=columns, said=said)


def _step(steps: np.ndarray) -> float:
    """The mean step without those that jump over lost samples."""
    usual = float(np.median(steps[steps > 0]))
    mean = float(steps[steps < 2.5 * usual].mean())
    alike = steps[steps < 1.5 * mean]
    # Without jitter the steps over lost samples stand apart.
    return float(alike.mean()) if len(alike) and alike.std() < 0.15 * alike.mean() else mean


def _unit(sheet: Sheet, column: int, step: float, stated: float | None) -> tuple[str, bool]:
    """(unit of time, was it assumed)."""
    if sheet.units[column]:
        return sheet.units[column], False
    if "milli" in sheet.names[column].lower():
        return "ms", False
    for unit in ("s", "ms", "us"):
        rate = 1 / (step * _SECONDS[unit])
        if PLAUSIBLE[0] <= rate <= PLAUSIBLE[1] if stated is None else abs(rate / stated - 1) < 0.05:
            return unit, True
    rate = "" if stated is None else f", which is {stated:g} samples a second in no unit"
    raise RecordingError(
        f"the recording '{sheet.source}'",
        f"its times increase by {step:g}{rate}.",
        "Name the unit in the title: 'time [ms]'; or give the samples per second: rate=1000.",
    )


def _even(sheet: Sheet, times: np.ndarray, step: float, place: float) -> tuple[np.ndarray, float]:
    """(rows of the times in an even grid, s by which the clock jitters around it).

    Where the clock is good, a step of two or more is lost samples. Where it jitters, samples are lost only if the times
    stay late afterwards.
    """
    shares = np.diff(times) / step
    whole = np.round(shares)
    strays = float(np.abs(shares - whole).max())
    if strays <= 0.35 and (whole >= 1).all():
        return _summed(whole), 0.0
    rows = _summed(_moves(times, step, place))
    # Lost samples were in the first guess of the step; the second one is without them.
    step = float(times[-1] - times[0]) / float(rows[-1])
    rows = _summed(_moves(times, step, place))
    slope, offset = np.polyfit(rows, times, 1)
    worst = np.abs(times - offset - slope * rows)
    steps = np.diff(times)
    allowed = max(STRAYING, 0.6 * max(step, float(np.median(steps[steps > 0]))) + place)
    if worst.max() > allowed:
        line = sheet.lines[int(worst.argmax())]
        raise RecordingError(
            f"the recording '{sheet.source}'",
            f"its sampling is uneven: line {line} is {1e3 * worst.max():.3g} ms away from even steps of "
            f"{1e3 * step:.4g} ms; {1e3 * allowed:.3g} ms are tolerated.",
            "Resample it at one rate.",
        )
    # Rounding to the last place that is written down is not jitter.
    jitter = float(worst.max())
    return rows, 0.0 if jitter <= 1.1 * place else jitter


def _moves(times: np.ndarray, step: float, place: float) -> np.ndarray:
    """Rows from each time to the next one of a clock that jitters: more than one where the times stay late."""
    moves = np.ones(len(times) - 1)
    late = times - times[0] - step * np.arange(len(times))
    steps = np.diff(times)
    # Where the samples of a packet share one time, the usual step is that of packets.
    for k in np.flatnonzero(steps > 1.5 * max(step, float(np.median(steps[steps > 0]))) + place):
        before, after = late[max(0, k - 19) : k + 1], late[k + 1 : k + 21]
        lost = max(0, round(float(np.median(after) - np.median(before)) / step))
        moves[k] += lost
        late[k + 1 :] -= lost * step
    return moves


def _unwrapped_steps(sheet: Sheet, column: int) -> np.ndarray:
    """Steps of sample numbers, which some devices begin again at 0 after 15, 200 or 255."""
    numbers = sheet.values[:, column]
    if not np.isfinite(numbers).all():
        line = sheet.lines[~np.isfinite(numbers)][0]
        raise RecordingError(f"the recording '{sheet.source}'", f"line {line}: the sample number is missing.")
    steps = np.diff(numbers)
    usual = np.median(steps[steps > 0]) if (steps > 0).any() else 1.0
    size = numbers.max() - numbers.min() + usual
    around = steps < 0
    wraps = around.sum() > 0 and bool(np.isclose(steps[around], usual - size, atol=0.2 * size).all())
    steps = np.where(around, steps + size, steps) / usual if wraps else steps / usual
    bad = np.flatnonzero((steps < 0.5) | (np.abs(steps - np.round(steps)) > 1e-6))
    if len(bad):
        k = int(bad[0]) + 1
        raise RecordingError(
            f"the recording '{sheet.source}'",
            f"sample numbers do not increase in line {sheet.lines[k]}: {numbers[k]:g} after {numbers[k - 1]:g}.",
            "Cut it there.",
        )
    return np.round(steps)


def _summed(moves: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(moves)]).astype(np.int64)
