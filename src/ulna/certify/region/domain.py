"""Where a loop is defined: its wires, its rates and the way back to its states, finite on a box."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy

import sympy as sp
from flint import arb

from ulna.certify.region.form import Form
from ulna.program import to_balls
from ulna.symbolic.compiling import kernel

_ENTIRE = (sp.sin, sp.cos, sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.atan, sp.exp)
"""Functions that are smooth on the whole line."""


class Domain:
    """Formulas that must have a value: T⁻¹ with its slopes, then the wires one after the other, then the rates.

    They are computed as they stand. Substituted into each other a singular law and the plant's factor would cancel.
    """

    def __init__(self, form: Form) -> None:
        own = form.limited.parameters
        z, x = [*form.symbols, *own], [*form.limited.symbols, *own]
        back = sp.Matrix([*form.inverse, *own])
        limited = form.limited
        self._limits = dict(zip(limited.limited, zip(limited.lower, limited.upper, strict=True), strict=True))
        self._held: tuple[arb, ...] = ()
        self._wires = [symbol for symbol, _ in form.limited.wires]
        steps = [formula for _, formula in form.limited.wires]
        self.everywhere = all(map(_entire, (*back, *steps, *form.limited.raw)))
        self._states = len(x)
        self._back = _balls("inverse", z, [*back, *back.jacobian(z)])
        self._steps = [_balls("wire", [*x, *self._wires[:k]], [e]) for k, e in enumerate(steps)]
        self._rates = _balls("rates", [*x, *self._wires], list(form.limited.raw))

    def at(self, parameters: Sequence[arb]) -> Domain:
        """The same with values of the parameters."""
        found = copy(self)
        found._held = tuple(parameters)
        return found

    def holds(self, point: Sequence[arb]) -> bool:
        """Whether all formulas have a value at every ζ of a box."""
        if self.everywhere:
            return True
        found = self._back(*point, *self._held)
        if not _finite(found):
            return False
        known = list(found[: self._states])
        for symbol, step in zip(self._wires, self._steps, strict=True):
            # A value that is missing is handed on: a limit does not hide it.
            (value,) = step(*known)
            if symbol in self._limits:
                low, high = (arb(int(each.p)) / int(each.q) for each in map(sp.Rational, self._limits[symbol]))
                value = value.max(low).min(high)
            known.append(value)
        return _finite(self._rates(*known))


def _finite(values: Sequence[arb]) -> bool:
    return all(value.is_finite() for value in values)


def _balls(name: str, inputs: Sequence[sp.Symbol], formulas: Sequence[sp.Expr]) -> Callable[..., tuple[arb, ...]]:
    return to_balls(kernel(name, list(inputs), {f"v{k}": e for k, e in enumerate(formulas)}))


def _entire(expression: sp.Expr) -> bool:
    for node in sp.preorder_traversal(expression):
        if isinstance(node, sp.Pow) and not (node.exp.is_Integer and node.exp >= 0) and not node.base.is_number:
            return False
        if isinstance(node, sp.Function) and not isinstance(node, _ENTIRE):
            return False
    return True
