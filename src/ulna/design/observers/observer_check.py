"""Verification of an observer form by substitution."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from ulna.base import Verdict, all_of
from ulna.design.observers.output_functions import OutputSection
from ulna.geometry import lie_derivative
from ulna.symbolic.exact import SampledZero, ZeroTest, generic_rank, is_zero

_TEST = SampledZero(seconds=0.6)


def check_observer_form(
    section: OutputSection,
    coordinates: sp.MatrixBase,
    indices: Sequence[int],
    drift_injection: sp.MatrixBase,
    input_injection: sp.MatrixBase,
    *,
    measured: Sequence[sp.Expr],
    test: ZeroTest = _TEST,
) -> Verdict:
    """Whether z = T(x) obeys z' = A z + a(y) + c(y) u with each block's last coordinate the given function of y.

    Every equation is put into the plant's coordinates and tested: nothing of how T was found is trusted.

    Args:
        section: the plant with its output symbols.
        coordinates: (n, 1) T(x), block after block.
        indices: sizes of the blocks.
        drift_injection: (n, 1) a in the output symbols; input_injection: (n, m) c.
        measured: (p,) the last coordinates in the output symbols.
        test: the zero test.
    """
    view = section.view
    claim = f"'{view.system.name}' takes the observer form in these coordinates"
    regular = generic_rank(sp.Matrix(coordinates.jacobian(list(view.x))), seconds=0)
    if regular.value < len(view.x):
        return Verdict.refuted(claim, reason="the coordinates are dependent", rank=regular.value)
    stray = set(view.x) - set(section.y)
    for row, injected in (("a", drift_injection), ("c", input_injection)):
        if any(e.free_symbols & (stray | set(view.u)) for e in injected):
            return Verdict.refuted(claim, reason=f"the injection {row} contains states or inputs")
    parts = []
    for row, what, residual in _residuals(section, coordinates, indices, drift_injection, input_injection, measured):
        part = is_zero(residual, test=test)
        if part.fails:
            return Verdict.refuted(claim, **{**part.evidence, "row": row + 1, "equation": what, "function": residual})
        parts.append(part)
    return all_of(claim, parts, method="substitution")


def _residuals(
    section: OutputSection,
    coordinates: sp.MatrixBase,
    indices: Sequence[int],
    drift_injection: sp.MatrixBase,
    input_injection: sp.MatrixBase,
    measured: Sequence[sp.Expr],
) -> list[tuple[int, str, sp.Expr]]:
    view = section.view
    found = []
    row = 0
    for size, last in zip(indices, measured, strict=True):
        for k in range(size):
            shifted = coordinates[row - 1] if k else sp.Integer(0)
            drift = lie_derivative(coordinates[row], view.f, view.x) - shifted
            found.append((row, "drift", drift - section.at_states(drift_injection[row])))
            for j, column in enumerate(view.input_fields):
                slope = lie_derivative(coordinates[row], column, view.x)
                found.append((row, "input", slope - section.at_states(input_injection[row, j])))
            row += 1
        found.append((row - 1, "output", coordinates[row - 1] - section.at_states(last)))
    return found
