"""Which columns of a recording are the two muscles."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ulna.studies.prosthesis.emg_signal import RecordingError

_FLEXOR = re.compile(r"flex|bicep|brachi|\bfcr\b|\bfcu\b|\bfds\b|\bbb\b", re.IGNORECASE)
_EXTENSOR = re.compile(r"exten|tricep|\becr\b|\becu\b|\bedc?\b|\btb\b", re.IGNORECASE)
_OTHER = re.compile(
    r"class|label|marker|event|trigger|annot|comment|status|batter|subject|repet|stimul|gesture|"
    r"acc|gyr|mag|quat|angle|force|torque|temp|heart|ecg|eeg|eog|counter|^other|^analog|^digital|^[io]\d$",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Channels:
    """Signals side by side at one rate; NaN where a sample was lost.

    Attributes:
        names, numbers, units: of the columns; numbers count the columns of the file from 1 on.
        samples: (N, C). lines: (N,) of the file, None where it has none.
        said: what was found out about the file.
    """

    source: Path
    names: tuple[str, ...]
    numbers: tuple[int, ...]
    units: tuple[str, ...]
    samples: np.ndarray
    rate: float
    said: tuple[str, ...]
    lines: np.ndarray | None = None


def chosen_channels(channels: Channels, muscles: Sequence[str]) -> Channels:
    """Flexor and extensor, or the one muscle; a name where the file has none.

    Raises:
        RecordingError: none, a name that is unknown or fits several, more than two without a choice.
    """
    if isinstance(muscles, str):
        muscles = [each.strip() for each in muscles.split(",")]
    if not channels.names:
        raise RecordingError(
            f"the recording '{channels.source}'", "it has no channels besides the time.", "At least one is needed."
        )
    if len(muscles) > 2:
        raise RecordingError(
            f"the recording '{channels.source}'", f"{len(muscles)} muscles are asked for, expected at most two."
        )
    if muscles:
        columns = [_column(channels, str(each)) for each in muscles]
        if len(set(columns)) < len(columns):
            raise RecordingError(
                f"the recording '{channels.source}'", "one muscle is asked for twice.", _choice(channels)
            )
        return _taken(channels, columns, "")
    live = [j for j in range(len(channels.names)) if not _OTHER.search(channels.names[j])]
    live = live or list(range(len(channels.names)))
    if len(live) > 2:
        live = [j for j in live if np.nanstd(channels.samples[:, j]) > 0] or live
    flexors = [j for j in live if _FLEXOR.search(channels.names[j]) and not _EXTENSOR.search(channels.names[j])]
    extensors = [j for j in live if _EXTENSOR.search(channels.names[j])]
    left = len(channels.names) - 2
    if len(flexors) == 1 and len(extensors) == 1:
        words = f"{left} other columns left out" if left > 0 else ""
        swapped = "flexor and extensor by their names" if flexors[0] > extensors[0] else ""
        return _taken(channels, [flexors[0], extensors[0]], "; ".join(each for each in (words, swapped) if each))
    if len(live) > 2:
        raise RecordingError(
            f"the recording '{channels.source}'", f"it has {len(live)} channels, two are needed.", _choice(channels)
        )
    left = len(channels.names) - len(live)
    return _taken(channels, live, f"{left} other columns left out" if left > 0 else "")


def _column(channels: Channels, asked: str) -> int:
    exact = [j for j, name in enumerate(channels.names) if name == asked]
    alike = exact or [j for j, name in enumerate(channels.names) if name.lower() == asked.lower()]
    if not alike and asked.isdecimal():
        alike = [j for j, number in enumerate(channels.numbers) if number == int(asked)]
    alike = alike or [j for j, name in enumerate(channels.names) if asked and asked.lower() in name.lower()]
    if len(alike) != 1:
        what = "none has that name or number" if not alike else f"{len(alike)} columns fit it"
        raise RecordingError(f"the muscle '{asked[:60]}' of '{channels.source}'", f"{what}.", _choice(channels))
    return alike[0]


def _choice(channels: Channels) -> str:
    shown = [f"{number} {name}".strip() for number, name in zip(channels.numbers, channels.names, strict=True)]
    more = f" and {len(shown) - 12} more" if len(shown) > 12 else ""
    names = [name or str(number) for number, name in zip(channels.numbers, channels.names, strict=True)][:2]
    example = ", ".join(f"'{name}'" for name in names)
    return f"It has the columns {', '.join(shown[:12])}{more}. Choose by name or number: muscles=({example})."


def _taken(channels: Channels, columns: list[int], words: str) -> Channels:
    dead = [channels.names[j] for j in columns if not np.isfinite(channels.samples[:, j]).any()]
    if dead:
        raise RecordingError(f"the recording '{channels.source}'", f"the column '{dead[0]}' holds no numbers.")
    return replace(
        channels,
        names=tuple(channels.names[j] or f"column {channels.numbers[j]}" for j in columns),
        numbers=tuple(channels.numbers[j] for j in columns),
        units=tuple(channels.units[j] for j in columns),
        samples=channels.samples[:, columns],
        said=(*channels.said, words),
    )
