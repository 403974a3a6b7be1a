"""Campaigns on Dask: the same bits, dead workers outlived, silence told from work."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from campaign_loops import SPRING

from ulna.base import UlnaWarning
from ulna.campaign import (
    CampaignError,
    CampaignResult,
    DaskWorkers,
    LocalWorkers,
    Measures,
    Random,
    Uniform,
    open_campaign,
    sweep,
)

pytest.importorskip("distributed")

from ulna.campaign.workers.distributed import _nobody_listens

PLAN = Random(vary={"x": Uniform(low=-1, high=1), "k": Uniform(low=1, high=9)}, runs=240, seed=5)
MEASURES = Measures(outputs=("y",), effort=("u",), samples=50)


def run(**how) -> CampaignResult:
    return sweep(SPRING, PLAN, MEASURES, horizon=3.0, **how)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def started(module: str, *arguments: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", module, *arguments]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def worker(address: str) -> subprocess.Popen[bytes]:
    return started("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")


def stopped(processes: list[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.wait()


def started_scheduler() -> tuple[subprocess.Popen[bytes], str]:
    port = free_port()
    process = started(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--no-show"
    )
    until = time.monotonic() + 60
    while time.monotonic() < until:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                break
        time.sleep(0.1)
    return process, f"tcp://127.0.0.1:{port}"


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "batches").iterdir()}


@pytest.fixture
def scheduler() -> Iterator[str]:
    process, address = started_scheduler()
    yield address
    stopped([process])


@pytest.mark.slow
def test_workers_give_the_same_bits_and_one_that_is_killed_is_outlived(scheduler: str, tmp_path: Path) -> None:
    local = run()
    workers = [worker(scheduler), worker(scheduler)]
    killed = []

    def kill_one(now) -> None:
        if 0 < now.done < 120 and not killed:
            os.kill(workers[0].pid, signal.SIGKILL)
            killed.append(now.done)

    try:
        there = run(
            workers=DaskWorkers(address=scheduler, timeout=60.0), store=tmp_path / "a", batch_size=4, progress=kill_one
        )
    finally:
        stopped(workers)
    assert killed
    assert workers[0].returncode == -signal.SIGKILL
    for found in (there, open_campaign(tmp_path / "a")):
        for column in local.columns:
            assert found[column.name].tobytes() == local[column.name].tobytes(), column.name


@pytest.mark.slow
def test_a_worker_that_is_stopped_is_passed_over_and_said_once(scheduler: str) -> None:
    workers = [worker(scheduler), worker(scheduler)]
    halted = []

    def stop_one(now) -> None:
        if now.done > 40 and not halted:
            os.kill(workers[0].pid, signal.SIGSTOP)
            halted.append(now.done)

    try:
        with pytest.warns(UlnaWarning, match="overdue") as said:
            there = run(workers=DaskWorkers(address=scheduler, timeout=5.0), batch_size=4, progress=stop_one)
    finally:
        stopped(workers)
    assert halted
    assert len(said) == 1
    local = run()
    for column in local.columns:
        assert there[column.name].tobytes() == local[column.name].tobytes(), column.name


@pytest.mark.slow
def test_a_scheduler_that_is_stopped_is_one_clear_error() -> None:
    process, address = started_scheduler()
    workers = [worker(address)]

    def stop_it(now) -> None:
        if now.done >= 40:
            os.kill(process.pid, signal.SIGSTOP)

    try:
        with pytest.raises(CampaignError, match=r"has not answered for 5 s.*batches that are done are safe"):
            run(workers=DaskWorkers(address=address, timeout=5.0), batch_size=4, progress=stop_it)
    finally:
        stopped([*workers, process])


@pytest.mark.slow
def test_a_scheduler_that_dies_is_one_clear_error_and_the_campaign_goes_on_with_another(tmp_path: Path) -> None:
    process, address = started_scheduler()
    workers = [worker(address)]

    def kill_it(now) -> None:
        if now.done >= 40:
            process.kill()

    try:
        with pytest.raises(CampaignError, match=r"the scheduler is gone.*batches that are done are safe"):
            run(
                workers=DaskWorkers(address=address, timeout=30.0), store=tmp_path / "a", batch_size=4, progress=kill_it
            )
    finally:
        stopped([*workers, process])
    kept = files(tmp_path / "a")
    assert 10 <= len(kept) < 60
    process, address = started_scheduler()
    workers = [worker(address)]
    try:
        there = run(workers=DaskWorkers(address=address, timeout=60.0), store=tmp_path / "a", batch_size=4)
    finally:
        stopped([*workers, process])
    assert files(tmp_path / "a").items() >= kept.items()
    local = run()
    for column in local.columns:
        assert there[column.name].tobytes() == local[column.name].tobytes(), column.name


def test_a_dead_scheduler_is_told_from_a_frozen_one() -> None:
    assert _nobody_listens(f"tcp://127.0.0.1:{free_port()}")
    with socket.socket() as frozen:
        frozen.bind(("127.0.0.1", 0))
        frozen.listen()
        assert not _nobody_listens(f"tcp://127.0.0.1:{frozen.getsockname()[1]}")
    assert not _nobody_listens("inproc://127.0.0.1/1/1")


@pytest.mark.slow
def test_a_scheduler_without_workers_is_one_clear_error(scheduler: str) -> None:
    with pytest.raises(CampaignError, match="no workers for 1 s"):
        run(workers=DaskWorkers(address=scheduler, timeout=1.0))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{port}", "127.0.0.1:{port}", "tcp://127.0.0.1:99999"])
def test_an_unreachable_scheduler_is_one_clear_error(address: str, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="nothing answers there within 1 s"):
        run(workers=DaskWorkers(address=address.format(port=free_port()), timeout=1.0), store=tmp_path / "a")


def test_a_place_without_certificates_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="speaks TLS, and no certificates"):
        run(workers=DaskWorkers(address=f"tls://127.0.0.1:{free_port()}", timeout=1.0), store=tmp_path / "a")


@pytest.mark.parametrize("address", ["nonsense://x", "foo", "tcp://", ""])
def test_what_is_no_address_is_one_clear_error(address: str, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"this is not an address .* Give an address such as tcp"):
        run(workers=DaskWorkers(address=address, timeout=1.0), store=tmp_path / "a")


def test_a_cluster_gets_batches_for_many_workers() -> None:
    workers = DaskWorkers(address="tcp://127.0.0.1:1")
    assert workers.batch_size(100_000) * 50 < 100_000
    assert workers.batch_size(10**9) == LocalWorkers().batch_size(10**9)
    assert LocalWorkers().batch_size(3) == 3


@pytest.mark.parametrize(
    "make",
    [
        DaskWorkers,
        lambda: DaskWorkers(address="tcp://x", client=3),
        lambda: DaskWorkers(address="tcp://x", timeout=0.0),
        lambda: DaskWorkers(address="tcp://x", overdue=1.0),
    ],
)
def test_a_cluster_that_makes_no_sense_is_refused(make) -> None:
    with pytest.raises(CampaignError, match="DaskWorkers"):
        make()
