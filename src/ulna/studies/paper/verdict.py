"""The verdict on one passage of the paper: how it stands to what comes out, and what comes out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.studies.paper.compare import Comparison, Finding, compare_formula, worst
from ulna.studies.paper.printed import Passage


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """Something that comes out, for reading; `name` tells several apart."""

    value: sp.Expr | sp.MatrixBase
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A passage with its verdict.

    Attributes:
        passage: what is printed.
        comparisons: one for each number, term or formula in it that was compared.
        shown: what comes out exactly.
    """

    passage: Passage
    comparisons: tuple[Comparison, ...]
    shown: tuple[Shown, ...] = ()

    @property
    def finding(self) -> Finding:
        """The worst finding among the comparisons."""
        return worst(self.comparisons)

    @property
    def own_misprints(self) -> tuple[Comparison, ...]:
        """The misprints that do not merely follow from an earlier one."""
        return tuple(c for c in self.comparisons if c.finding is Finding.MISPRINT and not c.copied)


def statement(passage: Passage, *, holds: bool, meaning: str) -> Judged:
    """A definition or a general statement, with what was checked of it."""
    finding = Finding.STATEMENT if holds else Finding.MISPRINT
    comparison = Comparison(place="", printed=passage.title, exact=None, finding=finding, meaning=meaning)
    return Judged(passage=passage, comparisons=(comparison,))


def compare_law(
    printed: sp.Expr | sp.MatrixBase, exact: sp.Expr | sp.MatrixBase, *, text: str, place: str = "", meaning: str = ""
) -> Comparison:
    """Return whether a general law, evaluated on an example, gives what the library gives.

    Args:
        printed: what the printed law evaluates to; a number, an expression or a matrix.
        exact: what the library gives.
        text: the law as printed.
        place: which part of the passage.
        meaning: what was checked, for a law that holds.
    """

    def found(finding: Finding, words: str) -> Comparison:
        return Comparison(place=place, printed=text, exact=exact, finding=finding, meaning=words)

    if isinstance(exact, sp.MatrixBase) and isinstance(printed, sp.MatrixBase):
        if printed.shape == exact.shape:
            same = all(compare_formula(p, e).finding is Finding.AGREES for p, e in zip(printed, exact, strict=True))
            return found(Finding.STATEMENT, meaning) if same else found(Finding.MISPRINT, "it does not hold")
        if printed.shape == exact.T.shape and compare_law(printed.T, exact, text=text).finding is Finding.STATEMENT:
            return found(
                Finding.MISPRINT, "it is a column where a row is meant: the transpose stands at the wrong place"
            )
        return found(Finding.MISPRINT, f"it has {_shape(printed)} where {_shape(exact)} were expected")
    if isinstance(exact, sp.MatrixBase) or isinstance(printed, sp.MatrixBase):
        return found(Finding.MISPRINT, "a matrix stands where a number was expected, or the other way round")
    if compare_formula(printed, exact).finding is Finding.AGREES:
        return found(Finding.STATEMENT, meaning)
    return found(Finding.MISPRINT, "it does not hold")


def joined(passage: Passage, parts: Sequence[Comparison], shown: Sequence[Shown] = ()) -> Judged:
    """The verdict of several comparisons in one passage."""
    return Judged(passage=passage, comparisons=tuple(parts), shown=tuple(shown))


def _shape(matrix: sp.MatrixBase) -> str:
    return f"{matrix.rows} × {matrix.cols} entries"
