"""Formulas as compiled functions of a block of plants."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from ulna.program import HEADER, Kernel, compiled, hoist, to_numpy
from ulna.sim.sampled.writing import Writer
from ulna.symbolic.compiling import kernel

LANES = 40
"""Plants of a block: a multiple of what a vector register holds, and 200 plants fill five."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Block:
    """Formulas of a block of plants.

    Attributes:
        function: f(state, given, numbers, out) for `loop.run_blocks`; number j of plant l stands at [j · LANES + l].
        before: the parameters' names among which `columns` → what `function` wants as numbers.
    """

    function: Any
    before: Callable[..., tuple[Any, ...]]
    columns: tuple[int, ...]

    def numbers(self, table: np.ndarray) -> np.ndarray:
        """(D, Q) what the function wants for (D, P) values of the parameters."""
        rows = self.before(*table.T[list(self.columns)])
        columns = [np.broadcast_to(row, len(table)) for row in rows]
        return np.ascontiguousarray(np.stack(columns, axis=1)) if columns else np.zeros((len(table), 0))


def block(
    name: str,
    state: Sequence[sp.Symbol],
    given: Sequence[sp.Symbol],
    parameters: Sequence[sp.Symbol],
    outputs: Mapping[str, sp.Expr],
) -> Block:
    """The formulas of `outputs` over a block, in order; what depends on parameters alone is computed beforehand.

    Raises:
        OptionalDependencyError: without Numba.
    """
    constant = [p.name for p in parameters]
    parts = hoist(kernel(name, [*state, *given, *parameters], outputs, held=parameters), constant)
    sizes = {"state": len(state), "given": len(given)}
    sizes["numbers"] = len(parts.main.inputs) - sum(sizes.values())
    return Block(
        function=compiled(HEADER + _source(parts.main, sizes)),
        before=to_numpy(parts.before),
        columns=tuple(constant.index(label) for label in parts.before.inputs),
    )


def _source(main: Kernel, sizes: Mapping[str, int]) -> str:
    """The function's text: one loop over the plants, the arithmetic written out inside."""
    w = Writer()
    w.depth = 2
    places = [f"{row}[{k * LANES} + l]" for row, size in sizes.items() for k in range(size)]
    names = {label: w.new(place) for label, place in zip(main.inputs, places, strict=True)}
    for k, value in enumerate(w.kernel(main, names)):
        w.line(f"out[{k * LANES} + l] = {value}")
    signature = f"void({', '.join(['float64[::1]'] * 4)})"
    head = (
        f'@numba.njit("{signature}", error_model="numpy", nogil=True, cache=CACHE)',
        "def loop(state, given, numbers, out):",
        f"    for l in range({LANES}):",
    )
    return "\n".join((*head, *w.lines)) + "\n"
