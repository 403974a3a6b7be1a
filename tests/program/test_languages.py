"""A kernel in plain arithmetic means the same in every language, to the last bit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from compilers import GCC, by_c, by_node, by_numba, node, same_bits
from random_kernels import points, random_kernel

from ulna.base import FormulaError
from ulna.program import (
    Fused,
    InstructionList,
    Kernel,
    Operation,
    Plain,
    Precision,
    Scalar,
    in_arithmetic,
    to_c,
    to_javascript,
    to_numpy,
    to_python,
)

needs_gcc = pytest.mark.skipif(GCC is None, reason="there is no gcc")
needs_node = pytest.mark.skipif(node() is None, reason="there is no node")


def by_numpy(kernels: list[Kernel], x: np.ndarray, precision: Precision = Precision.DOUBLE) -> np.ndarray:
    return np.concatenate([to_numpy(k, precision=precision)(*x[: len(k.inputs)]) for k in kernels])


def plain(count: int, precision: Precision = Precision.DOUBLE, exclude: tuple[Operation, ...] = ()) -> list[Kernel]:
    return [in_arithmetic(random_kernel(k, exclude=exclude), Plain(precision=precision)) for k in range(count)]


# One of these takes Numba seconds to compile.
LONG = (Operation.POW, Operation.ASINH, Operation.ACOSH, Operation.ATANH, Operation.SINH, Operation.COSH)


def test_python_agrees_with_numpy() -> None:
    x, kernels = points(3, 10, 1), plain(12)
    scalars = [np.array([to_python(k)(*map(float, c[: len(k.inputs)])) for c in x.T]).T for k in kernels]
    assert same_bits(np.concatenate(scalars), by_numpy(kernels, x))


def test_numba_agrees_with_numpy() -> None:
    x, kernels = points(3, 300, 2), plain(5, exclude=LONG)
    assert same_bits(by_numba(kernels, x), by_numpy(kernels, x))


@needs_gcc
@pytest.mark.parametrize("precision", Precision)
def test_c_agrees_with_numpy(tmp_path: Path, precision: Precision) -> None:
    x, kernels = points(3, 300, 3), plain(25, precision)
    assert same_bits(by_c(kernels, x, tmp_path, precision), by_numpy(kernels, x, precision))


@needs_node
@pytest.mark.parametrize("precision", Precision)
def test_javascript_agrees_with_numpy(tmp_path: Path, precision: Precision) -> None:
    x, kernels = points(3, 300, 4), plain(25, precision)
    assert same_bits(by_node(kernels, x, tmp_path, precision), by_numpy(kernels, x, precision))


@needs_gcc
@pytest.mark.parametrize("precision", Precision)
def test_fused_kernels_agree_in_c(tmp_path: Path, precision: Precision) -> None:
    arithmetic = Fused(precision=precision)
    kernels = [in_arithmetic(random_kernel(k), arithmetic) for k in range(15)]
    x = points(3, 200, 5)
    assert same_bits(by_c(kernels, x, tmp_path, precision), by_numpy(kernels, x, precision))


def _one(operation: Operation, names: tuple[str, ...] = ("x",)) -> Kernel:
    out = InstructionList(len(names))
    first, *others = (Scalar(out, k) for k in range(len(names)))
    result = first.apply(operation, *others).index
    return Kernel(name="one", inputs=names, outputs=("y",), instructions=tuple(out.instructions), results=(result,))


@needs_gcc
@needs_node
def test_a_difference_in_the_last_bit_is_noticed(tmp_path: Path) -> None:
    x = points(3, 300, 6)
    fused = [in_arithmetic(random_kernel(k, exclude=LONG), Fused()) for k in range(8)]
    assert not same_bits(by_c(fused, x, tmp_path), by_numpy(plain(8, exclude=LONG), x))
    assert not same_bits(np.array([0.0]), np.array([-0.0]))
    assert not same_bits(np.array([1.0]), np.array([1.0 + 2.0**-52]))


@pytest.mark.parametrize("operation", [Operation.FMA, Operation.FLIP])
def test_javascript_refuses_what_it_cannot_round_once(operation: Operation) -> None:
    names = ("a", "b", "c") if operation is Operation.FMA else ("a", "b")
    with pytest.raises(FormulaError, match=r"JavaScript has no operation .*\n?.*Plain"):
        to_javascript(_one(operation, names), "f")


@pytest.mark.parametrize("name", ["double", "x y", "f(){}//", "NAN", "v3", "sqrt", "_t", "", "é", "var", "int8_t"])
def test_a_function_needs_a_name_that_is_an_identifier(name: str) -> None:
    for lower in (to_c, to_javascript):
        with pytest.raises(FormulaError, match="identifier"):
            lower(_one(Operation.NEG), name)


HOSTILE = ("double", "*/ system(1); /*", "NAN", "inputs", "outputs", "v0", "sqrt", "fma", "in_1", "let", "x\ny", "π")


@needs_gcc
@needs_node
def test_names_of_users_never_become_code(tmp_path: Path) -> None:
    out = InstructionList(len(HOSTILE))
    total = Scalar(out, 0)
    for k in range(1, len(HOSTILE)):
        total = (total * 2.0 + Scalar(out, k)).apply(Operation.ABS).apply(Operation.SQRT)
    kernel = Kernel(
        name="*/", inputs=HOSTILE, outputs=('"',), instructions=tuple(out.instructions), results=(total.index,)
    )
    x = points(len(HOSTILE), 20, 0)
    expected = by_numpy([kernel], x)
    assert same_bits(by_c([kernel], x, tmp_path), expected)
    assert same_bits(by_node([kernel], x, tmp_path), expected)


@needs_gcc
@needs_node
@pytest.mark.parametrize("precision", Precision)
def test_constants_read_back_exactly(tmp_path: Path, precision: Precision) -> None:
    random = np.random.default_rng(0)
    values = [*random.integers(0, 2**64, 300, dtype=np.uint64).view(float), 0.1, 1e300, 5e-324, math.inf, -0.0, 1.0]
    out = InstructionList(1)
    results = tuple(out.constant(float(value)) for value in values)
    kernel = Kernel(
        name="constants",
        inputs=("x",),
        outputs=tuple(f"y{k}" for k in range(len(values))),
        instructions=tuple(out.instructions),
        results=results,
    )
    x = np.zeros((1, 1))
    with np.errstate(all="ignore"):
        expected = np.array(values).astype(precision.dtype)[:, None]
    assert same_bits(by_c([kernel], x, tmp_path, precision), expected)
    assert same_bits(by_node([kernel], x, tmp_path, precision), expected)
