"""Fewer choices and comparisons, the same bits."""

from __future__ import annotations

import math

import numpy as np
from compilers import same_bits
from random_kernels import points, random_kernel

from ulna.program import Assembly, Operation, condensed, to_numpy


def test_every_bit_of_random_kernels_stays() -> None:
    shorter = 0
    for seed in range(300):
        kernel = random_kernel(seed)
        found = condensed(kernel)
        x = points(len(kernel.inputs), 60, seed)
        with np.errstate(all="ignore"):
            columns = [np.broadcast_to(a, x.shape[1:]) for k in (kernel, found) for a in to_numpy(k)(*x)]
        half = len(columns) // 2
        assert same_bits(columns[:half], columns[half:]), seed
        shorter += found.operation_count < kernel.operation_count
    assert shorter > 20


def test_what_guards_and_limiters_leave_behind_goes() -> None:
    w = Assembly("guarded")
    x, begun, old = w.input("x"), w.input("begun"), w.input("old")
    good = abs(x).less(math.inf)
    fault = begun.where(good.where(0.0, math.nan), good.where(0.0, math.nan))
    limited = w.input("x").more(math.inf).where(math.inf, x)
    kernel = w.finished(
        {
            "kept": begun.where(good.where(x, old), old),
            "fault": fault.equals(0.0).apply(Operation.NOT),
            "limited": limited,
        }
    )
    found = condensed(kernel)
    operations = [each.operation.value for each in found.instructions]
    assert sorted(operations) == ["abs", "and", "constant", "less", "not", "select"]
    assert found.results[found.outputs.index("limited")] == found.inputs.index("x")
