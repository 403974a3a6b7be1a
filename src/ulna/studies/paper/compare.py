"""Printed against exact: numbers by their digits, sums term by term, matrices entry by entry, formulas by algebra.

The rules, in this order:

* agrees: the exact number, rounded to the printed digits, is the printed number;
* rounding carried through: the printed number is what comes out of the paper's own earlier rounded numbers, or the
  digits were cut off instead of rounded;
* misprint: neither.

A printed 0 and a missing term say exactly zero; a term without a number says exactly one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import sympy as sp

from ulna.studies.paper.notation import Digits, Printed
from ulna.studies.paper.terms import Term, split_terms


class Finding(StrEnum):
    """How a printed statement stands to the exact one, from best to worst."""

    STATEMENT = "statement"
    AGREES = "agrees to the printed digits"
    ROUNDING = "rounding carried through"
    MISPRINT = "misprint"


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """Another way to the same number or expression, from numbers the paper prints earlier.

    Attributes:
        label: which earlier numbers (`"from (46) as printed"`).
        value: what comes out.
        through_misprint: whether one of them is itself a misprint.
    """

    label: str
    value: sp.Expr
    through_misprint: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One printed number, term or formula against the exact one.

    Attributes:
        place: where it stands within the equation (`"row 3, x2*sin(x1)"`); empty for the whole.
        printed: as printed.
        exact: the exact value, expression or matrix; None for a statement that is not a formula.
        finding: how they stand to one another.
        meaning: what a difference amounts to; empty when there is none.
        copied: a misprint that only follows from an earlier one.
    """

    place: str
    printed: str
    exact: sp.Expr | sp.MatrixBase | None
    finding: Finding
    meaning: str = ""
    copied: bool = False


def worst(comparisons: Sequence[Comparison]) -> Finding:
    """The worst finding of all; a statement if there are none."""
    order = list(Finding)
    return max((c.finding for c in comparisons), key=order.index, default=Finding.STATEMENT)


def compare_number(
    printed: sp.Expr,
    marks: Mapping[sp.Symbol, Digits],
    exact: sp.Expr,
    routes: Sequence[Route] = (),
    *,
    place: str = "",
) -> Comparison:
    """Return how a printed number stands to the exact one.

    Args:
        printed: a mark with its sign, or a number that is not printed in digits (then it must be exact).
        marks: mark → its digits.
        exact: the exact number.
        routes: other ways to it, the more trustworthy first.
        place: where it stands.
    """
    value, step, text = _as_printed(printed, marks)

    def found(finding: Finding, meaning: str = "", *, copied: bool = False) -> Comparison:
        return Comparison(place=place, printed=text, exact=exact, finding=finding, meaning=meaning, copied=copied)

    if _rounds_to(exact, value, step):
        return found(Finding.AGREES)
    size = f"{number_text(exact)} exactly"
    if _cut_to(exact, value, step):
        return found(Finding.ROUNDING, f"{size}; digits cut off instead of rounded")
    others = [route for route in routes if route.value != exact]
    for reaches, how in ((_rounds_to, ""), (_cut_to, ", digits cut off instead of rounded")):
        for route in others:
            if reaches(route.value, value, step):
                finding = Finding.MISPRINT if route.through_misprint else Finding.ROUNDING
                meaning = f"{size}; {route.label} it is {number_text(route.value)}{how}"
                return found(finding, meaning, copied=route.through_misprint)
    return found(Finding.MISPRINT, f"{size}; {_difference(value, exact, step, others)}")


def compare_terms(
    printed: Printed, exact: sp.Expr, routes: Sequence[Route] = (), *, place: str = ""
) -> list[Comparison]:
    """Return the comparison of each number of a printed sum with that of the same term of the exact one.

    Terms are matched by their symbolic part; one that is only printed, or only exact, is compared with zero.
    """
    marks = printed.marks
    left, right = split_terms(printed.expression, set(marks)), split_terms(exact)
    others = [(route, split_terms(route.value)) for route in routes]
    found: list[Comparison] = []
    for shape in [*left, *(shape for shape in right if shape not in left)]:
        here = _join(place, shape)
        ways = [_with_value(route, _factor(terms, shape)) for route, terms in others]
        found.append(compare_number(_factor(left, shape), marks, _factor(right, shape), ways, place=here))
        if shape in left and shape in right:
            inner = dict(right[shape].inner)
            for name, number in left[shape].inner:
                ways = [_with_value(route, _inner(terms, shape, name)) for route, terms in others]
                found.append(
                    compare_number(number, marks, inner.get(name, sp.Integer(1)), ways, place=f"{here}, in {name}")
                )
    return found or [Comparison(place=place, printed=printed.text, exact=exact, finding=Finding.AGREES)]


