"""The loop on a GPU: the same source, the same numbers up to rounding."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sampled_loops import run_loop

from ulna.base import SimulationError
from ulna.loop import Jitter, MeasurementNoise, MissedSamples, Quantiser, Saturation
from ulna.sim import FixedSteps, Gpu, simulate
from ulna.system import system_from_mapping

ARM = system_from_mapping(
    {
        "name": "arm",
        "states": {"q": "v", "v": "u + d - k*sin(q)"},
        "inputs": {"u": {}, "d": {}},
        "outputs": {"y": "q"},
        "parameters": {"k": {"value": 1}},
    }
)
CONTROLLER = system_from_mapping(
    {
        "name": "controller",
        "states": {"a": "b + 8*(y - a)", "b": "sin(a) - 4*(a - r) - 3*b - sin(y) + 20*(y - a)"},
        "inputs": {"y": {}, "r": {}},
        "outputs": {"u": "sin(a) - 4*(a - r) - 3*b"},
    }
)
FIGURES = ("code", "end_time", "final_state", "peak_input", "rms_input", "overshoot", "steady_error", "peak_error")

# Runs this file's loop in Numba's simulator of a GPU and prints the figures.
SIMULATED = """
import json, sys
sys.path.insert(0, {folder!r})
sys.path.insert(0, {support!r})
from test_gpu import FIGURES, figures
from ulna.sim import Gpu
print(json.dumps({{name: values.tolist() for name, values in figures(7, 0.3, Gpu(runs=3, threads=1)).items()}}))
"""


def figures(runs: int, horizon: float, device: Gpu | None) -> dict[str, np.ndarray]:
    """Of some runs of a rough loop, one of which leaves its bound."""
    random = np.random.default_rng(2)
    loop = {
        "controller": CONTROLLER,
        "period": 0.01,
        "delay": 0.004,
        "saturation": Saturation(lower=-3.0, upper=3.0),
        "sensors": Quantiser.encoder(bits=12),
        "noise": MeasurementNoise(std=1e-3),
        "clock": (Jitter(width=2e-3), MissedSamples(probability=0.05)),
        "references": {"r": 0.2},
        "bound": 20.0,
        "device": device,
    }
    stiffness = random.uniform(0.5, 1.5, runs)
    stiffness[1] = -900.0
    done = run_loop(ARM, random.uniform(0.2, 1.0, (runs, 2)), horizon, loop, parameters={"k": stiffness})
    return {name: getattr(done, name) for name in FIGURES}


def _same(one: dict[str, Any], other: dict[str, Any]) -> None:
    for name in FIGURES:
        np.testing.assert_allclose(one[name], other[name], rtol=1e-9, atol=1e-11, err_msg=name)


def test_the_simulated_gpu_gives_what_the_processors_give() -> None:
    here = Path(__file__).parent
    script = SIMULATED.format(folder=str(here), support=str(here.parents[1] / "support"))
    done = subprocess.run(
        # Random numbers wrap round on purpose, of which NumPy warns.
        [sys.executable, "-W", "ignore", "-c", script],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    simulated = {name: np.array(values) for name, values in json.loads(done.stdout).items()}
    usual = figures(7, 0.3, None)
    assert sorted(usual["code"].tolist()) == [0, 0, 0, 0, 0, 0, 1]
    _same(simulated, usual)


def test_a_gpu_gives_what_the_processors_give() -> None:
    if Gpu().missing:
        pytest.skip(Gpu().missing)
    # Shorter than the first code that a rounding can flip.
    _same(figures(1000, 0.3, Gpu(runs=300)), figures(1000, 0.3, None))


def test_a_gpu_that_is_not_there_is_said_in_one_line() -> None:
    if not Gpu().missing:
        pytest.skip("there is one")
    with pytest.raises(SimulationError, match="no CUDA device"):
        figures(3, 0.1, Gpu())


def test_a_gpu_runs_sampled_loops_only_and_in_batches_of_some_size() -> None:
    with pytest.raises(SimulationError, match="once a period"):
        simulate(ARM, [0.0, 0.0], 1.0, engine=FixedSteps(device=Gpu()))
    for wrong in ({"runs": 0}, {"threads": 0}, {"threads": 2048}):
        with pytest.raises(SimulationError, match="expected at least one run"):
            Gpu(**wrong)
