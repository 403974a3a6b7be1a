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

from ulna.campaign import CampaignError, CampaignResult, Cluster, Measures, Random, Uniform, campaign, open_campaign

pytest.importorskip("distributed")

PLAN = Random(vary={"x": Uniform(low=-1, high=1), "k": Uniform(low=1, high=9)}, runs=240, seed=5)
MEASURES = Measures(outputs=("y",), effort=("u",), samples=50)


def run(**how) -> CampaignResult:
    return campaign(SPRING, PLAN, MEASURES, horizon=3.0, **how)


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


@pytest.fixture
def scheduler() -> Iterator[str]:
    port = free_port()
    process = started(
        "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--no-show"
    )
    try:
        until = time.monotonic() + 60
        while time.monotonic() < until:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.1)
        yield f"tcp://127.0.0.1:{port}"
    finally:
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
        there = run(crew=Cluster(address=scheduler, timeout=60.0), store=tmp_path / "a", part=4, progress=kill_one)
    finally:
        stopped(workers)
    assert killed
    assert workers[0].returncode == -signal.SIGKILL
    for found in (there, open_campaign(tmp_path / "a")):
        for column in local.columns:
            assert found[column.name].tobytes() == local[column.name].tobytes(), column.name


@pytest.mark.slow
def test_a_scheduler_without_workers_is_one_clear_error(scheduler: str) -> None:
    with pytest.raises(CampaignError, match="no workers for 1 s"):
        run(crew=Cluster(address=scheduler, timeout=1.0))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{port}", "127.0.0.1:{port}", "nonsense://x"])
def test_an_unreachable_scheduler_is_one_clear_error_soon(address: str, tmp_path: Path) -> None:
    begun = time.monotonic()
    with pytest.raises(CampaignError, match="nothing answers there"):
        run(crew=Cluster(address=address.format(port=free_port()), timeout=1.0), store=tmp_path / "a")
    assert time.monotonic() - begun < 20


@pytest.mark.parametrize(
    "make",
    [
        Cluster,
        lambda: Cluster(address="tcp://x", client=3),
        lambda: Cluster(address="tcp://x", timeout=0.0),
    ],
)
def test_a_cluster_that_makes_no_sense_is_refused(make) -> None:
    with pytest.raises(CampaignError, match="Cluster"):
        make()
