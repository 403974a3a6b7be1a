"""`Starts` and `Request`: what runs begin with, and which runs are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ulna.sim.inputs import Input
from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Starts:
    """What N runs begin with, in SI.

    Attributes:
        initial: (N, n) plant states. memory: (N,) by name: states of estimator and controller, estimates of an
            estimator whose linear part is known, driven inputs before the first command; 0 where left out.
        parameters: (N, p) of the plant, in its order. controller: parameters of the controller by name.
        inputs: what drives references and disturbances alike in all runs. own: (N,) what each run adds, by name.
        targets: (N, outputs). seeds: (N,).
    """

    initial: np.ndarray
    memory: Mapping[str, np.ndarray]
    parameters: np.ndarray
    controller: Mapping[str, float]
    inputs: Mapping[str, Input]
    own: Mapping[str, np.ndarray]
    targets: np.ndarray
    seeds: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Request:
    """Runs that are asked for.

    Attributes:
        system: whose states are the columns of `starts.initial`. times: (T,) s. starts: what the runs begin with.
        threads: how many to use.
    """

    system: System
    times: np.ndarray
    starts: Starts
    threads: int
