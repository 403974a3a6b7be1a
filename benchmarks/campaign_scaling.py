"""Campaigns: time a run through the public API, stored on disk, and what a second Dask worker is worth.

The paper's closed loop with observer, 5 s, random load and resistance; with `--sampled` the same plant under the same
compensator at 1 kHz, ±24 V, with an encoder of 12 bits. The workers of a round are interleaved, each with one thread.
Beside the wall clock stands CPU time, which other people's work on the machine disturbs less: of the workers, and of
all else (planning, scheduling, moving, writing; without what Dask takes when it idles). The workers' share of both
is the efficiency to expect where two workers and all else have two free cores. `engine alone` is the bare computation
of the same runs. The error is checked beside the time: final states against single simulations, which are other code.

    python benchmarks/campaign_scaling.py [--runs 100000] [--rounds 3] [--samples 50] [--sampled] [--only-dask]
"""

from __future__ import annotations

import argparse
import logging
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from distributed import Client, LocalCluster

import ulna
from ulna.campaign import (
    CampaignResult,
    DaskWorkers,
    Experiment,
    LocalWorkers,
    Measures,
    Random,
    Uniform,
    Workers,
    sweep,
)
from ulna.campaign.runs import experiment_of, path, run_batch, to_text

HORIZON = 5.0
START = {"theta": 1.0}


