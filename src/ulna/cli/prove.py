"""`ulna prove PLANT`: whether a loop within its limits is stable, with a certificate."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base import SimulationError, evidence_label
from ulna.cli.asked_plan import POSTERIOR
from ulna.cli.asked_plant import plant_in_file, require_in_range
from ulna.cli.asked_run import run_of
from ulna.cli.layout import broken, shown
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, DesignOptions, Exact, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.terminal import print_json, progress
from ulna.cli.typed_values import known_name, named_values, quantity, unit_in

if TYPE_CHECKING:
    import sympy as sp

    from ulna.base import Verdict
    from ulna.certify import Claim
    from ulna.loop import Loop
    from ulna.system import System

SIGMAS = 2.0
"""Standard deviations either side of a fitted value where `--over posterior` does not say how many."""


@with_groups
def prove(
    plant: PlantOptions,
    run: RunOptions,
    within: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SIZE",
            help="Runs that start this near the equilibrium, either side, converge: 'theta=90deg, omega=5'. Left out: "
            "the largest ellipsoid that is found; with --period the largest box.",
        ),
    ] = None,
    everywhere: Annotated[
        bool, typer.Option("--global", help="All runs converge, wherever they start (a loop without limits).")
    ] = False,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW..HIGH",
            help="For every value of these parameters of the plant the loop is stable at rest: 'm2=4..5, Ra=±10%'; "
            "'posterior=2': all uncertain parameters of a fitted plant, 2 standard deviations either side. The "
            "controller keeps its design values.",
        ),
    ] = None,
    boxes: Annotated[int, typer.Option("--boxes", min=1, help="How many the search may look at.")] = 60_000,
    out: Annotated[Path | None, typer.Option(help="Write the certificate for `ulna check` (JSON).")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw the proved region beside sampled runs: a .png, .svg or .pdf file.")
    ] = None,
    plane: Annotated[
        str | None, typer.Option(metavar="STATE,STATE", help="With --plot: the two states; left out the first two.")
    ] = None,
    exact: Exact = False,
    as_json: AsJson = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Prove that a loop within its limits (--limit) converges, or show why not.

    On a processor (--period, --delay, --encoder) its runs end up and stay in a box whose size follows from the steps of
    the encoder. The exit status is 0 for any verdict.
    """
    from ulna.certify import prove as proved

    if out is not None and not out.absolute().parent.is_dir():
        raise SimulationError(f"--out '{out}'", "its folder does not exist.", "Create it first.")
    given = [name for name, value in (("--global", everywhere), ("--within", within), ("--over", over)) if value]
    _check_together(given, plot, plane, sampled=hardware.sampled)
    system = plant_in_file(plant)
    ranges = list(_ranges(system, over or []))
    with progress(f"designing for '{system.name}'"):
        varied = [name for name, *_ in ranges]
        asked = run_of(system, plant, run, design, hardware, varied=varied or None)
    loop = replace(asked.loop, plant=asked.loop.plant.with_parameters(dict(asked.parameters)))
    moving = [name for name, value in asked.inputs.items() if not isinstance(value, float | int)]
    if moving:
        raise SimulationError(
            f"the input '{moving[0]}'", "it varies, and the proof is about an equilibrium.", "Give a number."
        )
    with progress("proving"):
        claim = _over(loop, ranges) if ranges else _claim(loop, within or [], everywhere=everywhere)
        verdict = proved(loop, claim, inputs=asked.inputs, boxes=boxes)
    certificate = verdict.evidence.get("certificate")
    if out is not None and certificate is not None:
        certificate.write(out)
    if plot is not None and certificate is not None:
        _plot(verdict, loop, plane, plot)
    if as_json:
        print_json({"status": verdict.status.value, "claim": verdict.claim, **_plain(verdict)})
    else:
        _tell(verdict, exact=exact)
        for what, path in (("certificate", out), ("figure", plot)):
            if path is not None:
                typer.echo(f"{what}: {path}" if certificate is not None else f"no {what}: nothing was proved")


def _check_together(given: list[str], plot: Path | None, plane: str | None, *, sampled: bool) -> None:
    """Refuse options that do not go together; given are those of the claim."""
    if len(given) > 1:
        raise SimulationError(" with ".join(given), f"these are {len(given)} claims.", "Give one of them.")
    if sampled and ({"--global", "--over"} & {*given} or plot is not None):
        asked = "--plot" if plot is not None else given[0]
        found = "of a loop on a processor a box is proved in which its runs end."
        raise SimulationError(f"{asked} with --period", found, "Leave one of them out.")
    if plot is not None and {"--global", "--over"} & {*given}:
        found = f"{given[0]} has no region to draw."
        raise SimulationError("--plot", found, "Leave --plot out, or ask for --within or for nothing.")
    if plane is not None and plot is None:
        raise SimulationError("--plane", "it is for a figure, and none is asked for.", "Add --plot region.png.")


