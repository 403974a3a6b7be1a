"""What a report says of the plant: its equations, its names, the answers to the questions of nonlinear control."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ulna.base import Status, Verdict, told_evidence
from ulna.design import Analysis
from ulna.page.report.formulas import cell, cut, set_formulas
from ulna.page.report.quantities import number_text, unit_text
from ulna.report import Badge, Block, Cell, Section, Table, Text, Tone, value_text, verbatim
from ulna.system import Parameter, Signal, System, system_latex

_TONES = {
    Status.PROVED: Tone.GOOD,
    Status.REFUTED: Tone.BAD,
    Status.SUPPORTED: Tone.MILD,
    Status.UNDECIDED: Tone.PLAIN,
}


def badge(verdict: Verdict) -> Badge:
    """How the claim stands."""
    return Badge(text=str(verdict.status), tone=_TONES[verdict.status])


def short_section(analysis: Analysis, sentences: Sequence[str]) -> Section:
    """What the plant is, what stands in the way, and what the rest of the report found, in a few sentences."""
    blocks = [Text(text=verbatim(each)) for each in (analysis.summary, *sentences)]
    return Section(anchor="short", title="In short", blocks=tuple(blocks))


def plant_section(plant: System) -> Section:
    """Equations, signals and parameters."""
    return Section(anchor="plant", title="The plant", blocks=tuple(_plant(plant)))


def _plant(plant: System) -> Iterator[Block]:
    yield from set_formulas(system_latex(plant, values=False))
    kinds = (("state", plant.states), ("input", plant.inputs), ("output", plant.outputs))
    rows = tuple(_row(kind, s) for kind, signals in kinds for s in signals)
    yield Table(head=("", "name", "unit", "range", "meaning"), rows=rows, caption="Signals")
    if plant.parameters:
        head = ("name", "value", "unit", "range", "meaning", "source")
        yield Table(head=head, rows=tuple(map(_parameter, plant.parameters)), caption="Parameters")


def _row(kind: str, signal: Signal) -> tuple[Cell, ...]:
    return (kind, cell(signal.symbol), cut(unit_text(signal.unit)), _range(signal), cut(signal.text))


def _parameter(parameter: Parameter) -> tuple[Cell, ...]:
    value = "no value" if parameter.value is None else cut(_value(parameter.value))
    shown = (unit_text(parameter.unit), _range(parameter), parameter.text, parameter.source)
    return (cell(parameter.symbol), value, *map(cut, shown))


def _value(value: Any) -> str:
    """A number to six digits, anything else as it is written."""
    try:
        return number_text(float(value), 6)
    except (TypeError, ValueError):
        return value_text(value)


def _range(given: Signal | Parameter) -> str:
    if given.lower is None and given.upper is None:
        return ""
    low, high = ("…" if each is None else _value(each) for each in (given.lower, given.upper))
    return f"{low} to {high}"


def verdicts_section(analysis: Analysis) -> Section:
    """Each question with its verdict, its answer and why."""
    where = value_text(dict(analysis.point.values)) if analysis.point.values else "none"
    rest = "where the plant rests" if analysis.point.verdict.holds else "where it does not rest, or that is open"
    rows = tuple(
        (key.replace("_", " "), badge(answer.verdict), cell(_plain(answer.value)), why(answer.verdict))
        for key, answer in analysis.answers.items()
    )
    return Section(
        anchor="verdicts",
        title="Verdicts",
        blocks=(
            Text(text="Proved: by exact computation. Supported: at every sampled point. The questions are explained in "
                 "the documentation under “What analyse answers”."),
            Text(text=verbatim(f"Asked at the point {where}, {rest}."), quiet=True),
            Table(head=("question", "verdict", "answer", "why"), rows=rows),
        ),
    )  # fmt: skip


def why(verdict: Verdict) -> str:
    """The evidence in words."""
    told = told_evidence(verdict)
    return cut("; ".join(f"{label}: {value_text(value)}" for label, value in told.items()))


def _plain(value: Any) -> Any:
    return "" if value is None else value
