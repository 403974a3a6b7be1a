"""`ulna simulate PLANT`: the plant alone, or with the controller that the poles ask for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base.errors import SimulationError
from ulna.cli.hardware import (
    ClockJitter,
    Delay,
    Encoder,
    HardwareOptions,
    Limit,
    Missed,
    Noise,
    Period,
    Pulses,
    Resolution,
    Slew,
    Stop,
    require_period,
    sampled,
)
from ulna.cli.making import (
    AsSetPoint,
    AsTrack,
    ControllerPoles,
    DesignOptions,
    HighGain,
    InputOutput,
    Integral,
    Kalman,
    LoopMade,
    ObserverPoles,
    Weights,
    make_loop,
)
from ulna.cli.session import chosen, console, number_list, plant, plant_states, print_json, progress

if TYPE_CHECKING:
    from ulna.sim.trajectory import Trajectory
    from ulna.system import System


def simulate(
    name: Annotated[str, typer.Argument(metavar="PLANT", help="A plant file (TOML or JSON) or a catalogue name.")],
    initial: Annotated[str, typer.Option(help="Initial states of the plant in order, SI: '1,0,0'.")],
    time: Annotated[float, typer.Option(help="Length of the run, s.")] = 5.0,
    controller_poles: ControllerPoles = "",
    lqr: Weights = "",
    input_output: InputOutput = False,
    set_point: AsSetPoint = False,
    track: AsTrack = False,
    integral: Integral = False,
    observer_poles: ObserverPoles = "",
    high_gain: HighGain = None,
    kalman: Kalman = "",
    observer_initial: Annotated[
        str,
        typer.Option(
            help="Initial estimates; if left out what [operating_point] gives, else zero.", rich_help_panel="Observer"
        ),
    ] = "",
    period: Period = 0.0,
    delay: Delay = 0.0,
    encoder: Encoder = 0,
    resolution: Resolution = 0.0,
    noise: Noise = 0.0,
    slew: Slew = 0.0,
    jitter: ClockJitter = 0.0,
    missed: Missed = 0.0,
    pwm: Pulses = "",
    seed: Annotated[int, typer.Option(help="Of noise and clock.", rich_help_panel="Hardware (with --period)")] = 0,
    held: Annotated[list[str] | None, typer.Option("--input", help="Hold an input: 'u=1.5'. May be repeated.")] = None,
    limit: Limit = None,
    stop: Stop = None,
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

    With a law alone it reads the states, with an observer too it reads estimates. With --period both run on a
    processor, behind sensors and a drive.
    """
    if not time > 0:
        raise SimulationError("the length of the run", f"{time:g} s were given.", "Give a positive --time.")
    system = plant(name)
    wanted = chosen(DesignOptions, locals())
    hardware = chosen(HardwareOptions, locals())
    require_period(hardware)
    with progress(f"simulating '{system.name}'"):
        loop = make_loop(system.with_values(), wanted)
        loop = _with_estimates(loop, observer_initial)
        start = plant_states(system, initial)
        if hardware.sampled:
            if event or until or settle:
                raise SimulationError(
                    "--event, --until, --settle", "they are for a continuous loop.", "Leave them out."
                )
            trajectory = _run_sampled(system.with_values(), loop, start, time, hardware, held or [])
        else:
            reports = (event or [], until or [], settle or [])
            trajectory = _run(system.with_values(), loop, start, (time, samples), hardware, held or [], reports)
    if out is not None:
        write_trajectory(trajectory, out)
    if plot is not None:
        _plot(trajectory, plot)
    if as_json:
        print_json(_data(trajectory))
    else:
        _print(trajectory)


def _run(
    system: System,
    loop: LoopMade,
    start: dict[str, float],
    grid: tuple[float, int],
    hardware: HardwareOptions,
    held: list[str],
    reports: tuple[list[str], list[str], list[str]],
) -> Trajectory:
    """The continuous loop, or the plant alone."""
    import numpy as np

    from ulna.cli.rules import end_stops, reported, saturations
    from ulna.sim import Continuous
    from ulna.sim import simulate as run

    whole = system if loop.loop is None else loop.loop.system
    values = start | dict(loop.starts)
    return run(
        whole,
        [values.get(s.name, 0.0) for s in whole.states],
        np.linspace(0.0, *grid),
        inputs=_inputs([s.name for s in whole.inputs], held),
        time=Continuous(saturation=saturations(hardware.limit), end_stops=end_stops(system, hardware.stop)),
        events=reported(*reports),
        throw=False,
    )


def _run_sampled(
    system: System, loop: LoopMade, start: dict[str, float], time: float, hardware: HardwareOptions, held: list[str]
) -> Trajectory:
    """The plant in a loop with a processor; held values go to its disturbances and to the law's references."""
    from ulna.sim import simulate as run

    read = {s.name for s in (*system.states, *system.outputs)}
    law = () if loop.law is None else loop.law.system.inputs
    references = [s.name for s in law if s.name not in read]
    disturbances = [s.name for s in system.inputs if loop.law is None or s not in loop.law.system.outputs]
    values = _inputs([*disturbances, *references], held)
    clock = sampled(system, loop, hardware, {name: v for name, v in values.items() if name in references})
    free = {name: v for name, v in values.items() if name in disturbances}
    return run(system, start, time, inputs=free, time=clock, throw=False)


def _with_estimates(loop: LoopMade, text: str) -> LoopMade:
    """The loop with the estimates that the user gives; what else the controller remembers starts as it would."""
    if not text:
        return loop
    observer = None if loop.design is None else loop.design.observer
    names = [s.name for s in observer.system.outputs] if observer is not None else []
    numbers = number_list(text, "--observer-initial")
    if len(numbers) != len(names):
        found = f"{len(numbers)} numbers, {len(names)} estimates ({', '.join(names) or 'there is no observer'})."
        raise SimulationError("the initial estimates", found, "Give one for each.")
    return replace(loop, starts={**loop.starts, **dict(zip(names, numbers, strict=True))})


def _inputs(known: list[str], held: list[str]) -> dict[str, float]:
    values = {}
    for entry in held:
        name, _, value = entry.partition("=")
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
