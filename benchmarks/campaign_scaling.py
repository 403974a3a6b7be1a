"""Campaigns: runs per second through the public API, stored on disk, and what a second Dask worker is worth.

The paper's closed loop with observer, 5 s, random load and resistance. The runs of a round are interleaved: one worker
process, two worker processes, each with one thread; efficiency is half of the ratio of their rates. The error is
checked beside the time: final states against single simulations of other code.

    python benchmarks/campaign_scaling.py [--runs 100000] [--rounds 3] [--samples 50]
"""

from __future__ import annotations

import argparse
import logging
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from distributed import Client, LocalCluster

import ulna
from ulna.campaign import CampaignResult, Cluster, Crew, Local, Measures, Random, Uniform, campaign
from ulna.campaign.replay import path


def paper_loop() -> ulna.ClosedLoop:
    arm = ulna.model("one_link_arm")
    fixed = arm.with_values()
    law = ulna.state_feedback(ulna.controller_form(fixed), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(fixed), ulna.Poles(-9, -10, -11))
    return ulna.close_loop(arm, ulna.compensator(law, observer))


def timed(loop: ulna.ClosedLoop, runs: int, samples: int, crew: Crew, seed: int) -> tuple[float, CampaignResult]:
    plan = Random(vary={"m2": Uniform(low=4, high=6), "Ra": Uniform(low=0.9, high=1.1)}, runs=runs, seed=seed)
    measures = Measures(outputs=("y",), effort=("u",), samples=samples)
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        result = campaign(
            loop, plan, measures, horizon=5.0, initial={"theta": 1.0}, store=Path(folder) / "runs", crew=crew
        )
        spent = time.perf_counter() - begun
        return spent, CampaignResult(store=copied(result))


def copied(result: CampaignResult) -> Any:
    """The store in memory: the folder goes away."""
    from ulna.campaign.store import Memory

    memory = Memory(result.store.manifest)
    for span in result.store.manifest.spans:
        memory.put(span, result.store.get(span))
    return memory


def error(result: CampaignResult) -> float:
    """Largest difference of the final state from `simulate`, over some runs."""
    names = [s.name for s in result.experiment.system.states]
    return max(
        float(np.abs(path(result.experiment, k).final_state - [result.run(k)[f"final_{n}"] for n in names]).max())
        for k in range(0, result.runs, max(1, result.runs // 20))
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=50)
    given = parser.parse_args()
    loop = paper_loop()
    clusters = [
        LocalCluster(
            n_workers=n, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=logging.ERROR
        )
        for n in (1, 2)
    ]
    clients = [Client(cluster, set_as_default=False) for cluster in clusters]
    crews: dict[str, Crew] = {"1 thread, this process": Local(threads=1), "2 threads, this process": Local(threads=2)}
    crews |= {f"{n} Dask worker{'s' * (n > 1)}": Cluster(client=c) for n, c in zip((1, 2), clients, strict=True)}
    for crew in crews.values():
        timed(loop, 20_000, given.samples, crew, seed=99)
    seconds: dict[str, list[float]] = {name: [] for name in crews}
    last: CampaignResult | None = None
    for seed in range(given.rounds):
        for name, crew in crews.items():
            spent, last = timed(loop, given.runs, given.samples, crew, seed)
            seconds[name].append(spent)
    print(f"{given.runs} runs of 5 s, figures on {given.samples} intervals, stored on disk")
    for name, spent in seconds.items():
        rate = given.runs / float(np.median(spent))
        print(f"{name:24} {rate:12,.0f} runs/s {1e6 / rate:8.2f} us a run")
    for one, two in (("1 thread, this process", "2 threads, this process"), ("1 Dask worker", "2 Dask workers")):
        ratio = float(np.median(np.array(seconds[one]) / np.array(seconds[two])))
        print(f"{one} -> {two}: {ratio:.2f} times as fast, efficiency {ratio / 2:.0%}")
    if last is not None:
        print(f"largest difference from single simulations: {error(last):.1e}")
    for client, cluster in zip(clients, clusters, strict=True):
        client.close()
        cluster.close()


if __name__ == "__main__":
    main()
