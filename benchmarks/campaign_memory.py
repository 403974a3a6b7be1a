"""Memory of a campaign and of its answers for ever more runs: it must not grow with them.

Each count of runs has a process of its own, whose largest resident size is printed after the campaign and after every
question. The loop is a small one, looked at on few intervals, so that ten million runs take minutes.

    python benchmarks/campaign_memory.py [--runs 100000 1000000 10000000] [--plan random|latin|sobol|saltelli]
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ulna.campaign import (
    CampaignResult,
    LatinHypercube,
    Measures,
    Random,
    Saltelli,
    Sobol,
    Uniform,
    quantiles,
    sensitivity,
    settled_fraction,
    settled_map,
    sweep,
    worst_cases,
)
from ulna.system import system_from_mapping

SPRING = {
    "name": "spring",
    "states": {"x": "v", "v": "-k*x - 2*v"},
    "outputs": {"y": "x"},
    "parameters": {"k": {"value": 4}},
}
VARY = {"x": Uniform(low=1, high=2), "k": Uniform(low=1, high=9)}


def plan_of(kind: str, runs: int) -> Any:
    if kind == "saltelli":
        return Saltelli(vary=VARY, base=2 ** max(1, (runs // (len(VARY) + 2)).bit_length() - 1))
    return {"random": Random, "latin": LatinHypercube, "sobol": Sobol}[kind](vary=VARY, runs=runs)


def peak() -> float:
    """Largest resident size of this process so far, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def told(what: str, work: Callable[[], Any]) -> Any:
    begun = time.process_time()
    found = work()
    print(f"  {what:32} {peak():8.0f} MiB {time.process_time() - begun:9.2f} s (CPU)", flush=True)
    return found


def look(kind: str, runs: int) -> None:
    """One count of runs, in a process that did nothing before."""
    loop = system_from_mapping(SPRING)
    measures = Measures(samples=10)
    sweep(loop, plan_of(kind, 1000), measures, horizon=5.0)
    plan = plan_of(kind, runs)
    print(f"{plan.count} runs, plan {type(plan).__name__}; before: {peak():.0f} MiB", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "runs"
        result: CampaignResult = told("campaign", lambda: sweep(loop, plan, measures, horizon=5.0, store=store))
        told("settled_fraction", lambda: settled_fraction(result))
        told("worst_cases", lambda: worst_cases(result, "peak_error_y"))
        told("quantiles", lambda: quantiles(result))
        told("settled_map", lambda: settled_map(result, "x", "k"))
        if kind == "saltelli":
            told("sensitivity", lambda: sensitivity(result, "peak_error_y"))
        told("to_xarray", result.to_xarray)
        told("to_netcdf", lambda: result.to_netcdf(Path(folder) / "runs.nc"))
        print(
            f"  one column as an array: {result['final_x'].nbytes / 2**20:.0f} MiB, then {peak():.0f} MiB", flush=True
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, nargs="+", default=[100_000, 1_000_000, 10_000_000])
    parser.add_argument("--plan", choices=["random", "latin", "sobol", "saltelli"], default="random")
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.alone:
        look(given.plan, given.runs[0])
        return
    for runs in given.runs:
        alone = [sys.executable, __file__, "--alone", "--plan", given.plan, "--runs", str(runs)]
        subprocess.run(alone, check=True)  # noqa: S603 (this very script)


if __name__ == "__main__":
    main()