def _plot(verdict: Verdict, loop: Loop, plane: str | None, path: Path) -> None:
    from ulna.plot import plot_region, save_figure

    states = tuple(name.strip() for name in plane.split(",")) if plane else ()
    units = {s.name: s.unit for s in loop.plant.states}
    with progress("drawing"):
        save_figure(plot_region(verdict, states, units=units), path)


def _claim(loop: Loop, within: list[str], *, everywhere: bool) -> Claim:
    from ulna.certify import GloballyStable, Region, StableWithin, UltimateBound

    if everywhere:
        return GloballyStable()
    if not within:
        return UltimateBound() if loop.sampled else Region()
    units = {s.name: unit_in(loop.plant, s) for s in loop.plant.states}
    box = {
        name: float(quantity(value.lstrip("±+ "), asked, unit=units.get(name)))
        for name, value, asked in named_values(within, "--within")
    }
    return UltimateBound(box=box) if loop.sampled else StableWithin(box=box)


def _ranges(system: System, over: list[str]) -> Iterator[tuple[str, str, str]]:
    """Name, range and what was asked; `posterior=2` stands for all parameters that have a standard deviation."""
    entries = [f"{each}={SIGMAS:g}" if each.strip() == POSTERIOR else each for each in over]
    for name, text, asked in named_values(entries, "--over"):
        if name != POSTERIOR:
            yield name, text, asked
            continue
        from ulna.campaign import posterior

        sigmas = float(quantity(text, asked))
        if not sigmas > 0:
            raise SimulationError(
                asked, "expected a positive number of standard deviations.", "Write --over posterior=2."
            )
        for each, (low, high) in posterior(system).box(sigmas).items():
            yield each, f"{low!r}..{high!r}", f"{asked}, of '{each}'"


def _over(loop: Loop, ranges: list[tuple[str, str, str]]) -> Claim:
    """The claim over parameters, each `4..5`, `4..5 kg`, `±10%` of its value or `±0.5`."""
    from ulna.certify import Over

    known = {p.name: p for p in loop.plant.parameters}
    bounds: dict[str, tuple[sp.Expr, sp.Expr]] = {}
    for name, text, asked in ranges:
        parameter = known[known_name(name, list(known), asked, what="parameter")]
        unit = unit_in(loop.plant, parameter)
        low, dots, high = (part.strip() for part in text.partition(".."))
        if dots and low and high:
            bounds[name] = (quantity(low + _unit_of(high, low), asked, unit=unit), quantity(high, asked, unit=unit))
            continue
        around = re.fullmatch(r"(?:±|\+/?-)\s*(?P<size>.+)", text)
        if around is None:
            raise SimulationError(asked, "it has no bounds.", f'Write --over "{name}=4..5" or --over "{name}=±10%".')
        middle = parameter.si_value
        if middle is None:
            raise SimulationError(
                asked, f"'{name}' has no value for the interval to be around.", f'Write --over "{name}=4..5".'
            )
        share = around["size"].endswith("%")
        size = quantity(around["size"], asked, unit=None if share else unit) * (abs(middle) if share else 1)
        bounds[name] = (middle - size, middle + size)
    for name, _, asked in ranges:
        for end in bounds[name]:
            require_in_range(known[name], end, asked)
    return Over(parameters=bounds)


def _unit_of(high: str, low: str) -> str:
    """The unit of the upper bound where the lower one has none."""
    found = re.search(r"(?<=[\d.)])\s*([^\W\d]|[°%])[^\s()]*$", high)
    bare = re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", low)
    return found.group(0) if found and bare and not re.fullmatch(r"[-+\d.eE]+", high) else ""


def _plain(verdict: Verdict) -> dict[str, Any]:
    return {
        name: str(v) if isinstance(v, complex) else v for name, v in verdict.evidence.items() if name != "certificate"
    }


def _tell(verdict: Verdict, *, exact: bool) -> None:
    typer.echo(str(verdict))
    for name, value in _plain(verdict).items():
        text = shown(value, exact=exact)
        if isinstance(value, dict):
            parts = {key: shown(part, exact=exact) for key, part in value.items()}
            text = ", ".join(f"{key} ({part})" if "," in part else f"{key} {part}" for key, part in parts.items())
        for line in broken(f"  {evidence_label(name)}: ", text):
            typer.echo(line)
