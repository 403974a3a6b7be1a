"""`ulna simulate PLANT`: the plant alone, or in a loop with a controller and the hardware between them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base import SimulationError
from ulna.cli.asked_events import Settled, crossings, settled, settlings
from ulna.cli.asked_plant import plant_in_file
from ulna.cli.asked_run import Run, run_of
from ulna.cli.layout import columns, say
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, DesignOptions, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.supervisor import kept
from ulna.cli.terminal import console, print_json, progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ulna.report.run_figures import RunFigures
    from ulna.sim import Crossing, Event, Settling, Trajectory
    from ulna.system import Signal, System


MOST_SAMPLES = 10_000_000
"""Of one run, which is held in memory."""


@with_groups
def simulate(
    plant: PlantOptions,
    run: RunOptions,
    event: Annotated[
        list[str] | None,
        typer.Option(
            metavar="EXPRESSION", help="Report where an expression passes through zero: 'theta-1', 'top: omega'."
        ),
    ] = None,
    until: Annotated[
        list[str] | None, typer.Option(metavar="EXPRESSION", help="End the run where an expression does.")
    ] = None,
    settle: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OUTPUT[=TARGET]",
            help="Settling time of an output to 2 %: 'y' around its reference, else around its equilibrium; or "
            "'y=0.5'. Repeatable.",
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Number of output times.", min=2, max=MOST_SAMPLES)] = 501,
    out: Annotated[Path | None, typer.Option(help="Write the run: a .nc (netCDF) or .csv file.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the run: a .png, .svg or .pdf file.")] = None,
    as_json: AsJson = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Simulate a plant open-loop, under a state-feedback law, or under a compensator.

    With a law alone it reads the states, with an observer too it reads estimates. With --period both run on a
    processor, behind sensors and a drive. The exit status is 1 where the run does not reach its end.

    Examples:
        ulna simulate one_link_arm --best --initial 1,0,0 --settle y
        ulna simulate plant.toml --controller ctl.toml --initial "theta=60deg" --plot run.png --out run.csv
        ulna simulate one_link_arm --controller-poles=-4,-5,-6 --track --reference "y=0.5*sin(t)"
        ulna simulate one_link_arm --best --initial 1,0,0 --period 1e-3 --limit 24 --encoder 12
    """
    from ulna.report.run_figures import figure_data, figures_of, ranges_left

    system = plant_in_file(plant)
    with progress(f"simulating '{system.name}'"):
        asked = run_of(system, plant, run, design, hardware)
        goals = settlings(asked, settle or [])
        trajectory = _trajectory(asked, run, samples, crossings(event or [], until or []), goals)
        reached = settled(trajectory, goals)
        figures = figures_of(asked.loop, trajectory, inputs=asked.inputs, parameters=asked.parameters)
    if out is not None:
        write_trajectory(trajectory, out)
        kept(f"{out} is written")
    if plot is not None:
        _plot(asked, trajectory, figures, plot)
    if as_json:
        told = {} if figures is None else {"figures": figure_data(figures)}
        told |= {"ranges_left": list(ranges_left(asked.loop.plant, trajectory))}
        print_json(_data(trajectory, reached) | told)
    else:
        _print(asked.loop.plant, trajectory, reached, figures)
    if trajectory.outcome.name not in REACHED:
        raise typer.Exit(1)


REACHED = ("FINISHED", "STOPPED")
"""Outcomes of a run that did what it was told."""


def _trajectory(
    asked: Run, run: RunOptions, samples: int, crossed: tuple[Crossing, ...], goals: tuple[Settling, ...]
) -> Trajectory:
    import numpy as np

    from ulna.sim import simulate as run_loop

    loop = asked.loop
    if loop.sampled or loop.system.discrete:
        if crossed:
            raise SimulationError("--event, --until", "they are for a continuous loop.", "Leave them out.")
        times, events = run.horizon, ()
    else:
        times, events = np.linspace(0.0, run.horizon, samples), (*crossed, *goals)
    return run_loop(
        loop,
        asked.initial,
        times,
        inputs=asked.inputs,
        parameters=asked.parameters,
        engine=asked.engine,
        events=events,
        seed=run.seed,
        throw=False,
    )


def write_trajectory(trajectory: Trajectory, path: Path) -> None:
    """Write a run in the format that the ending names.

    Raises:
        SimulationError: another ending, or a place that cannot be written.
    """
    if path.suffix == ".csv":
        trajectory.to_csv(path)
    elif path.suffix == ".nc":
        trajectory.to_netcdf(path)
    else:
        raise SimulationError(f"the file '{path}'", "its ending is neither .csv nor .nc.", "Choose one of the two.")


def _plot(asked: Run, trajectory: Trajectory, figures: RunFigures | None, path: Path) -> None:
    """The run with its set points and limits."""
    from ulna.plot.save import save_figure
    from ulna.plot.trajectory import plot_trajectory
    from ulna.report.run_figures import levels_of

    save_figure(plot_trajectory(trajectory, levels=levels_of(asked.loop, figures)), path)