def compare_formula(printed: sp.Expr, exact: sp.Expr, *, text: str = "", place: str = "") -> Comparison:
    """Return whether two formulas are the same, exactly, and if not, which change of one name would make them so."""

    def found(finding: Finding, meaning: str = "") -> Comparison:
        return Comparison(place=place, printed=text or str(printed), exact=exact, finding=finding, meaning=meaning)

    if _same(printed, exact):
        return found(Finding.AGREES)
    strange = sorted(printed.free_symbols - exact.free_symbols, key=str)
    for symbol in strange:
        for meant in sorted(exact.free_symbols, key=str):
            if _same(printed.xreplace({symbol: meant}), exact):
                return found(Finding.MISPRINT, f"{symbol} stands where {meant} is meant")
    if _same(-printed, exact):
        return found(Finding.MISPRINT, "the sign is wrong")
    difference = sp.expand(printed - exact)
    return found(Finding.MISPRINT, f"printed minus exact is {difference}")


def number_text(number: sp.Expr, digits: int = 6) -> str:
    """Return a number for reading: whole numbers whole, others with at most `digits` digits."""
    if number.is_Integer:
        return str(number)
    text = str(sp.N(number, digits))
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def _as_printed(printed: sp.Expr, marks: Mapping[sp.Symbol, Digits]) -> tuple[sp.Expr, sp.Expr, str]:
    """Value, unit of the last digit, text. A number without digits, or of several numbers, has unit 0: it is exact."""
    value = printed.xreplace({mark: digits.value for mark, digits in marks.items()})
    for sign, bare in (("", printed), ("-", -printed)):
        if bare in marks:
            digits = marks[bare]
            step = digits.step if digits.value != 0 else sp.Integer(0)
            return value, step, sign + digits.text
    return value, sp.Integer(0), str(value)


def _rounds_to(exact: sp.Expr, printed: sp.Expr, step: sp.Expr) -> bool:
    return _at_most(sp.Abs(exact - printed), step / 2)


def _cut_to(exact: sp.Expr, printed: sp.Expr, step: sp.Expr) -> bool:
    """The printed digits are the first digits of the exact number."""
    if step == 0 or printed == 0:
        return False
    excess = (exact - printed) * sp.sign(printed)
    return _at_most(-excess, sp.Integer(0)) and not _at_most(step, excess)


def _at_most(left: sp.Expr, right: sp.Expr) -> bool:
    """left ≤ right, decided with 40 digits where it is not plain from exact arithmetic."""
    difference = left - right
    if difference.is_Rational:
        return bool(difference <= 0)
    return bool(sp.N(difference, 40) <= sp.Float("1e-30"))


def _difference(printed: sp.Expr, exact: sp.Expr, step: sp.Expr, routes: Sequence[Route]) -> str:
    """What is wrong with a misprint, and what the paper's own numbers would have given."""
    if exact == 0:
        return "there is no such term"
    if printed == 0:
        return "it is left out"
    relative = sp.Abs(printed / exact) - 1
    if printed * exact < 0:
        only = _rounds_to(-exact, printed, step) or _cut_to(-exact, printed, step)
        return "the sign is wrong" if only else f"the sign is wrong, and the size by {_percent(relative)}"
    for power in (-2, -1, 1, 2):
        if _rounds_to(exact * sp.Integer(10) ** power, printed, step):
            return f"the decimal point is {abs(power)} off"
    text = f"off by {_percent(relative)}"
    nearest = min(routes, key=lambda route: sp.N(sp.Abs(route.value - printed), 20), default=None)
    if nearest is None or not nearest.value.is_number:
        return text
    return f"{text}; {nearest.label} it would be {number_text(nearest.value)}"


def _percent(relative: sp.Expr) -> str:
    return f"{number_text(100 * sp.Abs(relative), 2)} %"


def _same(left: sp.Expr, right: sp.Expr) -> bool:
    return sp.cancel(sp.together(sp.expand(left - right))) == 0


def _factor(terms: Mapping[sp.Expr, Term], shape: sp.Expr) -> sp.Expr:
    return terms[shape].factor if shape in terms else sp.Integer(0)


def _inner(terms: Mapping[sp.Expr, Term], shape: sp.Expr, name: str) -> sp.Expr:
    return dict(terms[shape].inner).get(name, sp.Integer(1)) if shape in terms else sp.Integer(0)


def _with_value(route: Route, value: sp.Expr) -> Route:
    return Route(label=route.label, value=value, through_misprint=route.through_misprint)


def _join(place: str, shape: sp.Expr) -> str:
    parts = [place] if place else []
    return ", ".join([*parts, *([] if shape == 1 else [str(shape)])])
