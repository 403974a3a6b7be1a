"""Recordings in EDF, BDF and XDF, by the readers that are kept for them (extra `emg`)."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ulna.base import OptionalDependencyError, UlnaError, printable
from ulna.studies.prosthesis.emg_channels import Channels
from ulna.studies.prosthesis.emg_signal import RecordingError

_UNITS = {
    "v": "V",
    "volts": "V",
    "mv": "mV",
    "millivolts": "mV",
    "uv": "uV",
    "µv": "uV",
    "μv": "uV",
    "microvolts": "uV",
}
_BEGINNINGS = ((b"0       ", "EDF"), (b"\xffBIOSEMI", "BDF"), (b"XDF:", "XDF"))


def read_format(source: Path) -> Channels | None:
    """The channels of an EDF, BDF or XDF file; None for a file that begins like none of them.

    Raises:
        OptionalDependencyError: without the extra.
        RecordingError: a file that its reader refuses, channels at different rates.
    """
    try:
        with source.open("rb") as stream:
            beginning = stream.read(8) if source.is_file() else b""
    except OSError:
        return None  # the reader of texts says why
    kind = next((name for start, name in _BEGINNINGS if beginning.startswith(start)), None)
    if kind is None:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _xdf(source) if kind == "XDF" else _edf(source, kind)
    except (UlnaError, MemoryError):
        raise
    except ImportError:
        raise OptionalDependencyError(f"a recording in {kind}", "emg") from None
    except Exception as error:
        raise RecordingError(
            f"the recording '{source}'", f"its {kind} cannot be read: {str(error)[:120]}.", "Export it again."
        ) from error


def _edf(source: Path, kind: str) -> Channels:
    import edfio

    file: Any = (edfio.read_bdf if kind == "BDF" else edfio.read_edf)(source)
    if str(getattr(file, "reserved", "")).strip().endswith("D"):
        raise RecordingError(f"the recording '{source}'", "it is interrupted (EDF+D).", "Export its whole pieces.")
    signals = [each for each in file.signals if "status" not in each.label.lower()]
    if not signals:
        raise RecordingError(f"the recording '{source}'", "it holds no signals.")
    rates = [float(each.sampling_frequency) for each in signals]
    muscles = [k for k, each in enumerate(signals) if "emg" in each.label.lower()]
    rate = rates[muscles[0]] if muscles else max(rates)
    kept = [k for k, each in enumerate(rates) if each == rate]
    return _channels(
        source,
        rate,
        np.column_stack([np.asarray(signals[k].data, dtype=float) for k in kept]),
        [signals[k].label for k in kept],
        [signals[k].physical_dimension for k in kept],
        kind,
        left=len(signals) - len(kept),
    )


def _xdf(source: Path) -> Channels:
    import pyxdf

    # It logs what it finds in a damaged file, with tracebacks, before it raises or hands over what is left.
    logger = logging.getLogger("pyxdf")
    before = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        streams, _ = pyxdf.load_xdf(str(source))
    finally:
        logger.setLevel(before)
    numeric = [
        each
        for each in streams
        if isinstance(each["time_series"], np.ndarray)
        and len(each["time_series"]) > 2
        and _info(each, "type") != "Markers"
    ]
    named = [each for each in numeric if "emg" in f"{_info(each, 'type')} {_info(each, 'name')}".lower()]
    usable = named or numeric
    if len(usable) != 1:
        names = ", ".join(str(_info(each, "name")) for each in usable) or "none"
        raise RecordingError(
            f"the recording '{source}'",
            f"one stream of muscle signals is needed, it has: {names}.",
            "Export one stream.",
        )
    stream = usable[0]
    times = np.asarray(stream["time_stamps"], dtype=float)
    stated = float(_info(stream, "nominal_srate") or 0)
    steps = np.diff(times)
    if not (steps > 0).all():
        raise RecordingError(f"the recording '{source}'", "its times go back.", "Export it as CSV and cut it.")
    rate = stated or float(f"{1 / np.median(steps):.9g}")
    rows = np.concatenate([[0], np.cumsum(np.maximum(1, np.round(steps * rate)))]).astype(np.int64)
    if rows[-1] > 2 * len(rows):
        raise RecordingError(f"the recording '{source}'", "more than half of its samples are missing.", "Record again.")
    values = np.full((int(rows[-1]) + 1, stream["time_series"].shape[1]), np.nan)
    values[rows] = stream["time_series"]
    labels, units = _xdf_labels(stream, values.shape[1])
    return _channels(source, rate, values, labels, units, "XDF", left=0)


def _info(stream: Any, key: str) -> Any:
    found = stream["info"].get(key) or [""]
    return found[0]


def _xdf_labels(stream: Any, count: int) -> tuple[list[str], list[str]]:
    try:
        listed = stream["info"]["desc"][0]["channels"][0]["channel"]
    except (KeyError, IndexError, TypeError):
        listed = []
    if len(listed) != count:
        return [""] * count, [""] * count
    return [str((each.get("label") or [""])[0]) for each in listed], [
        str((each.get("unit") or [""])[0]) for each in listed
    ]


def _channels(
    source: Path, rate: float, samples: np.ndarray, labels: list[str], units: list[str], kind: str, *, left: int
) -> Channels:
    return Channels(
        source=source,
        names=tuple(printable(str(each)).strip()[:60] for each in labels),
        numbers=tuple(range(1, len(labels) + 1)),
        units=tuple(_UNITS.get(str(each).strip().lower(), "") for each in units),
        samples=samples,
        rate=rate,
        said=(kind, f"{left} signals at other rates left out" if left else ""),
    )
