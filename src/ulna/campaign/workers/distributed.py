"""Batches on Dask workers: few tasks in flight, dead workers outlived, silent ones passed over."""

from __future__ import annotations

import asyncio
import logging
import math
import socket
import time
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from distributed import Client, Future, Security, wait
from distributed.comm.addressing import get_address_host_port, parse_address, parse_host_port
from distributed.comm.core import CommClosedError, connect
from distributed.comm.registry import get_backend
from distributed.scheduler import KilledWorker

from ulna.base import UlnaWarning
from ulna.campaign.errors import CampaignError
from ulna.campaign.store import Batch
from ulna.campaign.workers.computing import computed_batch

AHEAD = 3
"""Tasks in flight for each thread of the workers."""

LOOK = 0.5
"""s between two looks at how many workers there are, if any."""


@contextmanager
def connected(client: Any, address: str | None, timeout: float) -> Iterator[Client]:
    """A client of the scheduler, closed at the end if it was opened here.

    Raises:
        CampaignError: where nothing answers within the timeout.
    """
    if client is not None:
        yield client
        return
    hint = "Give an address such as tcp://10.0.0.1:8786, as `dask scheduler` prints it."
    _check_address(address or "", hint)
    # What goes wrong is said once, as an error.
    log = logging.getLogger("distributed.client")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        try:
            # A client that never opened tries to close until the process ends: first see whether anybody is there.
            with ThreadPoolExecutor(1) as outside:
                outside.submit(asyncio.run, _reached(str(address), timeout)).result()
            opened = Client(address, timeout=timeout, set_as_default=False)
        except TypeError:
            found = "it speaks TLS, and no certificates are set here."
            raise CampaignError(f"the Dask scheduler '{address}'", found, "docs/campaigns.md shows how.") from None
        except (OSError, RuntimeError, ValueError) as error:
            found = f"nothing answers there within {timeout:g} s ({type(error).__name__})."
            raise CampaignError(f"the Dask scheduler '{address}'", found, hint) from None
        try:
            yield opened
        finally:
            opened.close()
    finally:
        log.setLevel(before)


async def _reached(address: str, timeout: float) -> None:
    there = await connect(address, timeout=timeout, **Security().get_connection_args("client"))
    await there.close()


def _check_address(address: str, hint: str) -> None:
    """Refuse what is no address before a client is made of it, which would try to close what never opened."""
    try:
        scheme, place = parse_address(address)
        get_backend(scheme)
        if scheme in ("tcp", "tls"):
            parse_host_port(place)
    except ValueError as error:
        raise CampaignError(f"the Dask scheduler '{address}'", f"this is not an address ({error}).", hint) from None


def compute_by_dask(
    client: Client,
    settings: str,
    versions: Mapping[str, str],
    batches: Iterable[Batch],
    *,
    timeout: float,
    deaths: int,
    overdue: float,
) -> Iterator[tuple[Batch, bytes]]:
    """Each batch with its bytes, as they come. See `DaskWorkers`."""
    flight = _Flight(client=client, settings=settings, versions=versions, timeout=timeout, deaths=deaths)
    left, looked = iter(batches), -math.inf
    try:
        while True:
            if time.monotonic() > looked + LOOK:
                # Each look is a trip to the scheduler and back.
                flight.look(overdue)
                looked = time.monotonic()
            for batch in islice(left, max(0, AHEAD * flight.threads - len(flight.batches))):
                flight.send(batch)
            if not flight.futures:
                return
            for future in _finished(client, flight.futures):
                if future in flight.futures:
                    yield from flight.landed(future)
    except CommClosedError as error:
        raise _gone() from error
    finally:
        # Without a scheduler there is nothing left to cancel.
        with suppress(OSError):
            client.cancel(list(flight.futures))


