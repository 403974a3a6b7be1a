"""`Gpu`: many runs of a sampled loop on a graphics card, from the same source as on the processors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.base import OptionalDependencyError, SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Gpu:
    """The first CUDA device: a run for each of its threads. `FixedSteps(device=Gpu())`.

    Results agree with the processors' up to rounding: noise takes sine and logarithm of another library, and the
    compiler of the device may fuse more. It works in double precision and pays off from some 10⁴ runs on.

    Args:
        runs: of a batch; memory on the device does not grow beyond it.
        threads: of a block.

    Examples:
        >>> engine = ulna.FixedSteps(device=ulna.Gpu())
        >>> engine.device.runs
        262144
    """

    runs: int = 1 << 18
    threads: int = 64

    def __post_init__(self) -> None:
        if self.runs < 1 or not (1 <= self.threads <= 1024):
            raise SimulationError(
                f"Gpu(runs={self.runs}, threads={self.threads})",
                "expected at least one run, and 1 to 1024 threads in a block.",
            )

    @property
    def missing(self) -> str:
        """Why there is no device to run on, in words; empty where there is one."""
        try:
            from numba import cuda
        except ImportError:
            return "Numba is not installed"
        return "" if cuda.is_available() else "Numba finds no CUDA device, or no CUDA libraries for it"


def run_on_gpu(run: Any, device: Gpu, count: int, arrays: tuple[np.ndarray, ...], results: np.ndarray) -> None:
    """Fill the results batch by batch.

    Args:
        run: the compiled loop. device: where. count: samples after the first.
        arrays: numbers, what each run begins with, tables, samples of each run's own, seeds.

    Raises:
        SimulationError: where there is no device.
    """
    if device.missing:
        raise SimulationError("FixedSteps(device=Gpu())", f"{device.missing}.", "Leave out `device`.")
    try:
        from numba import cuda
    except ImportError:
        raise OptionalDependencyError("a GPU", "gpu") from None
    numbers, begin, shared, paths, seeds = arrays
    nothing = cuda.to_device(np.zeros((1, 1, 1)))
    alike = [cuda.to_device(array) for array in (numbers, shared)]
    for first in range(0, len(results), device.runs):
        rows = slice(first, min(first + device.runs, len(results)))
        size = rows.stop - rows.start
        own = paths[:, :, rows] if paths.shape[2] == len(results) else paths
        given = [cuda.to_device(np.ascontiguousarray(array)) for array in (begin[rows], own, seeds[rows])]
        answer = cuda.to_device(np.zeros((size, results.shape[1])))
        run[-(-size // device.threads), device.threads](
            0, size, count, alike[0], given[0], alike[1], given[1], given[2], answer, nothing
        )
        results[rows] = answer.copy_to_host()
