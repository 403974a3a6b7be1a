"""Expressions and Jacobians at many points at once, through kernels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import sympy as sp

from ulna.program import to_numpy
from ulna.symbolic.compiling.from_expressions import kernel

BatchFunction = Callable[[Mapping[str, np.ndarray]], np.ndarray]
"""From (P,) arrays by name to an array whose first axis is P."""


def batch_vector(name: str, expressions: Sequence[sp.Expr], symbols: Sequence[sp.Symbol]) -> BatchFunction:
    """(P, r) values of r expressions as a function of (P,) arrays by symbol name."""
    if not expressions:
        return lambda values: np.zeros((max(np.size(v) for v in values.values()), 0))
    outputs = {f"e{k}": e for k, e in enumerate(expressions)}
    evaluate = to_numpy(kernel(name, list(symbols), outputs))
    names = [s.name for s in symbols]

    def at(values: Mapping[str, np.ndarray]) -> np.ndarray:
        columns = [np.asarray(values[n], dtype=float) for n in names]
        size = np.broadcast_shapes(*(c.shape for c in columns), (1,))
        rows = evaluate(*(np.broadcast_to(c, size) for c in columns))
        return np.stack([np.broadcast_to(r, size) for r in rows], axis=-1)

    return at


def batch_jacobian(
    name: str, expressions: Sequence[sp.Expr], by: Sequence[sp.Symbol], symbols: Sequence[sp.Symbol]
) -> BatchFunction:
    """(P, r, c) Jacobian of r expressions in c symbols as a function of (P,) arrays by symbol name.

    A jump counts as the slope on its sides.
    """
    rows, columns = len(expressions), len(by)
    if rows == 0 or columns == 0:
        return lambda values: np.zeros((max(np.size(v) for v in values.values()), rows, columns))
    flat = batch_vector(name, [_slope(e, s) for e in expressions for s in by], symbols)
    return lambda values: flat(values).reshape(-1, rows, columns)


def _slope(expression: sp.Expr, by: sp.Symbol) -> sp.Expr:
    slope = expression.diff(by)
    return slope.replace(sp.DiracDelta, lambda *_: sp.Integer(0)) if slope.has(sp.DiracDelta) else slope
