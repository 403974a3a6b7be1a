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

from ulna.cli.making import ControllerPoles, DesignOptions, ObserverPoles, make_design
from ulna.cli.session import console, number_list, plant, print_json, progress

if TYPE_CHECKING:
    from ulna.campaign import CampaignResult, Progress
    from ulna.design.control.compensator import ClosedLoop
    from ulna.sim import Continuous, Sampled
    from ulna.system.system import System

_VARY = re.compile(r"\s*([^\W\d]\w*)\s*=\s*(\w+)\((.*)\)\s*")


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
    observer_poles: ObserverPoles = "",
    initial: Annotated[str, typer.Option(help="Initial states of the plant in order, SI; zero if left out.")] = "",
    time: Annotated[float, typer.Option(help="Length of each run, s.")] = 5.0,
    runs: Annotated[int, typer.Option(help="Number of runs; with 'indices' of base points, a power of two.")] = 1024,
    seed: Annotated[int, typer.Option(help="From which everything random follows.")] = 0,
    sampling: Annotated[Sampling, typer.Option(help="How runs are drawn.")] = Sampling.random,
    period: Annotated[float, typer.Option(help="Run the controller sampled, with this period in s.")] = 0.0,
    limit: Annotated[float, typer.Option(help="With --period: limit of every driven input, SI.")] = 0.0,
    part: Annotated[int, typer.Option(help="Runs that are stored together.")] = 10_000,
    scheduler: Annotated[str, typer.Option(help="Address of a Dask scheduler; this machine if left out.")] = "",
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
    with progress(f"designing for '{system.name}'"):
        loop = _loop(system, controller_poles, observer_poles)
    subject, settings = _engine(system, loop, period, limit)
    with _bar() as tell:
        result = campaign(
            subject,
            plan,
            horizon=time,
            time=settings,
            initial=_initial(system, initial),
            store=out,
            part=part,
            crew=Cluster(address=scheduler) if scheduler else Local(),
            progress=tell,
        )
    drawn = _draw(result, plot) if plot is not None else []
    if as_json:
        print_json(_data(result, out, drawn))
    else:
        _print(result, out, drawn)


def _loop(system: System, controller_poles: str, observer_poles: str) -> ClosedLoop | System:
    from ulna.base import DesignError
    from ulna.design.control.compensator import close_loop

    if not controller_poles:
        if observer_poles:
            raise DesignError(
                "a closed loop", "--observer-poles without --controller-poles.", "Give the law's poles too."
            )
        return system
    options = DesignOptions(controller_poles=controller_poles, observer_poles=observer_poles)
    made = make_design(system.with_values(), options)
    controller = made.compensator or made.law
    if controller is None:
        raise DesignError("a closed loop", "no law was designed.")
    return close_loop(system, controller)


def _engine(
    system: System, loop: ClosedLoop | System, period: float, limit: float
) -> tuple[ClosedLoop | System, Continuous | Sampled]:
    """What is run, and how time passes in it."""
    from ulna.base import SimulationError
    from ulna.design.control.compensator import ClosedLoop
    from ulna.sim import Continuous, Sampled, Saturation

    if period == 0.0:
        if limit:
            raise SimulationError("--limit", "it is for a sampled loop.", "Give --period too.")
        return loop, Continuous()
    if not isinstance(loop, ClosedLoop):
        raise SimulationError("--period", "there is no controller to be sampled.", "Give --controller-poles.")
    bounds = Saturation(lower=-limit, upper=limit) if limit else None
    return system, Sampled(controller=loop.controller.system, period=period, saturation=bounds)


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
    if not (numbers[2] >= 1 and numbers[2] == int(numbers[2])):
        raise CampaignError(f"--vary '{text}'", f"{numbers[2]:g} is no number of steps.", "Write steps(0,5,21).")
    return name, [float(v) for v in np.linspace(numbers[0], numbers[1], int(numbers[2]))]


def _initial(system: System, text: str) -> dict[str, float]:
    from ulna.base import SimulationError

    if not text:
        return {}
    numbers = number_list(text, "--initial")
    names = [s.name for s in system.states]
    if len(numbers) != len(names):
        found = f"{len(numbers)} numbers, {len(names)} states ({', '.join(names)})."
        raise SimulationError("the initial state", found, "Give one for each.")
    return dict(zip(names, numbers, strict=True))


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


