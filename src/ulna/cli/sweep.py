"""`ulna sweep PLANT`: many runs of a closed loop, kept in a folder, and what they say."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

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
    ControllerPoles,
    DesignOptions,
    HighGain,
    InputOutput,
    Integral,
    Kalman,
    LoopMade,
    ObserverPoles,
    Weights,
    given_states,
    make_loop,
)
from ulna.cli.session import chosen, number_list, plant, plant_states, print_json, progress
from ulna.cli.sweep_answers import answers, draw_answers, leading_figure, print_answers

if TYPE_CHECKING:
    from ulna.campaign import Progress
    from ulna.design import ClosedLoop
    from ulna.sim import Continuous, Sampled
    from ulna.system import System

_VARY = re.compile(r"\s*([^\W\d]\w*)\s*=\s*(\w+)\((.*)\)\s*")


MOST_STEPS = 100_000
"""Of one axis of a grid, whose values all stand in the settings of the campaign."""


class Sampling(StrEnum):
    """How the runs are drawn from the distributions."""

    random = "random"
    latin = "latin"
    sobol = "sobol"
    indices = "indices"


def sweep(
    name: Annotated[str, typer.Argument(metavar="PLANT", help="A plant file (TOML or JSON) or a catalogue name.")],
    vary: Annotated[
        list[str],
        typer.Option(
            help="What varies, in SI; may be repeated: 'm2=uniform(0,5)', 'Ra=normal(1,0.1)', 'b=loguniform(0.1,1)', "
            "'theta=choice(-1,1)'; for a grid 'm2=steps(0,5,21)' or 'm2=values(1,2,5)' throughout."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the results; an interrupted sweep goes on where it was.")],
    controller_poles: ControllerPoles = "",
    lqr: Weights = "",
    input_output: InputOutput = False,
    integral: Integral = False,
    observer_poles: ObserverPoles = "",
    high_gain: HighGain = None,
    kalman: Kalman = "",
    initial: Annotated[
        str,
        typer.Option(help="Initial states of the plant in order, SI; else what [operating_point] gives, else zero."),
    ] = "",
    time: Annotated[float, typer.Option(help="Length of each run, s.")] = 5.0,
    runs: Annotated[int, typer.Option(help="Number of runs; with 'indices' of base points, a power of two.")] = 1024,
    seed: Annotated[int, typer.Option(help="From which everything random follows.")] = 0,
    sampling: Annotated[Sampling, typer.Option(help="How runs are drawn.")] = Sampling.random,
    period: Period = 0.0,
    delay: Delay = 0.0,
    encoder: Encoder = 0,
    resolution: Resolution = 0.0,
    noise: Noise = 0.0,
    slew: Slew = 0.0,
    jitter: ClockJitter = 0.0,
    missed: Missed = 0.0,
    pwm: Pulses = "",
    limit: Limit = None,
    stop: Stop = None,
    part: Annotated[int | None, typer.Option(help="Runs that are stored together; chosen if left out.")] = None,
    scheduler: Annotated[str, typer.Option(help="Address of a Dask scheduler; this machine if left out.")] = "",
    worst_by: Annotated[str, typer.Option(help="Figure by which runs are called worst, such as 'peak_u'.")] = "",
    over: Annotated[str, typer.Option("--map", help="Axes of the map: 'm2,theta'; else the first two varied.")] = "",
    plot: Annotated[Path | None, typer.Option(help="Draw map, fan charts and worst case into this folder.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for machines.")] = False,
) -> None:
    """Run a plant under its controller many times, with whatever varies, and say how many runs settle.

    The controller is designed once, for the plant's nominal values. The same command on the same folder goes on
    with what is missing there.
    """
    from ulna.campaign import Cluster, Local, campaign

    system = plant(name)
    plan = _plan(vary, runs, seed, sampling)
    axes = _axes(over, plan.names)
    wanted = chosen(DesignOptions, locals())
    hardware = chosen(HardwareOptions, locals())
    require_period(hardware)
    with progress(f"designing for '{system.name}'"):
        loop = make_loop(system, wanted)
    subject, settings = _engine(system, loop, hardware)
    with _bar() as tell:
        result = campaign(
            subject,
            plan,
            horizon=time,
            time=settings,
            initial=_initial(system, loop, initial, hardware),
            store=out,
            part=part,
            crew=Cluster(address=scheduler) if scheduler else Local(),
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


def _engine(
    system: System, loop: LoopMade, hardware: HardwareOptions
) -> tuple[ClosedLoop | System, Continuous | Sampled]:
    """What is run, and how time passes in it."""
    from ulna.cli.rules import end_stops, saturations
    from ulna.sim import Continuous

    if hardware.sampled:
        return system, sampled(system, loop, hardware)
    settings = Continuous(saturation=saturations(hardware.limit), end_stops=end_stops(system, hardware.stop))
    return loop.loop or system, settings


def _plan(vary: list[str], runs: int, seed: int, sampling: Sampling) -> Any:
    from ulna.campaign import CampaignError, LatinHypercube, Random, Saltelli, Sobol, grid

    read = [_varied(text) for text in vary]
    names = [name for name, _ in read]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise CampaignError(f"--vary {min(twice)}", "it stands twice.", "Vary a quantity once.")
    axes = {name: found for name, found in read if isinstance(found, list)}
    if axes:
        if len(axes) < len(read):
            drawn = next(name for name, found in read if not isinstance(found, list))
            raise CampaignError(
                f"--vary {drawn}", "it is drawn by chance, others lie on a grid.", "Give steps(...) or values(...)."
            )
        return grid(axes, seed=seed)
    spread: dict[str, Any] = dict(read)
    match sampling:
        case Sampling.random:
            return Random(vary=spread, runs=runs, seed=seed)
        case Sampling.latin:
            return LatinHypercube(vary=spread, runs=runs, seed=seed)
        case Sampling.sobol:
            return Sobol(vary=spread, runs=runs, seed=seed)
        case Sampling.indices:
            return Saltelli(vary=spread, base=runs, seed=seed)


def _axes(text: str, varied: tuple[str, ...]) -> tuple[str, ...]:
    """What the map is drawn over."""
    from ulna.campaign import CampaignError

    if not text:
        return varied[:2]
    names = tuple(name.strip() for name in text.split(","))
    if len(set(names)) != 2 or not set(names) <= set(varied):
        found = f"two of the varied quantities are needed; varied: {', '.join(varied)}."
        raise CampaignError(f"--map '{text}'", found, "Write --map m2,theta.")
    return names


def _varied(text: str) -> tuple[str, Any]:
    """Name, and a distribution or the values of a grid's axis."""
    import numpy as np

    from ulna.campaign import CampaignError, Choice, LogUniform, Normal, Uniform

    match = _VARY.fullmatch(text)
    if match is None:
        raise CampaignError(f"--vary '{text}'", "it cannot be read.", "Write --vary 'm2=uniform(0,5)'.")
    name, kind, inside = match.groups()
    numbers = number_list(inside, f"--vary {name}")
    counts = {"uniform": (2,), "loguniform": (2,), "normal": (2, 4), "steps": (3,), "choice": None, "values": None}
    if kind not in counts:
        raise CampaignError(f"--vary '{text}'", f"'{kind}' is unknown.", f"Known: {', '.join(counts)}.")
    wanted = counts[kind]
    if wanted is not None and len(numbers) not in wanted:
        due = " or ".join(map(str, wanted))
        raise CampaignError(f"--vary '{text}'", f"{len(numbers)} numbers, {kind} takes {due}.")
    if kind == "uniform":
        return name, Uniform(low=numbers[0], high=numbers[1])
    if kind == "loguniform":
        return name, LogUniform(low=numbers[0], high=numbers[1])
    if kind == "normal":
        low, high = numbers[2:] or (float("-inf"), float("inf"))
        return name, Normal(mean=numbers[0], std=numbers[1], low=low, high=high)
    if kind == "choice":
        return name, Choice(values=tuple(numbers))
    if kind == "values":
        return name, numbers
    if not (1 <= numbers[2] <= MOST_STEPS and numbers[2] == int(numbers[2])):
        raise CampaignError(
            f"--vary '{text}'", f"{numbers[2]:g} is no number of steps from 1 to {MOST_STEPS}.", "Write steps(0,5,21)."
        )
    return name, [float(v) for v in np.linspace(numbers[0], numbers[1], int(numbers[2]))]


def _initial(system: System, loop: LoopMade, text: str, hardware: HardwareOptions) -> dict[str, float]:
    """Where runs start unless they vary; a sampled controller's states are with its settings."""
    starts = plant_states(system, text) if text else given_states(system)
    return starts if hardware.sampled else starts | dict(loop.starts)


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
