"""`ulna identify PLANT LOG`: parameters from records, how surely, and the plant with their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base import SimulationError
from ulna.cli.asked_plant import plant_of, signal_values
from ulna.cli.layout import say, write_texts
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, PlantOptions
from ulna.cli.supervisor import kept
from ulna.cli.terminal import console, print_json, progress
from ulna.cli.typed_values import named_values

if TYPE_CHECKING:
    from ulna.identification import Estimate, Fit, HeldOut, Record


@dataclass(frozen=True, slots=True, kw_only=True)
class LogOptions:
    """How logs are read."""

    column: Annotated[
        list[str],
        typer.Option(metavar="NAME=TITLE", help="What a signal is called in the logs: 'theta=encoder'. Repeatable."),
    ] = field(default_factory=list)
    unit: Annotated[
        list[str],
        typer.Option(metavar="TITLE=UNIT", help="Unit of a column whose title does not tell: 'encoder=deg'."),
    ] = field(default_factory=list)
    lost: Annotated[bool, typer.Option("--lost", help="Empty cells and NaN are lost samples.")] = False
    joined: Annotated[
        bool, typer.Option("--joined", help="Inputs follow straight lines between samples; else they are held.")
    ] = False
    delay: Annotated[float, typer.Option(metavar="S", help="Time by which inputs act later than recorded, s.")] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchOptions:
    """What is known besides, and how parameters are looked for."""

    prior: Annotated[
        list[str],
        typer.Option(metavar="NAME=VALUE±STD", help="What is known of a parameter: 'm2=5 ± 12%'. Repeatable."),
    ] = field(default_factory=list)
    bounds: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=LOW:HIGH", help="Bounds of a parameter; else the range of the plant file. Repeatable."
        ),
    ] = field(default_factory=list)
    noise: Annotated[
        list[str],
        typer.Option(metavar="NAME=STD", help="Noise of an output where it is known: 'theta=0.05 deg'."),
    ] = field(default_factory=list)
    robust: Annotated[bool, typer.Option("--robust", help="Give outliers less weight.")] = False
    multiple_shooting: Annotated[
        bool, typer.Option("--multiple-shooting", help="Cut the runs into segments: for unstable plants.")
    ] = False
    global_start: Annotated[
        bool, typer.Option("--global-start", help="Try many starts: where the plant's values are only guesses.")
    ] = False


@with_groups
def identify(
    plant: PlantOptions,
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG…", help="What was recorded: CSV with units in its titles, or netCDF; one or more."),
    ],
    free: Annotated[
        str,
        typer.Option(
            metavar="NAMES", help="Parameters to identify: 'm2, Ra'; 'kb = km' for two equal ones; 'friction' by word."
        ),
    ],
    initial: Annotated[
        str,
        typer.Option(metavar="NAME=VALUE,…", help="States known at the beginning of every log; the others are free."),
    ] = "free",
    held_out: Annotated[
        list[Path] | None,
        typer.Option("--held-out", metavar="LOG", help="A log that the result is validated on. Repeatable."),
    ] = None,
    constant: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="NAME=VALUE", help="An input that was not recorded: 'u=0'. Repeatable."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the plant with what was found (TOML or JSON).")] = None,
    page: Annotated[
        Path | None, typer.Option(help="Write a page with intervals, residuals and figures (HTML).")
    ] = None,
    as_json: AsJson = False,
    *,
    reading: LogOptions,
    search: SearchOptions,
) -> None:
    """Find parameters of a plant from logs, and say how surely they are known.

    The exit status is 1 where the search did not converge; what it had by then is shown and written all the same.

    Examples:
        ulna simulate one_link_arm --initial 1,0,0 --input "u=5*sin(3*t)" --out run.csv
        ulna identify one_link_arm run.csv --free "m2, Ra" --joined --out fitted.toml
        ulna identify one_link_arm run.csv --free "m2, Ra, km" --prior "km=0.1 ± 12%" --held-out run2.csv
    """
    import ulna.identification as fitting
    from ulna.system import write_system

    for flag, place in (("--out", out), ("--page", page)):
        if place is not None and not place.absolute().parent.is_dir():
            raise SimulationError(f"{flag} '{place}'", "its folder does not exist.", "Create it first.")
    system = plant_of(plant)
    records, others = (_read(each, reading) for each in (logs, held_out or []))
    with progress(f"fitting '{system.name}'"):
        fit = fitting.identify(
            system,
            records,
            free=free,
            priors={name: text for name, text, _ in named_values(search.prior, "--prior")},
            bounds=_bounds(search.bounds),
            noise={name: text for name, text, _ in named_values(search.noise, "--noise")},
            initial={} if initial == "free" else signal_values(system, system.states, [initial], "--initial", "state"),
            inputs=signal_values(system, system.inputs, constant or [], "--input", "input"),
            held_out=others or None,
            loss=fitting.Robust() if search.robust else None,
            shooting=fitting.MultipleShooting() if search.multiple_shooting else None,
            start=fitting.GlobalStart() if search.global_start else None,
        )
    if out is not None:
        write_system(fit.system, out)
        kept(f"{out} is written")
    if page is not None:
        _draw(fit, page)
    if as_json:
        print_json(_data(fit))
    else:
        _print(fit, records, out)
    if not fit.converged:
        raise typer.Exit(1)


def _draw(fit: Fit, page: Path) -> None:
    from ulna.page import fit_page

    with progress("drawing"):
        fit_page(fit, out=page)
    kept(f"{page} is written")


def _read(logs: Sequence[Path], options: LogOptions) -> list[Record]:
    from ulna.identification import read_record

    names = {name: text for name, text, _ in named_values(options.column, "--column")}
    units = {name: text for name, text, _ in named_values(options.unit, "--unit")}
    read = partial(read_record, names=names, units=units, lost=options.lost, joined=options.joined, delay=options.delay)
    return [read(log) for log in logs]


def _bounds(entries: Sequence[str]) -> dict[str, tuple[str | None, str | None]]:
    """Ends as they are typed, None where one is left out."""
    found = {}
    for name, text, asked in named_values(entries, "--bounds"):
        low, colon, high = (part.strip() for part in text.partition(":"))
        if not colon:
            raise SimulationError(asked, "expected two values.", f'Write --bounds "{name}=0.1:2".')
        found[name] = (low or None, high or None)
    return found


def _print(fit: Fit, records: Sequence[Record], out: Path | None) -> None:
    from rich.markup import escape
    from rich.table import Table

    samples = sum(map(len, records))
    told = "1 parameter" if len(fit.estimates) == 1 else f"{len(fit.estimates)} parameters"
    say(f"{fit.system.name}: {told} from {samples} samples of {', '.join(_names(records))}")
    table = Table()
    for heading in ("parameter", "estimate", "standard error", "95 % interval", "verdict"):
        table.add_column(heading, overflow="fold")
    for each in fit.estimates:
        table.add_row(*map(escape, _row(each)))
    console().print(table)
    write_texts({f"residual of {test.output}": test.text for test in fit.tests}, indent=0)
    for held in fit.held_out:
        say(f"held out, {held.record}: {_explained(held)}", hanging=2)
    for note in fit.notes:
        say(f"note: {note}", hanging=2)
    if out is not None:
        say(f"plant: {out}")
    if not fit.converged:
        typer.secho(f"not converged: the search was stopped by {fit.stopped}", fg=typer.colors.YELLOW, err=True)


def _names(records: Sequence[Record]) -> list[str]:
    return [record.name for record in records]


def _row(each: Estimate) -> tuple[str, str, str, str, str]:
    value = f"{each.value:.6g} {each.unit}".rstrip()
    if not each.known:
        return each.name, value, "", "", f"not told: {each.reason}"
    note = f", {each.reason}" if each.reason else ""
    return each.name, value, f"{each.std:.2g}", f"{each.low:.6g} to {each.high:.6g}", f"known{note}"


def _explained(held: HeldOut) -> str:
    shares = (f"{100 * share:.4g} % of the variance of {name}" for name, share in held.explained.items())
    return f"it foretells {', '.join(shares)}"


def _data(fit: Fit) -> dict[str, Any]:
    return {
        "system": fit.system.name,
        "converged": fit.converged,
        "stopped": fit.stopped,
        "adequate": fit.adequate,
        "source": fit.source,
        "parameters": {
            each.name: {
                "value": each.value,
                "unit": each.unit,
                "std": each.std,
                "low": each.low,
                "high": each.high,
                "known": each.known,
                "reason": each.reason,
            }
            for each in fit.estimates
        },
        "correlation": fit.correlation.tolist(),
        "combinations": [dict(each) for each in fit.combinations],
        "initial": [dict(each) for each in fit.initial],
        "residuals": {
            test.output: {
                "rms": test.rms,
                "noise": test.noise,
                "unit": test.unit,
                "explained": test.explained,
                "whiteness": test.whiteness,
                "with_inputs": dict(test.with_inputs),
                "text": test.text,
            }
            for test in fit.tests
        },
        "held_out": [
            {"record": h.record, "errors": dict(h.errors), "ratios": dict(h.ratios), "explained": dict(h.explained)}
            for h in fit.held_out
        ],
        "condition": fit.condition,
        "aic": fit.aic,
        "notes": list(fit.notes),
    }
