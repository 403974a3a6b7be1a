"""`ulna studio`: a page on which a loop is driven by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ulna.base import SimulationError
from ulna.cli.asked_plant import plant_in_file
from ulna.cli.asked_run import best_run_of, run_of
from ulna.cli.option_groups import with_groups
from ulna.cli.options import Arithmetic, DesignOptions, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.terminal import progress

if TYPE_CHECKING:
    from ulna.loop import Loop
    from ulna.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shown(PlantOptions):
    """The plant that is shown; the paper's arm where none is named."""

    name: Annotated[
        str, typer.Argument(metavar="PLANT", help="A plant file (TOML or JSON) or a catalogue name; the paper's arm.")
    ] = "one_link_arm"


@with_groups
def studio(
    plant: _Shown,
    run: RunOptions,
    out: Annotated[
        Path | None, typer.Option(help="The page to write (HTML). Left out, it is opened in the browser.")
    ] = None,
    beside: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Another controller, shown side by side; as --controller. Repeatable."),
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(help="What `ulna prove --out` wrote: its region is drawn in the phase plane.")
    ] = None,
    alone: Annotated[bool, typer.Option("--alone", help="The plant without any controller.")] = False,
    replay: Annotated[
        Path | None, typer.Option(metavar="RESULT", help="The folder of a sweep: its run --run is replayed.")
    ] = None,
    number: Annotated[int | None, typer.Option("--run", help="Number of the run, from 0; with --replay.")] = None,
    paused: Annotated[bool, typer.Option("--paused", help="The page stands still until it is started.")] = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Write a page on which the loop moves in the browser and can be driven by hand: one file, no network.

    With neither a controller nor poles nor weights it is the best controller that the plant has, with a set point; a
    plant that has none moves by itself.
    """
    from ulna.certify import read_certificate
    from ulna.page import studio as write

    if out is not None and not out.absolute().parent.is_dir():
        raise SimulationError(f"--out '{out}'", "its folder does not exist.", "Create it first.")
    if (replay is None) != (number is None):
        raise SimulationError(
            "--replay and --run", "one of them is missing.", "Give the folder of a sweep and a number."
        )
    if replay is not None and number is not None:
        if (
            alone
            or beside
            or plant != _Shown()
            or run != RunOptions()
            or design != DesignOptions()
            or hardware != HardwareOptions()
        ):
            found = "options of another run are given; a recorded run has its own."
            raise SimulationError("--replay", found, "Leave them out.")
        _replayed(replay, number, out=out, certificate=certificate, paused=paused)
        return
    if alone and beside:
        raise SimulationError("--alone with --beside", "they exclude each other.", "Leave one of them out.")
    proved = None if certificate is None else read_certificate(certificate)
    system = plant_in_file(plant)
    plain = replace(hardware, arithmetic=Arithmetic.plain) if hardware.sampled and not hardware.arithmetic else hardware
    with progress(f"designing for '{system.name}'"):
        asked = best_run_of(system, plant, run, design, plain, alone=alone)
        others = [_other(system, plant, replace(run, controller=each), plain) for each in beside or ()]
    loops = [asked.loop, *others]
    names = [] if len(loops) == 1 else [_title(run, design), *(each.stem for each in beside or ())]
    moving = [name for name, value in asked.inputs.items() if not isinstance(value, float | int)]
    if moving:
        found = "it is a formula of time; in the page it is moved by hand."
        raise SimulationError(f"the input '{moving[0]}'", found, "Give the number that it starts with.")
    given = bool(run.initial or run.observer_initial)
    with progress("writing the page"):
        path = write(
            *loops,
            out=out,
            names=names,
            initial=asked.initial if given else None,
            parameters=asked.parameters,
            inputs={name: float(value) for name, value in asked.inputs.items()},
            certificate=proved,
            paused=paused,
        )
    _say(path)


def _say(path: Path) -> None:
    typer.echo(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def _replayed(folder: Path, number: int, *, out: Path | None, certificate: Path | None, paused: bool) -> None:
    """The page of one run of a sweep; the exit status is 1 where it is not what is stored."""
    from ulna.campaign import open_campaign, replay
    from ulna.certify import read_certificate
    from ulna.page import studio as write

    proved = None if certificate is None else read_certificate(certificate)
    result = open_campaign(folder)
    with progress(f"replaying run {number}"):
        found = replay(result, number)
    _say(write(found.trajectory, out=out, names=[f"run {number}"], certificate=proved, paused=paused))
    if not found.identical:
        typer.echo(f"NOT identical with the stored run: {', '.join(found.differing)}", err=True)
        raise typer.Exit(1)


def _other(system: System, plant: PlantOptions, run: RunOptions, hardware: HardwareOptions) -> Loop:
    return run_of(system, plant, run, DesignOptions(), hardware, varied=(), open_references=True).loop


def _title(run: RunOptions, design: DesignOptions) -> str:
    if run.controller is not None:
        return run.controller.stem
    return "designed here" if design.law or design.observer else "best"