def _data(trajectory: Trajectory, reached: Sequence[Settled]) -> dict[str, Any]:
    system = trajectory.system
    shown = (*system.states, *system.inputs, *system.outputs, *_estimates(trajectory))
    series = {s.name: trajectory[s.name].tolist() for s in shown}
    return {
        "system": system.name,
        "outcome": trajectory.outcome.name.lower(),
        "text": trajectory.outcome.text,
        "note": trajectory.note,
        "units": {s.name: s.unit for s in shown},
        "events": [
            {
                "time": event.time,
                "kind": event.kind.name.lower(),
                "signal": event.signal,
                "direction": event.direction,
                "state": list(event.state),
            }
            for event in trajectory.events
        ],
        "modes": [{"start": m.start, "end": m.end, "held": list(m.held)} for m in trajectory.modes],
        "settling": [{"output": each.output, "target": each.target, "time": each.time} for each in reached],
        "time": trajectory.times.tolist(),
        "signals": series,
    }


def _estimates(trajectory: Trajectory) -> list[Signal]:
    """What an estimator on a processor shows; of a continuous one the estimates are states or outputs."""
    return [series.signal for series in trajectory.further.values() if series.role == "estimate"]


def _print(plant: System, trajectory: Trajectory, reached: Sequence[Settled], figures: RunFigures | None) -> None:
    from rich.markup import escape

    from ulna.report.run_figures import figure_lines, ranges_left

    system = trajectory.system
    say(f"{system.name}: {trajectory.outcome.text}")
    outputs = (o for o in system.outputs if o not in system.states)
    signals = (*system.states, *system.inputs, *outputs, *_estimates(trajectory))
    _print_signals([(signal.label, trajectory[signal.name]) for signal in signals])
    if figures is not None:
        units = {signal.name: signal.unit for signal in signals}
        for text in figure_lines(figures, units):
            say(text, hanging=2)
    for text in ranges_left(plant, trajectory):
        say(text, hanging=2)
    events = [event for event in trajectory.events if event.kind.name not in STAYS]
    if events:
        console().print(_events(events))
    for line in _stays(trajectory):
        console().print(escape(line))
    for each in reached:
        say(each.text, hanging=2)
    if trajectory.note:
        say(trajectory.note)
    if trajectory.outcome.name not in REACHED:
        typer.secho(f"the run ended at t = {trajectory.times[-1]:.6g} s", fg=typer.colors.YELLOW, err=True)


def _print_signals(rows: Sequence[tuple[str, Any]]) -> None:
    """A signal a line, numbers below each other; on a narrow terminal its name a line of its own."""
    headings = ("at the start", "at the end", "smallest", "largest")
    from ulna.report.run_figures import without_dust

    widest = max(len(label) for label, _ in rows)
    narrow = widest + 2 + 4 * 14 > columns()
    typer.echo(f"{'' if narrow else ' ' * (widest + 2)}{''.join(f'{heading:>14}' for heading in headings)}".rstrip())
    for label, values in rows:
        shown = (values[0], values[-1], values.min(), values.max())
        numbers = "".join(f"{without_dust(v, abs(values).max()):>14.6g}" for v in shown)
        typer.echo(f"{label}\n{numbers}" if narrow else f"{label:<{widest}}  {numbers}")


_SHOWN = 40
"""Events that a table shows; JSON has them all."""


STAYS = ("HELD", "RELEASED")
"""Events that are told in words."""


def _stays(trajectory: Trajectory) -> list[str]:
    """When the motion comes to stay on a surface, and when it goes on."""
    found, states = [], {signal.name for signal in trajectory.system.states}
    for event in trajectory.events:
        if event.kind.name in STAYS:
            sticks = event.signal.partition(" = ")[0] in states
            ways = ("sticks", "slips") if sticks else ("stays on the surface", "leaves the surface")
            what = ways[event.kind.name == "RELEASED"]
            found.append(f"{what} at t = {event.time:.6g} s ({event.signal})")
    more = len(found) - _SHOWN
    return found if more <= 0 else [*found[:_SHOWN], f"and {more} times more"]


def _events(events: Sequence[Event]) -> Any:
    from rich.markup import escape
    from rich.table import Table

    count = len(events)
    title = f"events (the first {_SHOWN} of {count})" if count > _SHOWN else "events"
    table = Table(title=title, title_justify="left")
    for heading in ("t [s]", "signal", "what", "direction"):
        table.add_column(escape(heading), justify="right" if heading == "t [s]" else "left")
    for event in events[:_SHOWN]:
        way = {1: "up", -1: "down"}.get(event.direction, "")
        table.add_row(f"{event.time:.9g}", escape(event.signal), event.kind.value, way)
    return table