def _draw(result: CampaignResult, folder: Path) -> list[Path]:
    from ulna.base import UlnaError
    from ulna.campaign import fan, replay, settled_map, worst_cases
    from ulna.plot import plot_fan, plot_settled_map, plot_trajectory, save_figure

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UlnaError(f"the folder '{folder}'", f"it cannot be made ({error.strerror}).") from None
    drawn = []
    if len(result.varied) > 1:
        found = settled_map(result, *result.varied[:2])
        drawn.append(save_figure(plot_settled_map(found), folder / "settled_map.svg"))
    for signal in _judged(result):
        figure = plot_fan(fan(result, signal), title=f"{signal} in {result.runs} runs")
        drawn.append(save_figure(figure, folder / f"fan_{signal}.svg"))
    figure_name = _leading(result)
    worst = worst_cases(result, figure_name, count=1)[0]
    shown = plot_trajectory(replay(result, worst.number).trajectory, title=f"run {worst.number}: worst {figure_name}")
    drawn.append(save_figure(shown, folder / "worst.svg"))
    return drawn


def _judged(result: CampaignResult) -> list[str]:
    return [c.name.removeprefix("peak_error_") for c in result.columns if c.name.startswith("peak_error_")]


def _leading(result: CampaignResult) -> str:
    """The figure by which runs are called worst: how far the first output is off at the end."""
    names = _judged(result)
    return f"steady_error_{names[0]}" if names else "end_time"


def _data(result: CampaignResult, out: Path, drawn: list[Path]) -> dict[str, Any]:
    import numpy as np

    from ulna.campaign import quantiles, sensitivity, settled_fraction, worst_cases
    from ulna.campaign.runs import OUTCOMES

    settled = settled_fraction(result)
    table = quantiles(result)
    counts = np.bincount(result["outcome"].astype(int), minlength=len(OUTCOMES))
    data = {
        "system": result.experiment.system.name,
        "folder": str(out),
        "runs": result.runs,
        "settled": {"value": settled.value, "low": settled.low, "high": settled.high, "count": settled.count},
        "outcomes": {name: int(count) for name, count in zip(OUTCOMES, counts, strict=True) if count},
        "quantiles": {
            "levels": table["level"].values.tolist(),
            **{str(name): values.values.tolist() for name, values in table.data_vars.items()},
        },
        "worst": [
            {"run": case.number, "figure": _leading(result), "value": case.value, "outcome": case.outcome}
            | {"varied": dict(case.varied)}
            for case in worst_cases(result, _leading(result), count=5)
        ],
        "figures": [str(path) for path in drawn],
    }
    if type(result.experiment.plan).__name__ == "Saltelli":
        data["indices"] = {
            figure: {
                "names": list(found.names),
                "first_order": found.first_order.tolist(),
                "total": found.total.tolist(),
            }
            for figure in [f"peak_error_{name}" for name in _judged(result)]
            for found in [sensitivity(result, figure)]
        }
    return data


def _print(result: CampaignResult, out: Path, drawn: list[Path]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from ulna.campaign import settled_fraction

    data = _data(result, out, drawn)
    show = console()
    show.print(f"{result.runs} runs, settled: [bold]{settled_fraction(result)}[/bold]")
    rest = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in data["outcomes"].items())
    show.print(f"outcomes: {rest}")
    levels = data["quantiles"].pop("levels")
    table = Table(title="quantiles", title_justify="left")
    for heading in ("figure", *(f"{level:g}" for level in levels)):
        table.add_column(heading, justify="left" if heading == "figure" else "right")
    units = {column.name: column.unit for column in result.columns}
    for name, values in data["quantiles"].items():
        label = f"{name} [{units[name]}]" if units[name] else name
        table.add_row(escape(label), *(f"{value:.4g}" for value in values))
    show.print(table)
    worst = Table(title=escape(f"worst by {_leading(result)}"), title_justify="left")
    for heading in ("run", "outcome", "value", *result.varied):
        worst.add_column(escape(heading), justify="right")
    for case in data["worst"]:
        numbers = [f"{case['value']:.6g}", *(f"{v:.6g}" for v in case["varied"].values())]
        worst.add_row(str(case["run"]), case["outcome"].replace("_", " "), *numbers)
    show.print(worst)
    for figure, found in data.get("indices", {}).items():
        parts = zip(found["names"], found["first_order"], found["total"], strict=True)
        text = ", ".join(f"{name} {first:.3f} ({total:.3f})" for name, first, total in parts)
        show.print(escape(f"{figure} depends on, alone (in all): {text}"))
    for path in drawn:
        show.print(f"drawn: {escape(str(path))}")
    show.print(escape(f"one of them again: ulna replay {out} --run {data['worst'][0]['run']}"))
