"""`ulna sweep PLANT`: many runs of a loop, kept in a folder, and what they say."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ulna.cli.asked_plan import Sampling, map_axes, plan_of
from ulna.cli.asked_plant import plant_in_file
from ulna.cli.asked_run import run_of
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, DesignOptions, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.supervisor import kept
from ulna.cli.sweep_answers import answers, draw_answers, leading_figure, print_answers
from ulna.cli.terminal import print_json, progress

if TYPE_CHECKING:
    from ulna.campaign import Progress


@with_groups
def sweep(
    plant: PlantOptions,
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=KIND(…)",
            help="What varies, in SI; may be repeated: 'm2=uniform(0,5)', 'Ra=normal(1,0.1)', 'b=loguniform(0.1,1)', "
            "'theta=choice(-1,1)'; 'posterior' for all uncertain parameters of a fitted plant; for a grid "
            "each as 'm2=steps(0,5,21)' or 'm2=values(1,2,5)'.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the results; an interrupted sweep goes on where it was.")],
    run: RunOptions,
    runs: Annotated[int, typer.Option(help="Number of runs; with 'indices' of base points, a power of two.")] = 1024,
    sampling: Annotated[Sampling, typer.Option(help="How runs are drawn.")] = Sampling.random,
    batch_size: Annotated[int | None, typer.Option(help="Runs that are stored together; chosen if left out.")] = None,
    scheduler: Annotated[str, typer.Option(help="Address of a Dask scheduler; this machine if left out.")] = "",
    worst_by: Annotated[str, typer.Option(help="Figure by which runs are ranked as worst, such as 'peak_u'.")] = "",
    over: Annotated[str, typer.Option("--map", help="Axes of the map: 'm2,theta'; else the first two varied.")] = "",
    plot: Annotated[Path | None, typer.Option(help="Draw map, fan charts and worst case into this folder.")] = None,
    as_json: AsJson = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Run a plant under its controller many times, with whatever varies, and say how many runs settle.

    The controller is designed once, for the plant's nominal values. The same command on the same folder goes on
    with what is missing there.
    """
    from ulna.campaign import DaskWorkers, LocalWorkers
    from ulna.campaign import sweep as run_sweep

    system = plant_in_file(plant)
    plan = plan_of(system, vary, runs, run.seed, sampling)
    axes = map_axes(over, plan.names)
    with progress(f"designing for '{system.name}'"):
        asked = run_of(system, plant, run, design, hardware, varied=plan.names)
    kept(f"finished runs are kept in {out}; the same command goes on with those that are missing")
    with _bar() as tell:
        result = run_sweep(
            asked.loop,
            plan,
            horizon=run.horizon,
            engine=asked.engine,
            initial=asked.initial,
            parameters=asked.parameters,
            inputs=asked.inputs,
            store=out,
            batch_size=batch_size,
            workers=DaskWorkers(address=scheduler) if scheduler else LocalWorkers(),
            progress=tell,
        )
    worst_by = worst_by or leading_figure(result)
    with progress("looking at the results"):
        drawn = draw_answers(result, plot, worst_by=worst_by, axes=axes) if plot is not None else []
        data = answers(result, out, drawn, worst_by=worst_by)
    if as_json:
        print_json(data)
    else:
        print_answers(result, data)


@contextmanager
def _bar() -> Iterator[Callable[[Progress], None] | None]:
    """A progress bar with rate and time left, on a terminal; elsewhere nothing."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    parts = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn())
    with Bar(*parts, console=Console(stderr=True)) as bar:
        task = bar.add_task("runs", total=None, rate="")

        def tell(now: Progress) -> None:
            rate = f"{now.rate:,.0f} runs/s" if now.rate else ""
            bar.update(task, total=now.total, completed=now.done, rate=rate)

        yield tell