@dataclass(frozen=True, kw_only=True)
class Subject:
    """What is run."""

    loop: ulna.Loop
    measures: Measures | None

    def experiment(self, runs: int) -> Experiment:
        """For the bare engine."""
        measures = self.measures or Measures()
        found = Experiment(loop=self.loop, horizon=HORIZON, plan=plan(runs, 0), initial=START, measures=measures)
        return experiment_of(to_text(found))

    def run(self, runs: int, seed: int, store: Path, workers: Workers) -> CampaignResult:
        """The campaign."""
        return sweep(
            self.loop, plan(runs, seed), self.measures, horizon=HORIZON, initial=START, store=store, workers=workers
        )


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Seconds of a campaign: by the wall clock, CPU of the workers, CPU of all else beyond what idling takes."""

    wall: float
    workers: float
    rest: float


def plan(runs: int, seed: int) -> Random:
    return Random(vary={"m2": Uniform(low=4, high=6), "Ra": Uniform(low=0.9, high=1.1)}, runs=runs, seed=seed)


def subject(sampled: bool, samples: int) -> Subject:
    arm = ulna.model("one_link_arm")
    fixed = arm.with_values()
    law = ulna.state_feedback(ulna.controller_form(fixed), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(fixed), ulna.Poles(-9, -10, -11))
    compensator = ulna.compensator(law, observer)
    if not sampled:
        measures = Measures(outputs=("y",), effort=("u",), samples=samples)
        return Subject(loop=ulna.close_loop(arm, compensator), measures=measures)
    hardware = ulna.Hardware(
        period=1e-3,
        saturation=ulna.Saturation(lower=-24.0, upper=24.0),
        sensors=ulna.Quantiser(step=2 * np.pi / 4096),
    )
    return Subject(loop=ulna.Loop(plant=arm, controller=compensator, hardware=hardware), measures=None)


def engine_seconds(what: Subject, runs: int) -> float:
    """CPU seconds of the bare engine for a batch, of one run."""
    experiment = what.experiment(runs)
    run_batch(experiment, 0, runs)
    begun = time.process_time()
    run_batch(experiment, 0, runs)
    return (time.process_time() - begun) / runs


def idle_rate(seconds: float = 3.0) -> float:
    """CPU seconds a second of this process, which holds the schedulers, while nothing is to be done."""
    begun = time.process_time()
    time.sleep(seconds)
    return (time.process_time() - begun) / seconds


def measured(what: Subject, runs: int, seed: int, workers: Workers, spent: Callable[[], float]) -> tuple[Cost, float]:
    """Cost, and the error of some runs."""
    idle = idle_rate()
    with tempfile.TemporaryDirectory() as folder:
        there, here, begun = spent(), time.process_time(), time.perf_counter()
        result = what.run(runs, seed, Path(folder) / "runs", workers)
        wall = time.perf_counter() - begun
        cost = Cost(wall=wall, workers=spent() - there, rest=time.process_time() - here - idle * wall)
        return cost, error(result)


def error(result: CampaignResult) -> float:
    """Largest difference of the final state from `simulate`, over some runs."""
    names = [s.name for s in result.experiment.system.states]
    chosen = range(0, result.runs, max(1, result.runs // 8))
    runs = [(path(result.experiment, k).final_state, result.run(k)) for k in chosen]
    return max(float(np.abs(final - [run[f"final_{n}"] for n in names]).max()) for final, run in runs)


def cpu_of(client: Client) -> Callable[[], float]:
    """CPU seconds of all worker processes of a cluster so far."""

    def spent() -> float:
        answers: Any = client.run(time.process_time)
        return sum(answers.values())

    return spent


def report(given: argparse.Namespace, engine: list[float], costs: dict[str, list[Cost]]) -> None:
    runs = given.runs
    how = "sampled" if given.sampled else f"figures on {given.samples} intervals"
    print(f"{runs} runs of 5 s, {how}, stored on disk")
    print(f"us a run{'':18}{'wall':>10}{'CPU workers':>14}{'CPU rest':>10}")
    print(f"{'engine alone':24}{'':>12}{1e6 * min(engine):14.2f}")
    for name, spent in costs.items():
        columns = [1e6 / runs * min(getattr(c, kind) for c in spent) for kind in ("wall", "workers", "rest")]
        print(f"{name:26}{columns[0]:10.2f}{columns[1]:14.2f}{columns[2]:10.2f}")
    for one, two in (("1 thread", "2 threads"), ("1 Dask worker", "2 Dask workers")):
        if one not in costs:
            continue
        pairs = zip(costs[one], costs[two], strict=True)
        ratios = [first.wall / second.wall for first, second in pairs]
        print(f"{one} -> {two}: {np.median(ratios):.2f} times as fast, efficiency {np.median(ratios) / 2:.0%}")
    shares = [c.workers / (c.workers + c.rest) for c in costs["2 Dask workers"]]
    print(f"share of the workers in the CPU time of 2 Dask workers: {max(shares):.0%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=50)
    parser.add_argument("--sampled", action="store_true")
    parser.add_argument("--only-dask", action="store_true", help="leave out the threads of this process")
    given = parser.parse_args()
    logging.disable(logging.ERROR)  # Dask tells at length how it ends
    what = subject(given.sampled, given.samples)
    clusters = [
        LocalCluster(
            n_workers=n, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=logging.CRITICAL
        )
        for n in (1, 2)
    ]
    clients = [Client(cluster, set_as_default=False) for cluster in clusters]
    kinds: dict[str, tuple[Workers, Callable[[], float]]] = {
        "1 thread": (LocalWorkers(threads=1), lambda: 0.0),
        "2 threads": (LocalWorkers(threads=2), lambda: 0.0),
        "1 Dask worker": (DaskWorkers(client=clients[0]), cpu_of(clients[0])),
        "2 Dask workers": (DaskWorkers(client=clients[1]), cpu_of(clients[1])),
    }
    if given.only_dask:
        kinds = {name: kind for name, kind in kinds.items() if "Dask" in name}
    for workers, spent in kinds.values():
        measured(what, 2000, 99, workers, spent)
    costs: dict[str, list[Cost]] = {name: [] for name in kinds}
    engine, errors = [], []
    for seed in range(given.rounds):
        engine.append(engine_seconds(what, min(given.runs, 10_000)))
        for name, (workers, spent) in kinds.items():
            cost, off = measured(what, given.runs, seed, workers, spent)
            costs[name].append(cost)
            errors.append(off)
            print(f"round {seed}, {name}: {cost.wall:.1f} s, load {os.getloadavg()[0]:.1f}", flush=True)
    report(given, engine, costs)
    print(f"largest difference from single simulations: {max(errors):.1e}")
    for client, cluster in zip(clients, clusters, strict=True):
        client.close()
        cluster.close()


if __name__ == "__main__":
    main()
