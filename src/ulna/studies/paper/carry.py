"""The paper's own chain of computation: each printed result from the ones before it, exact and as the paper rounds.

A step says how its result follows from earlier ones. Run with exact numbers it gives the exact result; run with printed
ones it gives what an author who computes with them would print. Which of the two a printed number is decides whether it
is a carried rounding or a misprint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

import sympy as sp
from sympy.matrices.exceptions import NonInvertibleMatrixError

from ulna.base import UlnaError
from ulna.studies.paper.compare import Comparison, Finding, Route, compare_terms, worst
from ulna.studies.paper.notation import Printed, read_printed

Values = Mapping[str, sp.ImmutableDenseMatrix]
"""Key of a step → its result; numbers and sums are matrices of one entry."""

Rows = tuple[tuple[Printed, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One printed result.

    Attributes:
        key: its name in the chain.
        label: where it is printed (`"(46)"`).
        printed: its entries as printed; a matrix as rows.
        needs: keys of the results it follows from; empty for what is given.
        compute: the result from those.
        listed: whether it is a result of its own, not a part of one that follows.
        known: the exact result where it is known otherwise (from the library); it must be what `compute` gives.
        passage: key of the printed passage it stands in.
        entry: its name there.
    """

    key: str
    label: str
    printed: Rows
    needs: tuple[str, ...]
    compute: Callable[[Values], sp.MatrixBase]
    listed: bool = True
    known: sp.ImmutableDenseMatrix | None = None
    passage: str = ""
    entry: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """A step with its outcome.

    Attributes:
        step: what was checked.
        exact: its exact result.
        comparisons: one for each printed number.
        finding: the worst of them.
    """

    step: Step
    exact: sp.ImmutableDenseMatrix
    comparisons: tuple[Comparison, ...]

    @property
    def finding(self) -> Finding:
        """The worst finding among the comparisons."""
        return worst(self.comparisons)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Version:
    """One of the values a result can be carried on with."""

    value: sp.ImmutableDenseMatrix
    note: str
    misprinted: bool = False


def rows_of(entry: str | Sequence[str] | Sequence[Sequence[str]]) -> Rows:
    """Return printed entries (a text, a list of texts as a column, a list of rows) as rows of marked formulas."""
    if isinstance(entry, str):
        return ((read_printed(entry),),)
    return tuple(
        (read_printed(row),) if isinstance(row, str) else tuple(read_printed(cell) for cell in row) for row in entry
    )


def check_chain(steps: Sequence[Step]) -> Mapping[str, Checked]:
    """Return the outcome of every step, by key. Steps stand in the order in which they follow from one another.

    Raises:
        UlnaError: a step that needs what does not come before it, whose shape is not the printed one, or whose known
            result is not what it computes.
    """
    done: dict[str, Checked] = {}
    versions: dict[str, tuple[_Version, ...]] = {}
    for step in steps:
        missing = [need for need in step.needs if need not in done]
        if missing:
            raise UlnaError(f"the step '{step.key}'", f"it needs {', '.join(missing)}, which does not come before it.")
        exact = _exact(step, {need: done[need].exact for need in step.needs})
        comparisons = _compare(step, exact, _routes(step, versions, exact))
        done[step.key] = Checked(step=step, exact=exact, comparisons=comparisons)
        versions[step.key] = _versions(done[step.key])
    return MappingProxyType(done)


def printed_value(step: Step) -> sp.ImmutableDenseMatrix:
    """The printed result, its numbers taken as exact."""
    return sp.ImmutableDenseMatrix([[cell.value for cell in row] for row in step.printed])


def _exact(step: Step, values: Values) -> sp.ImmutableDenseMatrix:
    exact = sp.ImmutableDenseMatrix(step.compute(values))
    shape = (len(step.printed), len(step.printed[0]))
    if exact.shape != shape:
        raise UlnaError(f"the step '{step.key}'", f"the shape of the result is {exact.shape}, the printed one {shape}.")
    if step.known is not None and not (exact - step.known).applyfunc(sp.expand).is_zero_matrix:
        raise UlnaError(f"the step '{step.key}'", f"the result is {exact}, expected {step.known}.")
    return exact


def _compare(
    step: Step, exact: sp.ImmutableDenseMatrix, routes: Sequence[tuple[str, sp.ImmutableDenseMatrix, bool]]
) -> tuple[Comparison, ...]:
    found: list[Comparison] = []
    for i, row in enumerate(step.printed):
        for j, cell in enumerate(row):
            ways = [Route(label=label, value=value[i, j], through_misprint=bad) for label, value, bad in routes]
            found += compare_terms(cell, exact[i, j], ways, place=_place(step, i, j))
    return tuple(found)


def _place(step: Step, i: int, j: int) -> str:
    rows, columns = len(step.printed), len(step.printed[0])
    parts = [f"row {i + 1}"] if rows > 1 else []
    return ", ".join([*parts, *([f"column {j + 1}"] if columns > 1 else [])])


def _versions(checked: Checked) -> tuple[_Version, ...]:
    """Exact, printed where the print is sound, and printed as it stands; without repetitions."""
    step, exact = checked.step, checked.exact
    printed = printed_value(step)
    sound = sp.ImmutableDenseMatrix(
        *exact.shape, lambda i, j: exact[i, j] if _misprinted(checked, int(i), int(j)) else printed[i, j]
    )
    found = [_Version(value=exact, note="")]
    if sound != exact:
        found.append(_Version(value=sound, note=f"{step.label} as printed"))
    if printed != sound:
        found.append(_Version(value=printed, note=f"{step.label} as misprinted", misprinted=True))
    return tuple(found)


def _misprinted(checked: Checked, i: int, j: int) -> bool:
    place = _place(checked.step, i, j)
    return any(
        c.finding is Finding.MISPRINT and (c.place == place or c.place.startswith(f"{place}, ") or not place)
        for c in checked.comparisons
    )


def _routes(
    step: Step, versions: Mapping[str, tuple[_Version, ...]], exact: sp.ImmutableDenseMatrix
) -> list[tuple[str, sp.ImmutableDenseMatrix, bool]]:
    """What the step gives with every mixture of exact and printed numbers, those without misprints first."""
    found: list[tuple[str, sp.ImmutableDenseMatrix, bool]] = []
    for mixture in product(*(versions[need] for need in step.needs)):
        notes = [version.note for version in mixture if version.note]
        if not notes:
            continue
        values = {need: version.value for need, version in zip(step.needs, mixture, strict=True)}
        try:
            value = sp.ImmutableDenseMatrix(step.compute(values)).applyfunc(sp.expand)
        except NonInvertibleMatrixError:  # a misprinted matrix need not have an inverse: then nothing follows from it
            continue
        if value.shape == exact.shape:
            found.append(("with " + " and ".join(notes), value, any(version.misprinted for version in mixture)))
    return sorted(found, key=lambda route: (route[2], route[0].count(" and ")))
