"""Who computes the batches: `LocalWorkers` are threads of this process, `DaskWorkers` stand anywhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from ulna.base import OptionalDependencyError, cores
from ulna.campaign.errors import CampaignError
from ulna.campaign.store import Batch
from ulna.campaign.workers.computing import computed_batch

LARGEST_BATCH = 10_000
"""Runs of a batch at most, unless asked otherwise: seconds of work, a megabyte of results."""


@runtime_checkable
class Workers(Protocol):
    """Compute batches in any order, few at a time."""

    def batch_size(self, runs: int) -> int:
        """How many runs of so many are best computed and stored together."""
        ...

    def compute(
        self, settings: str, versions: Mapping[str, str], batches: Iterable[Batch]
    ) -> Iterator[tuple[Batch, bytes]]:
        """Each batch with its bytes, as they come."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalWorkers:
    """Threads of this process: the compiled loops let go of Python's lock.

    Args:
        threads: how many; by default one for each core this process may use.

    Raises:
        CampaignError: fewer than one.
    """

    threads: int | None = None

    def __post_init__(self) -> None:
        if self.threads is not None and self.threads < 1:
            raise CampaignError(f"LocalWorkers(threads={self.threads})", "expected at least one.")

    def batch_size(self, runs: int) -> int:
        """All threads work on one batch."""
        return min(runs, LARGEST_BATCH)

    def compute(
        self, settings: str, versions: Mapping[str, str], batches: Iterable[Batch]
    ) -> Iterator[tuple[Batch, bytes]]:
        """Each batch with its bytes. One batch is being computed while the one before is written."""
        threads = self.threads or cores()
        pool = ThreadPoolExecutor(1)
        waiting: list[tuple[Batch, Future[bytes]]] = []
        try:
            for batch in batches:
                waiting.append((batch, pool.submit(computed_batch, settings, versions, *batch, threads)))
                if len(waiting) > 1:
                    done, future = waiting.pop(0)
                    yield done, future.result()
            for done, future in waiting:
                yield done, future.result()
        finally:
            # Left early, nothing more is begun.
            pool.shutdown(wait=True, cancel_futures=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class DaskWorkers:
    """Workers of Dask distributed. A worker that dies is survived: its batches go to others.

    Args:
        address: of the scheduler, such as `tcp://10.0.0.1:8786`; or
        client: a `distributed.Client` that is connected already.
        timeout: s to wait for the scheduler, and for a worker where there is none.
        deaths: how many workers may die over the same batch.
        overdue: a batch is given to another worker as well when it takes so many times as long as the slowest so far,
            and longer than the timeout; whichever comes first counts. So a worker that is stopped holds nothing up.

    Raises:
        CampaignError: neither or both of address and client.
    """

    address: str | None = None
    client: Any = field(default=None, repr=False)
    timeout: float = 10.0
    deaths: int = 10
    overdue: float = 5.0

    def __post_init__(self) -> None:
        if (self.address is None) == (self.client is None):
            raise CampaignError("DaskWorkers()", "it needs either address= or client=.")
        if not self.timeout > 0:
            raise CampaignError(f"DaskWorkers(timeout={self.timeout})", "it must be positive.")
        if not self.overdue > 1:
            raise CampaignError(f"DaskWorkers(overdue={self.overdue})", "it must be greater than 1.")

    def batch_size(self, runs: int) -> int:
        """Batches for many workers, each still worth the trip."""
        return min(LARGEST_BATCH, max(-(-runs // 64), 500))

    def compute(
        self, settings: str, versions: Mapping[str, str], batches: Iterable[Batch]
    ) -> Iterator[tuple[Batch, bytes]]:
        """Each batch with its bytes.

        Raises:
            CampaignError: an unreachable or silent scheduler, no workers, workers with other libraries.
            OptionalDependencyError: without Dask.
        """
        try:
            from ulna.campaign.workers.distributed import compute_by_dask, connected
        except ImportError:
            raise OptionalDependencyError("a campaign on a cluster", "campaign") from None
        with connected(self.client, self.address, self.timeout) as client:
            yield from compute_by_dask(
                client,
                settings,
                versions,
                batches,
                timeout=self.timeout,
                deaths=self.deaths,
                overdue=self.overdue,
            )
