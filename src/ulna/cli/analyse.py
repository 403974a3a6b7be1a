"""`ulna analyse PLANT`: what the vector fields say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.session import console, plant, print_json, progress

if TYPE_CHECKING:
    from rich.table import Table

    from ulna.design.analysis import Analysis

_COLOURS = {"proved": "green", "refuted": "red", "supported": "yellow", "undecided": "dim"}


def analyse(
    name: Annotated[str, typer.Argument(metavar="PLANT", help="A plant file (TOML or JSON) or a catalogue name.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for machines (keys: docs/analysis.md).")] = False,
    seconds: Annotated[float, typer.Option(help="Time for each group of answers.", min=0.1)] = 8.0,
) -> None:
    """Answer the questions of nonlinear control for a plant, each with its verdict and evidence.

    Relative degree, controllability, involutivity, full-state and state-only linearisation, observability, observer
    form, zero dynamics, dynamic extension: docs/analysis.md says what each key means.
    """
    from ulna.design.analysis import analyse as analyse_system

    system = plant(name)
    with progress(f"analysing '{system.name}'"):
        analysis = analyse_system(system, seconds=seconds)
    if as_json:
        print_json(_data(analysis))
        return
    console().print(_table(analysis))


def _data(analysis: Analysis) -> dict[str, Any]:
    from ulna.report.results import plain

    return {
        key: {
            "verdict": str(finding.verdict.status),
            "value": plain(finding.value),
            "evidence": {"claim": finding.verdict.claim} | plain(finding.verdict.evidence),
        }
        for key, finding in analysis.findings.items()
    }


def _table(analysis: Analysis) -> Table:
    from rich.markup import escape
    from rich.table import Table

    rest = ", ".join(f"{s.name} = {v}" for s, v in analysis.point.values.items())
    kind = "equilibrium" if analysis.point.equilibrium.holds else "no equilibrium"
    table = Table(title=escape(f"{analysis.system.name} at {rest} ({kind})"), title_justify="left")
    table.add_column("question", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("answer", overflow="fold", ratio=2)
    table.add_column("why", overflow="fold", ratio=2)
    for key, finding in analysis.findings.items():
        status = str(finding.verdict.status)
        shown = f"[{_COLOURS[status]}]{status}[/]"
        table.add_row(key, shown, escape(_text(finding.value)), escape(_evidence(finding.verdict.evidence)))
    return table


def _text(value: Any, limit: int = 400) -> str:
    from ulna.report.results import plain

    shape = plain(value)
    if shape is None:
        return "–"
    if isinstance(shape, list):
        text = ", ".join(str(part) for part in shape)
    elif isinstance(shape, dict):
        text = "; ".join(f"{key} = {part}" for key, part in shape.items())
    else:
        text = str(shape)
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text)} characters; --json shows all)"


def _evidence(evidence: Any) -> str:
    """The telling part of the evidence, one line."""
    told = {k: v for k, v in evidence.items() if k not in ("points", "seed", "digits", "tolerance", "generically")}
    return "; ".join(f"{key}: {_text(value, 160)}" for key, value in told.items() if value is not None)
