"""`ulna analyse PLANT`: what the vector fields say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base import told_evidence
from ulna.cli.asked_identifiability import identifiability_answers
from ulna.cli.asked_plant import plant_of, ranges_of
from ulna.cli.completion import complete_question
from ulna.cli.layout import broken, columns, numbered, say, shown, write_rows
from ulna.cli.next_step import next_step
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, Exact, PlantOptions, Seconds, Substitute, Unknown
from ulna.cli.patience import take_time
from ulna.cli.supervisor import finished, keep
from ulna.cli.terminal import print_json, progress

if TYPE_CHECKING:
    from ulna.base import Verdict
    from ulna.design import Analysis, Answer

_NESTED = ("zero_dynamics", "dynamic_extension", "rest_points", "linearisation")
"""Answers whose parts hold equations or numbers of their own."""

_COLOURS = {"proved": "green", "refuted": "red", "supported": "yellow", "undecided": "bright_black"}


@with_groups
def analyse(
    plant: PlantOptions,
    question: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY",
            help="Answer this question only: 'involutive', 'zero_dynamics'. Repeatable.",
            autocompletion=complete_question,
        ),
    ] = None,
    within: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH",
            help="Look for equilibria with the state in this range: 'x=-5:5'. Left out: the plant file's. Repeatable.",
        ),
    ] = None,
    identify: Unknown = "",
    evidence: Annotated[
        bool, typer.Option("--evidence", help="Show the evidence for every answer, with --json too.")
    ] = False,
    substitute: Substitute = False,
    exact: Exact = False,
    as_json: AsJson = False,
    seconds: Seconds = None,
) -> None:
    """Say what a plant is, what stands in the way of a controller, and answer every question of nonlinear control.

    Relative degree, controllability, involutivity, full-state and state-only linearisation, observability, observer
    form, zero dynamics, dynamic extension, rest points: docs/analysis.md says what each key means.

    Examples:
        ulna analyse one_link_arm
        ulna analyse plant.toml --question involutive --evidence
        ulna analyse duffing --question rest_points --within "x=-5:5"
        ulna analyse one_link_arm --identify "m2, Ra"
        ulna analyse cart_pole --json
    """
    share = take_time(seconds)
    system = plant_of(plant)
    if substitute:
        from ulna.system import substitute_input

        system = substitute_input(system).system
    ranges = ranges_of(system, within or [], "--within")
    from ulna.design import analyse as analyse_system

    row = _as_json if as_json else _as_text
    rows: dict[str, tuple[Answer, Any]] = {}

    def shown_rows(answers: Mapping[str, Answer]) -> dict[str, Any]:
        """What is shown of each answer, worked out once."""
        for key, answer in answers.items():
            if key not in rows or rows[key][0] is not answer:
                rows[key] = answer, row(key, answer, evidence=evidence, exact=exact)
        return {key: rows[key][1] for key in answers}

    def found(answers: Mapping[str, Answer]) -> None:
        keep(_show_rows, shown_rows({**answers, **asked}), as_json)

    with progress(f"what the outputs of '{system.name}' tell"):
        asked = identifiability_answers(system, identify, as_json=as_json)
    with progress(f"analysing '{system.name}'"):
        analysis = analyse_system(system, questions=question or None, within=ranges, **share, told=found)
    finished()
    if not as_json:
        _begin(analysis, plant.name, whole=not question)
    _show_rows(shown_rows({**analysis.answers, **asked}), as_json)


def _begin(analysis: Analysis, name: str, *, whole: bool) -> None:
    """What it is, what stands in the way, what comes next; then where questions about a point were asked."""
    if whole:
        say(analysis.summary)
        why, command = next_step(analysis, name)
        say(f"Next, {why}:")
        typer.echo(f"    {command}\n")
    point = shown({s.name: float(v) if v.is_number else v for s, v in analysis.point.values.items()}, limit=300)
    for line in broken("at the point ", f"{point.replace('; ', ', ')} ({_kind(analysis)})"):
        typer.echo(line)


def _kind(analysis: Analysis) -> str:
    """Whether the plant rests at the point; that it rests nowhere is said only where it is proved."""
    verdict, points = analysis.point.verdict, analysis.answers.get("rest_points")
    if verdict.holds:
        return "equilibrium"
    if points is not None and points.verdict.holds and points.value == [] and not points.verdict.evidence.get("within"):
        return "no equilibrium exists with these inputs"
    if "state" in verdict.evidence:
        name, rate = verdict.evidence["state"], shown(verdict.evidence["rate"], limit=60)
        moved = f"{name} changes by {rate} a period" if analysis.system.discrete else f"{name}' = {rate}"
        return f"not at rest there: {moved}"
    return "whether it rests there is open"


def _as_json(_key: str, answer: Answer, *, evidence: bool, exact: bool) -> dict[str, Any]:  # noqa: ARG001
    """Verdict and value of an answer, exactly; what stands behind it on demand."""
    from ulna.report.results import plain

    told = {"verdict": str(answer.verdict.status), "value": plain(answer.value)}
    if evidence:
        told["evidence"] = {"claim": answer.verdict.claim} | plain(answer.verdict.evidence, parts=2_000)
    return told


def _as_text(key: str, answer: Answer, *, evidence: bool, exact: bool) -> tuple[str, dict[str, str], str]:
    verdict = answer.verdict
    return str(verdict.status), _lines(key, answer.value, exact), _evidence(verdict, exact, whole=evidence)


def _lines(key: str, value: Any, exact: bool) -> dict[str, str]:
    """The rows of an answer: a vector's entries and a mapping's below each other, everything else as one."""
    if key == "rest_points" and value == []:
        return {"": "none"}
    if key == "rest_points" and value:
        return {str(k): _rest_point(each, exact) for k, each in enumerate(value, start=1)}
    if key == "singular_set" and getattr(value, "is_number", False) and value != 0:
        return {"": "nowhere"}
    if isinstance(value, Mapping):
        # An empty part says nothing; a plain vector of one is its entry.
        return {str(name): shown(part, exact=exact) for name, part in value.items() if part not in ({}, [], None)}
    if isinstance(value, list) and len(value) > 1 and not all(isinstance(each, int | None) for each in value):
        name = {"T": "z", "observer_T": "z", "control": "u"}.get(key, "")
        return {f"{name}{k}": shown(each, exact=exact) for k, each in enumerate(value, start=1)}
    return {"": shown(value, exact=exact)}


def _rest_point(point: Mapping[str, Any], exact: bool) -> str:
    where = shown(point["states"], exact=exact).replace("; ", ", ")
    poles = "" if point["poles"] is None else f"; poles {shown(point['poles'])}"
    told = {True: "stable", False: "unstable", None: "the poles do not tell stability"}[point["stable"]]
    return f"{where}{poles}; {told}"


def _show_rows(rows: Mapping[str, Any], as_json: bool) -> None:
    """A question a line with its verdict and answer, long answers below; then the notes, each said once."""
    if as_json:
        print_json(rows)
        return
    notes: dict[str, int] = {}
    widest = max(map(len, rows), default=0)
    for key, (status, lines, why) in rows.items():
        note = f" [{notes.setdefault(why, len(notes) + 1)}]" if why else ""
        head = f"{key:<{widest}}  {typer.style(f'{status:<9}', fg=_COLOURS[status])}"
        short = lines.get("", "")
        if len(lines) == 1 and short and widest + 13 + len(short) + len(note) <= columns():
            typer.echo(f"{head}  {short}{note}")
            continue
        typer.echo(f"{key:<{widest}}  {typer.style(status, fg=_COLOURS[status])}{note}")
        if short:
            for line in broken("    ", short):
                typer.echo(line)
        else:
            write_rows(lines, indent=4, sign="" if key in _NESTED else "=")
    if notes:
        typer.echo()
        numbered((number, why) for why, number in notes.items())


def _evidence(verdict: Verdict, exact: bool = False, *, whole: bool = True) -> str:
    """The evidence as one line; see `told_evidence`."""
    told = told_evidence(verdict, whole=whole)
    return "; ".join(f"{label}: {shown(value, exact=exact, limit=300)}" for label, value in told.items())
