"""`ulna replay RESULT --run K`: one run of a sweep again, bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.options import AsJson
from ulna.cli.simulate import write_trajectory
from ulna.cli.terminal import console, print_json, progress

if TYPE_CHECKING:
    from ulna.campaign import CampaignResult, Replay


def replay(
    folder: Annotated[Path, typer.Argument(metavar="RESULT", help="The folder of a sweep.")],
    run: Annotated[int, typer.Option(help="Number of the run, from 0.")],
    plot: Annotated[Path | None, typer.Option(help="Draw the run: a .png, .svg or .pdf file.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the run: a .nc (netCDF) or .csv file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Compute one run of a sweep again, compare it with what is stored, and show its path.

    The exit status is 1 where the two differ.
    """
    from ulna.campaign import open_campaign
    from ulna.campaign import replay as again

    result = open_campaign(folder)
    with progress(f"replaying run {run}"):
        found = again(result, run)
    if out is not None:
        write_trajectory(found.trajectory, out)
    if plot is not None:
        from ulna.plot import plot_trajectory, save_figure

        save_figure(plot_trajectory(found.trajectory, title=f"run {run}"), plot)
    if as_json:
        print_json(_data(result, found))
    else:
        _print(result, found)
    if not found.identical:
        raise typer.Exit(1)


def _data(result: CampaignResult, found: Replay) -> dict[str, Any]:
    trajectory = found.trajectory
    system = trajectory.system
    return {
        "run": found.number,
        "varied": {name: found.stored[name] for name in result.varied},
        "stored": dict(found.stored),
        "identical": found.identical,
        "differing": list(found.differing),
        "versions": {name: list(pair) for name, pair in found.versions.items()},
        "outcome": trajectory.outcome.name.lower(),
        "time": trajectory.times.tolist(),
        "signals": {s.name: trajectory[s.name].tolist() for s in (*system.states, *system.outputs)},
    }


def _print(result: CampaignResult, found: Replay) -> None:
    from rich.markup import escape
    from rich.table import Table

    show = console()
    table = Table(title=escape(f"run {found.number}: {found.trajectory.outcome.text}"), title_justify="left")
    for heading in ("", "stored", "again"):
        table.add_column(heading, justify="right" if heading else "left")
    for column in result.columns:
        table.add_row(escape(column.heading), f"{found.stored[column.name]:.12g}", f"{found.again[column.name]:.12g}")
    show.print(table)
    if found.identical:
        show.print("identical with the stored run, bit for bit")
    else:
        show.print(escape(f"NOT identical with the stored run: {', '.join(found.differing)}"))
        for name, (then, now) in found.versions.items():
            show.print(escape(f"{name} was {then}, is {now}"))
