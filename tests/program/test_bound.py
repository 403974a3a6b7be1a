"""A kernel with numbers filled in gives the bits of the whole kernel."""

from __future__ import annotations

import numpy as np
import pytest
from compilers import same_bits

from ulna.program import Assembly, Kernel, Operation, Plain, Precision, bound, in_arithmetic, to_numpy


def _kernel() -> Kernel:
    w = Assembly("kernel")
    x, a, b = w.input("x"), w.input("a"), w.input("b")
    turned = (a * b).apply(Operation.SIN) * x + a / b
    chosen = a.more(b).where(turned, x * x)
    return w.finished({"turned": turned, "chosen": chosen, "never": a / (b - b)})


@pytest.mark.parametrize("precision", Precision)
def test_bound_numbers_give_the_same_bits_with_fewer_operations(precision: Precision) -> None:
    whole = in_arithmetic(_kernel(), Plain(precision=precision))
    less = bound(whole, {"a": 0.7, "b": 0.3, "unknown": 1.0}, precision=precision)
    assert less.inputs == ("x",)
    assert less.operation_count < whole.operation_count / 5
    x = np.random.default_rng(0).normal(size=100)
    x[:3] = np.nan, np.inf, -0.0
    known = {"x": x, "a": np.full_like(x, 0.7), "b": np.full_like(x, 0.3)}
    expected = to_numpy(whole, precision=precision)(*(known[name] for name in whole.inputs))
    assert same_bits(to_numpy(less, precision=precision)(x), expected)


def test_numbers_of_another_precision_are_told_apart() -> None:
    single = bound(in_arithmetic(_kernel(), Plain()), {"a": 0.7, "b": 0.3}, precision=Precision.SINGLE)
    double = bound(in_arithmetic(_kernel(), Plain()), {"a": 0.7, "b": 0.3})
    assert to_numpy(single)(1.0)[0] != to_numpy(double)(1.0)[0]


def test_what_is_not_finite_is_computed_where_it_runs() -> None:
    less = bound(_kernel(), {"a": 0.7, "b": 0.3})
    assert less.operations[Operation.DIV] == 1
    assert to_numpy(less)(1.0)[2] == np.inf