@dataclass(slots=True, kw_only=True)
class _Flight:
    """What is being computed.

    Attributes:
        futures: the batch of each task, and when it was sent; an overdue batch has two.
        longest: s that a batch has taken from sending to landing, waiting for others included.
        silent: workers whose tasks are overdue; they get no more until one of theirs lands.
        threads: of the other workers.
        lost: how many workers died over a batch.
    """

    client: Client
    settings: str
    versions: Mapping[str, str]
    timeout: float
    deaths: int
    futures: dict[Future, tuple[Batch, float]] = field(default_factory=dict)
    longest: float = math.inf
    silent: set[str] = field(default_factory=set)
    others: list[str] = field(default_factory=list)
    threads: int = 0
    lost: dict[Batch, int] = field(default_factory=dict)
    said: bool = False

    @property
    def batches(self) -> set[Batch]:
        """The batches on their way."""
        return {batch for batch, _ in self.futures.values()}

    def send(self, batch: Batch) -> None:
        """Hand a batch out."""
        # Impure: a task forgotten by a scheduler that began anew must not be mistaken for this one.
        future = self.client.submit(
            computed_batch,
            self.settings,
            dict(self.versions),
            *batch,
            1,
            pure=False,
            retries=0,
            workers=self.others if self.silent else None,
        )
        self.futures[future] = (batch, time.monotonic())

    def look(self, overdue: float) -> None:
        """Count the workers, and give to others what is overdue: what takes `overdue` times the longest so far."""
        threads = _threads(self.client, self.timeout)
        now, twice = time.monotonic(), Counter(batch for batch, _ in self.futures.values())
        due = max(overdue * self.longest, self.timeout)
        late = {f: batch for f, (batch, sent) in self.futures.items() if now - sent > due and twice[batch] == 1}
        if late:
            keys = {f.key for f in late}
            scheduler: Any = self.client.scheduler
            at_work: Any = self.client.sync(scheduler.processing, workers=None, callback_timeout=self.timeout)
            self.silent |= {name for name, tasks in at_work.items() if keys & set(tasks)}
        self.others = [name for name in threads if name not in self.silent]
        self.threads = sum(threads[name] for name in self.others)
        if not self.others:
            # Nobody else is there: those that are silent may come back, others may join.
            self.silent, self.others, self.threads = set(), list(threads), sum(threads.values())
            return
        if late and not self.said:
            found = f"{len(late)} batches are overdue ({due:.3g} s) at {', '.join(sorted(self.silent)) or 'a worker'}"
            warnings.warn(
                UlnaWarning(f"{found}: they are given to others as well, and the first result counts."), stacklevel=2
            )
            self.said = True
        for batch in late.values():
            self.send(batch)

    def landed(self, future: Future) -> Iterator[tuple[Batch, bytes]]:
        """The batch of a task that is finished; sent again where nothing came of it."""
        batch, sent = self.futures.pop(future)
        rest = [f for f, (other, _) in self.futures.items() if other == batch]
        data = _result(future, batch, self.lost, self.deaths, self.timeout)
        if data is None:
            if not rest:
                self.send(batch)
            return
        took = time.monotonic() - sent
        self.longest = took if math.isinf(self.longest) else max(self.longest, took)
        if rest:
            # Of two the one sent first came from a worker that is at work again.
            if any(self.futures[f][1] > sent for f in rest):
                self.silent.clear()
            self.client.cancel(rest)
            for other in rest:
                del self.futures[other]
        future.release()
        yield batch, data


def _finished(client: Client, flying: Iterable[Future]) -> list[Future]:
    try:
        with client.as_current():
            wait(list(flying), timeout=LOOK, return_when="FIRST_COMPLETED")
    except TimeoutError:
        return []
    except CancelledError:
        pass
    return [future for future in flying if future.status != "pending"]


def _result(future: Future, batch: Batch, lost: dict[Batch, int], deaths: int, timeout: float) -> bytes | None:
    """The bytes of a batch; None where the workers died over it, or fell silent, and it is to be sent again."""
    try:
        return future.result(timeout=timeout)
    except (KilledWorker, CancelledError, TimeoutError) as error:
        lost[batch] = lost.get(batch, 0) + 1
        if lost[batch] > deaths:
            raise CampaignError(
                f"runs {batch[0]} to {batch[1] - 1} of the campaign",
                f"{lost[batch]} workers died over them ({error}).",
                "Look at the workers' logs; batches that are done are safe. Smaller batches need less memory.",
            ) from None
        return None


def _threads(client: Client, timeout: float) -> dict[str, int]:
    """Threads of each worker; waits for a worker to come where there is none.

    Raises:
        CampaignError: no worker within the timeout, a scheduler that is gone or does not answer.
    """
    until = time.monotonic() + timeout
    while client.status in ("running", "connecting"):
        try:
            threads: Any = client.nthreads(callback_timeout=timeout)
        except TimeoutError:
            # The trip that a scheduler's death cuts short may end here as well, before the client has noticed.
            scheduler: Any = client.scheduler
            if _nobody_listens(scheduler.address):
                break
            raise CampaignError(
                "a campaign on a cluster",
                f"the scheduler has not answered for {timeout:g} s.",
                "Resume it or start another one, then start the campaign again; batches that are done are safe.",
            ) from None
        except OSError:
            break
        if any(threads.values()):
            return threads
        if time.monotonic() > until:
            raise CampaignError(
                "a campaign on a cluster",
                f"the scheduler has had no workers for {timeout:g} s.",
                "Start some where ulna is installed: `dask worker ADDRESS`. Batches that are done are safe.",
            )
        time.sleep(LOOK)
    raise _gone()


def _nobody_listens(address: str) -> bool:
    """Whether a connection is refused there: the system lets one in for a frozen scheduler, not for a dead one."""
    try:
        socket.create_connection(get_address_host_port(address), timeout=LOOK).close()
    except TimeoutError:
        return False
    except OSError:
        return True
    except (NotImplementedError, ValueError):
        # A scheduler inside this process has no host and port.
        return False
    return False


def _gone() -> CampaignError:
    return CampaignError(
        "a campaign on a cluster",
        "the scheduler is gone.",
        "Start it, then the campaign again; batches that are done are safe.",
    )
