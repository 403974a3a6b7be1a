"""`ulna analyse PLANT`: what the vector fields say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.session import console, plant, print_json, progress

if TYPE_CHECKING:
    from rich.table import Table

    from ulna.base.verdict import Verdict
    from ulna.design.analysis.analysis import Analysis

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
    from ulna.design.analysis.analysis import analyse as analyse_system

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
        table.add_row(key, shown, escape(_text(finding.value)), escape(_evidence(finding.verdict)))
    return table


def _text(value: Any, limit: int = 400) -> str:
    """A value as one line: vectors and one-row matrices without brackets, mappings as equations."""
    from ulna.report.results import plain

    text = _line(plain(value))
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text)} characters; --json shows all)"


def _line(shape: Any) -> str:
    if shape is None:
        return "–"
    if isinstance(shape, dict):
        return "; ".join(f"{key} = {_line(part)}" for key, part in shape.items() if part not in ({}, []))
    if isinstance(shape, list):
        parts = [part[0] if isinstance(part, list) and len(part) == 1 else part for part in shape]
        return ", ".join(f"({_line(part)})" if isinstance(part, list | dict) else str(part) for part in parts)
    return str(shape)


def _evidence(verdict: Verdict) -> str:
    """The telling part of the evidence, one line: a counterexample whole, of a proof only what bounds it."""
    sampling = {"points", "seed", "digits", "tolerance", "generically"}
    proof = {"point", "rank", "rows", "method", "because", "per_output", "manifold", "inputs", "regular", "psi"}
    dropped = sampling | (proof if verdict.holds else set())
    told = {key: value for key, value in verdict.evidence.items() if key not in dropped and value is not None}
    return "; ".join(f"{key}: {_text(value, 160)}" for key, value in told.items())
