"""`ulna analyse PLANT`: what the vector fields say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ulna.cli.asked_plant import plant_of
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, PlantOptions, Seconds
from ulna.cli.patience import take_time
from ulna.cli.supervisor import finished, keep
from ulna.cli.terminal import console, line, print_json, progress
from ulna.cli.wording import reason_label

if TYPE_CHECKING:
    from ulna.base import Verdict
    from ulna.design import Analysis, Answer

_COLOURS = {"proved": "green", "refuted": "red", "supported": "yellow", "undecided": "dim"}


@with_groups
def analyse(
    plant: PlantOptions,
    as_json: AsJson = False,
    seconds: Seconds = None,
) -> None:
    """Answer the questions of nonlinear control for a plant, each with its verdict and evidence.

    Relative degree, controllability, involutivity, full-state and state-only linearisation, observability, observer
    form, zero dynamics, dynamic extension: docs/analysis.md says what each key means.
    """
    share = take_time(seconds)
    from ulna.design import analyse as analyse_system

    system = plant_of(plant)

    def found(answers: Mapping[str, Answer]) -> None:
        rows = {key: _row(answer, as_json) for key, answer in answers.items()}
        keep(_show, f"{system.name}: what was found in the time", rows, as_json)

    with progress(f"analysing '{system.name}'"):
        analysis = analyse_system(system, **share, told=found)
    finished()
    point = ", ".join(f"{s.name} = {v}" for s, v in analysis.point.values.items())
    rows = {key: _row(answer, as_json) for key, answer in analysis.answers.items()}
    _show(f"{system.name} at {point} ({_kind(analysis)})", rows, as_json)


def _kind(analysis: Analysis) -> str:
    """Whether the plant rests at the point; that it rests nowhere is said only where it is proved."""
    verdict, points = analysis.point.verdict, analysis.answers.get("rest_points")
    if verdict.holds:
        return "equilibrium"
    if points is not None and points.verdict.holds and points.value == [] and not points.verdict.evidence.get("within"):
        return "no equilibrium exists with these inputs"
    if "state" in verdict.evidence:
        name, rate = verdict.evidence["state"], line(verdict.evidence["rate"], 60)
        moved = f"{name} changes by {rate} a period" if analysis.system.discrete else f"{name}' = {rate}"
        return f"not at rest there: {moved}"
    return "whether it rests there is open"


def _row(answer: Answer, as_json: bool) -> Any:
    """What is shown of an answer, without formulas: the JSON of it, or verdict, answer and note as text."""
    if not as_json:
        return str(answer.verdict.status), line(answer.value), _evidence(answer.verdict)
    from ulna.report.results import plain

    return {
        "verdict": str(answer.verdict.status),
        "value": plain(answer.value),
        "evidence": {"claim": answer.verdict.claim} | plain(answer.verdict.evidence, parts=2_000),
    }


def _show(title: str, rows: Mapping[str, Any], as_json: bool) -> None:
    """One row per question; what stands behind an answer follows as numbered notes, each said once."""
    if as_json:
        print_json(rows)
        return
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left")
    table.add_column("question", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("answer", overflow="fold")
    table.add_column("note", justify="right", no_wrap=True)
    notes: dict[str, int] = {}
    for key, (status, answer, why) in rows.items():
        number = str(notes.setdefault(why, len(notes) + 1)) if why else ""
        table.add_row(key, f"[{_COLOURS[status]}]{status}[/]", escape(answer), number)
    console().print(table)
    below = Table.grid(padding=(0, 1))
    below.add_column(justify="right", no_wrap=True)
    below.add_column(overflow="fold")
    for why, number in notes.items():
        below.add_row(str(number), escape(why))
    console().print(below)


def _evidence(verdict: Verdict) -> str:
    """The telling part of the evidence, one line: a counterexample whole, of a proof only what bounds it."""
    sampling = {"points", "seed", "digits", "tolerance", "generically"}
    proof = {"point", "rank", "rows", "method", "because", "per_output", "manifold", "inputs", "regular", "psi"}
    dropped = sampling | (proof if verdict.holds else set())
    first = {"because": verdict.evidence.get("because")}  # what was asked on the way, then what was found
    told = {key: value for key, value in (first | dict(verdict.evidence)).items() if key not in dropped}
    if getattr(told.get("singular"), "is_number", False):
        del told["singular"]  # singular nowhere
    names = {"because": reason_label(verdict.status)}
    return "; ".join(
        f"{names.get(key, key)}: {line(value, 300)}" for key, value in told.items() if value not in (None, (), [], {})
    )
