"""Rows of numbers in the kernels of a loop: stem0, stem1 and so on."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.program import Kernel, Scalar, restricted

Pair = tuple[Sequence[Scalar], Sequence[Scalar]]
"""Values at the older and at the newer sample."""


def row_of(kernel: Kernel, stem: str) -> Kernel:
    """The kernel of the outputs stem0, stem1, … only."""
    return restricted(kernel, [label for label in kernel.outputs if label.rstrip("0123456789") == stem])


def roles(**rows: Sequence[Scalar]) -> dict[str, Scalar]:
    """Inputs of a kernel: stem0, stem1 and so on of each row."""
    return {f"{stem}{k}": value for stem, row in rows.items() for k, value in enumerate(row)}
