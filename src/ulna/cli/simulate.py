"""`ulna simulate PLANT`: the plant alone, or with the controller that the poles ask for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base.errors import SimulationError
from ulna.cli.making import ControllerPoles, DesignOptions, ObserverPoles, make_design
from ulna.cli.session import console, number_list, plant, print_json, progress

if TYPE_CHECKING:
    from ulna.sim.trajectory import Trajectory
    from ulna.system.system import System


def simulate(
    name: Annotated[str, typer.Argument(metavar="PLANT", help="A plant file (TOML or JSON) or a catalogue name.")],
    initial: Annotated[str, typer.Option(help="Initial states of the plant in order, SI: '1,0,0'.")],
    time: Annotated[float, typer.Option(help="Length of the run, s.")] = 5.0,
    controller_poles: ControllerPoles = "",
    observer_poles: ObserverPoles = "",
    observer_initial: Annotated[str, typer.Option(help="Initial estimates; zero if left out.")] = "",
    held: Annotated[list[str] | None, typer.Option("--input", help="Hold an input: 'u=1.5'. May be repeated.")] = None,
    limit: Annotated[
        list[str] | None, typer.Option(help="Limit an input: 'u=-24:24', 'u=24'; '24' for all. May be repeated.")
    ] = None,
    stop: Annotated[
        list[str] | None,
        typer.Option(help="End stop of a position, SI: 'theta=-pi/2:pi/2', with rebound 'theta=0:pi/2:0.5'."),
    ] = None,
    event: Annotated[
        list[str] | None, typer.Option(help="Report where an expression passes through zero: 'theta-1', 'top: omega'.")
    ] = None,
    until: Annotated[list[str] | None, typer.Option(help="End the run where an expression does.")] = None,
    settle: Annotated[
        list[str] | None, typer.Option(help="Report when an output stays in its 2 % band: 'y', 'y=0.5'.")
    ] = None,
    samples: Annotated[int, typer.Option(help="Number of output times.", min=2)] = 501,
    out: Annotated[Path | None, typer.Option(help="Write the run: a .nc (netCDF) or .csv file.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the run: a .png, .svg or .pdf file.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for machines.")] = False,
) -> None:
    """Simulate a plant open-loop, under a state-feedback law, or under a compensator.

    With --controller-poles the law is in the loop, with --observer-poles too the compensator of both.
    """
    import numpy as np

    from ulna.cli.rules import end_stops, reported, saturations
    from ulna.sim import Continuous
    from ulna.sim import simulate as run

    if not time > 0:
        raise SimulationError("the length of the run", f"{time:g} s were given.", "Give a positive --time.")
    system = plant(name)
    with progress(f"simulating '{system.name}'"):
        loop = _loop(system.with_values(), controller_poles, observer_poles)
        start = _initial(system, loop, initial, observer_initial)
        trajectory = run(
            loop,
            start,
            np.linspace(0.0, time, samples),
            inputs=_inputs(loop, held or []),
            time=Continuous(saturation=saturations(limit or []), end_stops=end_stops(system, stop or [])),
            events=reported(event or [], until or [], settle or []),
            throw=False,
        )
    if out is not None:
        write_trajectory(trajectory, out)
    if plot is not None:
        _plot(trajectory, plot)
    if as_json:
        print_json(_data(trajectory))
    else:
        _print(trajectory)


def _loop(system: System, controller_poles: str, observer_poles: str) -> System:
    from ulna.base import DesignError
    from ulna.design.control.compensator import close_loop

    if not controller_poles and not observer_poles:
        return system
    if not controller_poles:
        raise DesignError("a closed loop", "--observer-poles without --controller-poles.", "Give the law's poles too.")
    made = make_design(system, DesignOptions(controller_poles=controller_poles, observer_poles=observer_poles))
    controller = made.compensator or made.law
    if controller is None:
        raise DesignError("a closed loop", "no law was designed.")
    return close_loop(system, controller).system


def _initial(system: System, loop: System, initial: str, estimates: str) -> list[float]:
    first = number_list(initial, "--initial")
    n = len(system.states)
    if len(first) != n:
        names = ", ".join(s.name for s in system.states)
        raise SimulationError("the initial state", f"{len(first)} numbers, {n} states ({names}).", "Give one for each.")
    rest = len(loop.states) - n
    second = number_list(estimates, "--observer-initial") if estimates else [0.0] * rest
    if len(second) != rest:
        names = ", ".join(s.name for s in loop.states[n:]) or "none"
        found = f"{len(second)} numbers, {rest} states of the controller ({names})."
        raise SimulationError("the controller's initial state", found, "Give one for each.")
    return [*first, *second]


def _inputs(loop: System, held: list[str]) -> dict[str, float]:
    values = {}
    for entry in held:
        name, _, value = entry.partition("=")
        known = [s.name for s in loop.inputs]
        if name.strip() not in known or not value:
            found = f"inputs are: {', '.join(known) or 'none'}."
            raise SimulationError(f"--input '{entry}'", found, "Write --input name=value.")
        values[name.strip()] = number_list(value, f"--input {name}")[0]
    return values


def write_trajectory(trajectory: Trajectory, path: Path) -> None:
    """Write a run in the format that the ending names.

    Raises:
        SimulationError: another ending, or a place that cannot be written.
    """
    if path.suffix == ".csv":
        try:
            trajectory.to_pandas().to_csv(path)
        except OSError as error:
            raise SimulationError(f"the file '{path}'", f"it cannot be written ({error.strerror}).") from None
    elif path.suffix == ".nc":
        trajectory.to_netcdf(path)
    else:
        raise SimulationError(f"the file '{path}'", "its ending is neither .csv nor .nc.", "Choose one of the two.")


def _plot(trajectory: Trajectory, path: Path) -> None:
    from ulna.plot.save import save_figure
    from ulna.plot.trajectory import plot_trajectory

    save_figure(plot_trajectory(trajectory), path)


def _data(trajectory: Trajectory) -> dict[str, Any]:
    system = trajectory.system
    series = {s.name: trajectory[s.name].tolist() for s in (*system.states, *system.inputs, *system.outputs)}
    return {
        "system": system.name,
        "outcome": trajectory.outcome.name.lower(),
        "text": trajectory.outcome.text,
        "units": {s.name: s.unit for s in (*system.states, *system.inputs, *system.outputs)},
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
        "time": trajectory.times.tolist(),
        "signals": series,
    }


def _print(trajectory: Trajectory) -> None:
    from rich.markup import escape
    from rich.table import Table

    system = trajectory.system
    table = Table(title=escape(f"{system.name}: {trajectory.outcome.text}"), title_justify="left")
    for heading in ("signal", "at the start", "at the end", "smallest", "largest"):
        table.add_column(heading, justify="left" if heading == "signal" else "right")
    for signal in (*system.states, *system.inputs, *(o for o in system.outputs if o not in system.states)):
        values = trajectory[signal.name]
        numbers = (values[0], values[-1], values.min(), values.max())
        table.add_row(escape(signal.label), *(f"{v:.6g}" for v in numbers))
    console().print(table)
    if trajectory.events:
        console().print(_events(trajectory))
    if trajectory.outcome.name not in ("FINISHED", "STOPPED"):
        typer.secho(f"the run ended at t = {trajectory.times[-1]:.6g} s", fg=typer.colors.YELLOW, err=True)


_SHOWN = 40
"""Events that a table shows; JSON has them all."""


def _events(trajectory: Trajectory) -> Any:
    from rich.markup import escape
    from rich.table import Table

    count = len(trajectory.events)
    title = f"events (the first {_SHOWN} of {count})" if count > _SHOWN else "events"
    table = Table(title=title, title_justify="left")
    for heading in ("t [s]", "signal", "what", "direction"):
        table.add_column(escape(heading), justify="right" if heading == "t [s]" else "left")
    for event in trajectory.events[:_SHOWN]:
        way = {1: "up", -1: "down"}.get(event.direction, "")
        table.add_row(f"{event.time:.9g}", escape(event.signal), event.kind.value, way)
    return table
