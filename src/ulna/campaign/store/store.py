"""`Store`: where the batches of a campaign are kept, and `MemoryStore`, which ends with the process."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Batch = tuple[int, int]
"""first, last: the runs first ≤ k < last, computed and stored together."""

FORMAT = 2
"""Of the manifest."""
MOST_BATCHES = 10_000_000
"""Each is a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a store holds, and all that is needed to compute it again bit for bit.

    Attributes:
        settings: text of the experiment. versions: of libraries. runs: how many. batch_size: runs of a batch.
    """

    settings: str
    versions: Mapping[str, str]
    runs: int
    batch_size: int

    @property
    def batches(self) -> list[Batch]:
        """All batches, in order."""
        return [(first, min(first + self.batch_size, self.runs)) for first in range(0, self.runs, self.batch_size)]

    def to_text(self) -> str:
        """What stands in the file."""
        data = {
            "format": FORMAT,
            "runs": self.runs,
            "batch_size": self.batch_size,
            "versions": dict(self.versions),
            "settings": json.loads(self.settings),
        }
        return json.dumps(data, indent=1, ensure_ascii=False) + "\n"

    @classmethod
    def from_mapping(cls, data: Any) -> Manifest:
        """The manifest of what stood in a file.

        Raises:
            KeyError, TypeError, ValueError: for anything else.
        """
        if data["format"] != FORMAT:
            raise ValueError(f"format {data['format']} instead of {FORMAT}")
        runs, batch_size = data["runs"], data["batch_size"]
        if not (isinstance(runs, int) and isinstance(batch_size, int) and batch_size >= 1 and 1 <= runs <= 10**12):
            raise ValueError(f"{runs!r} runs in batches of {batch_size!r}")
        if runs > batch_size * MOST_BATCHES:
            raise ValueError(f"{runs // batch_size} batches, at most {MOST_BATCHES} are possible")
        return cls(
            settings=json.dumps(data["settings"], ensure_ascii=False, allow_nan=False, separators=(",", ":")),
            versions=dict(data["versions"]),
            runs=runs,
            batch_size=batch_size,
        )


class Store(ABC):
    """Where batches are kept.

    Args:
        manifest: of the campaign.
    """

    def __init__(self, manifest: Manifest) -> None:
        self.manifest = manifest

    @abstractmethod
    def done(self) -> set[Batch]:
        """The batches that are there; each was whole when it was written."""

    @abstractmethod
    def put(self, batch: Batch, data: bytes) -> None:
        """Keep a batch."""

    @abstractmethod
    def get(self, batch: Batch) -> bytes:
        """A batch that is there, checked."""

    @property
    def runs_done(self) -> int:
        """How many runs are there."""
        return sum(last - first for first, last in self.done())


class MemoryStore(Store):
    """A store that ends with the process.

    Args:
        manifest: of the campaign.
    """

    def __init__(self, manifest: Manifest) -> None:
        super().__init__(manifest)
        self._batches: dict[Batch, bytes] = {}

    def done(self) -> set[Batch]:
        """The batches that are there."""
        return set(self._batches)

    def put(self, batch: Batch, data: bytes) -> None:
        """Keep a batch."""
        self._batches[batch] = data

    def get(self, batch: Batch) -> bytes:
        """A batch."""
        return self._batches[batch]
