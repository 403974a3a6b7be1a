"""`Job`: what an engine for many runs is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ulna.sim.inputs import Input
from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Job:
    """What an engine is asked for: all arrays have one row for each run.

    Attributes:
        initial: (N, n). parameters: (N, p) in the plant's order. inputs: what drives the plant's inputs alike in all
            runs. own_inputs, references: what each run adds, by name: (N,).
        controller: states of estimator and controller at the start of each run, by name: (N,); the others as in the
            loop. targets: (N, outputs). seeds: (N,) uint64.
    """

    plant: System
    horizon: float
    initial: np.ndarray
    parameters: np.ndarray
    inputs: Mapping[str, Input]
    own_inputs: Mapping[str, np.ndarray]
    references: Mapping[str, np.ndarray]
    controller: Mapping[str, np.ndarray]
    targets: np.ndarray
    seeds: np.ndarray
    threads: int
