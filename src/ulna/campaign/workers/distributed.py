"""Batches on Dask workers: few tasks in flight, dead workers outlived."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from itertools import islice
from typing import Any

from distributed import Client, Future, wait
from distributed.comm.addressing import parse_address, parse_host_port
from distributed.comm.core import CommClosedError
from distributed.comm.registry import get_backend
from distributed.scheduler import KilledWorker

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
            opened = Client(address, timeout=timeout, set_as_default=False)
        except (OSError, ValueError) as error:
            found = f"nothing answers there within {timeout:g} s ({type(error).__name__})."
            raise CampaignError(f"the Dask scheduler '{address}'", found, hint) from None
        try:
            yield opened
        finally:
            opened.close()
    finally:
        log.setLevel(before)


def _check_address(address: str, hint: str) -> None:
    """Refuse what is no address before a client is made of it, which would try to close what never opened."""
    try:
        scheme, place = parse_address(address)
        get_backend(scheme)
        if scheme in ("tcp", "tls"):
            parse_host_port(place)
    except ValueError as error:
        raise CampaignError(f"the Dask scheduler '{address}'", f"this is no address ({error}).", hint) from None


def compute_by_dask(
    client: Client,
    settings: str,
    versions: Mapping[str, str],
    batches: Iterable[Batch],
    *,
    timeout: float,
    deaths: int,
) -> Iterator[tuple[Batch, bytes]]:
    """Each batch with its bytes, as they come. See `DaskWorkers`."""
    left = iter(batches)
    flying: dict[Future, Batch] = {}
    lost: dict[Batch, int] = {}

    def send(batch: Batch) -> None:
        # Impure: a task forgotten by a scheduler that began anew must not be mistaken for this one.
        future = client.submit(computed_batch, settings, dict(versions), *batch, 1, pure=False, retries=0)
        flying[future] = batch

    threads, looked = 0, -math.inf
    try:
        while True:
            if time.monotonic() > looked + LOOK:
                # Each look is a trip to the scheduler and back.
                threads, looked = _threads(client, timeout), time.monotonic()
            room = AHEAD * threads - len(flying)
            for batch in islice(left, max(0, room)):
                send(batch)
            if not flying:
                return
            for future in _finished(client, flying):
                batch = flying.pop(future)
                data = _result(future, batch, lost, deaths)
                if data is None:
                    send(batch)
                else:
                    future.release()
                    yield batch, data
    except CommClosedError as error:
        raise _gone() from error
    finally:
        # Without a scheduler there is nothing left to cancel.
        with suppress(OSError):
            client.cancel(list(flying))


def _finished(client: Client, flying: Mapping[Future, Batch]) -> list[Future]:
    try:
        with client.as_current():
            wait(list(flying), timeout=LOOK, return_when="FIRST_COMPLETED")
    except TimeoutError:
        return []
    except CancelledError:
        pass
    return [future for future in flying if future.status != "pending"]


def _result(future: Future, batch: Batch, lost: dict[Batch, int], deaths: int) -> bytes | None:
    """The bytes of a batch; None where the workers died over it and it is to be sent again."""
    try:
        return future.result()
    except (KilledWorker, CancelledError) as error:
        lost[batch] = lost.get(batch, 0) + 1
        if lost[batch] > deaths:
            raise CampaignError(
                f"runs {batch[0]} to {batch[1] - 1} of the campaign",
                f"{lost[batch]} workers died over them ({error}).",
                "Look at the workers' logs; batches that are done are safe. Smaller batches need less memory.",
            ) from None
        return None


def _threads(client: Client, timeout: float) -> int:
    """Threads of all workers; waits for a worker to come where there is none.

    Raises:
        CampaignError: no worker within the timeout, or no scheduler any more.
    """
    until = time.monotonic() + timeout
    while True:
        if client.status not in ("running", "connecting"):
            break
        try:
            counts: Any = client.nthreads()
            threads = sum(counts.values())
        except OSError:
            break
        if threads:
            return threads
        if time.monotonic() > until:
            raise CampaignError(
                "a campaign on a cluster",
                f"the scheduler has had no workers for {timeout:g} s.",
                "Start some where ulna is installed: `dask worker ADDRESS`. Batches that are done are safe.",
            )
        time.sleep(LOOK)
    raise _gone()


def _gone() -> CampaignError:
    return CampaignError(
        "a campaign on a cluster",
        "the scheduler is gone.",
        "Start it and the campaign again; batches that are done are safe.",
    )
