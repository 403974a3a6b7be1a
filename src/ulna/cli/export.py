"""`ulna export`: a loop for other tools and for a processor."""

from __future__ import annotations

from dataclasses import asdict, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.base import SimulationError
from ulna.cli.asked_plant import plant_in_file
from ulna.cli.asked_run import Run, run_of
from ulna.cli.help import UlnaTyper
from ulna.cli.option_groups import with_groups
from ulna.cli.options import Arithmetic, AsJson, DesignOptions, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.terminal import UlnaGroup, print_json, progress
from ulna.cli.typed_values import number as number_of

if TYPE_CHECKING:
    from ulna.base import Verdict
    from ulna.deploy import Comparison, CProject, FixedPoint

app = UlnaTyper("A loop for a processor or for other simulators.", cls=UlnaGroup)


class _Fixed(StrEnum):
    q31 = "q31"
    q15 = "q15"


class _Number(StrEnum):
    float = "float"
    double = "double"


@app.callback()
def _export() -> None:
    """A loop for a processor."""


def _brings_period(run: RunOptions) -> bool:
    """Whether the controller in a file is in discrete time."""
    from ulna.system import read_system

    return run.controller is not None and read_system(run.controller).discrete


@app.command("c")
@with_groups
def export_c(
    plant: PlantOptions,
    run: RunOptions,
    out: Annotated[Path | None, typer.Option(help="Folder to write: new or empty.")] = None,
    library: Annotated[str, typer.Option(help="Name of the library; that of the plant if left out.")] = "",
    target: Annotated[str, typer.Option(help="generic, cortex-m0, cortex-m4f or cortex-m7.")] = "generic",
    number: Annotated[
        _Number | None,
        typer.Option("--number", help="Type of every number; left out: what the target computes."),
    ] = None,
    fixed: Annotated[
        _Fixed | None,
        typer.Option("--fixed", help="Integers instead: factors of products have 32 bits (q31) or 16 (q15)."),
    ] = None,
    ranges: Annotated[
        list[str] | None,
        typer.Option(
            "--range",
            metavar="NAME=LOW:HIGH",
            help="Of --fixed: the range of a measured signal, a reference, an input or a state of the controller, SI. "
            "Repeatable.",
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Compile it here and compare 100 000 samples with the simulation.")
    ] = False,
    measure: Annotated[
        bool, typer.Option("--measure", help="Count instructions and stack of a call on an emulated --target.")
    ] = False,
    verify: Annotated[
        Path | None, typer.Option(help="Write nothing: check whether this folder belongs to the design.")
    ] = None,
    as_json: AsJson = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Write the C that runs a controller on a processor, bit for bit as it was simulated.

    The exit status is 1 where the comparison finds a difference, or the folder is of another design.
    """
    from ulna.deploy import c_project, controllers_part
    from ulna.deploy import compare as compare_with
    from ulna.deploy import verify as verified

    if (out is None) == (verify is None):
        found = "neither is given." if out is None else "both are given."
        raise SimulationError("--out and --verify", found, "Give --out FOLDER to write, --verify FOLDER to check.")
    if not hardware.sampled and not _brings_period(run):
        raise SimulationError("ulna export c", "the loop has no period.", "Give --period 1e-3, say.")
    system = plant_in_file(plant)
    with progress(f"designing for '{system.name}'"):
        plain = hardware if hardware.arithmetic else replace(hardware, arithmetic=Arithmetic.plain)
        asked = run_of(system, plant, run, design, plain, open_references=True)
    if verify is not None or out is None:
        _tell_verdict(verified(verify or Path(), asked.loop), as_json=as_json)
        return
    initial = controllers_part(asked.loop, asked.initial)
    with progress("writing"):
        arithmetic = _fixed_point(fixed, ranges or [])
        made = c_project(
            asked.loop,
            out,
            name=library,
            target=target,
            precision=number,
            arithmetic=arithmetic,
            initial=initial,
            measure=measure,
        )
    compared = None
    if check:
        with progress("comparing with the simulation"):
            compared = compare_with(out, asked.loop, initial=asked.initial, inputs=asked.inputs)
    _tell(made, compared, asked, as_json=as_json)
    if compared is not None and not compared.equal:
        raise typer.Exit(1)


def _fixed_point(fixed: _Fixed | None, texts: list[str]) -> FixedPoint | None:
    from ulna.deploy import FixedPoint

    if fixed is None:
        if texts:
            raise SimulationError(f"--range '{texts[0]}'", "it is for fixed point.", "Add --fixed q31.")
        return None
    ranges = {}
    for text in texts:
        name, _, bounds = (part.strip() for part in text.partition("="))
        parts = bounds.split(":")
        if not name or len(parts) != 2:
            raise SimulationError(f"--range '{text}'", "expected a name and two ends.", "Write theta=-2:2.")
        ranges[name] = (number_of(parts[0], f"--range '{text}'"), number_of(parts[1], f"--range '{text}'"))
    return FixedPoint(factor=32 if fixed is _Fixed.q31 else 16, ranges=ranges)


class _Part(StrEnum):
    loop = "loop"
    controller = "controller"
    plant = "plant"


@app.command("fmu")
@with_groups
def export_fmu(
    plant: PlantOptions,
    run: RunOptions,
    out: Annotated[Path, typer.Option(help="File to write, new: arm.fmu, say.")],
    part: Annotated[_Part, typer.Option(help="What it holds.")] = _Part.loop,
    fmi: Annotated[int, typer.Option(help="Version of the standard: 3 or 2.")] = 3,
    as_json: AsJson = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Write a functional mock-up unit for co-simulation: the loop, its controller alone, or its plant alone.

    It holds C of its own and a binary for this machine. A loop samples every period, whatever the communication
    steps are.
    """
    from ulna.deploy import controllers_part, fmu
    from ulna.loop import Loop

    system = plant_in_file(plant)
    initial = {}
    if part is _Part.plant:
        loop = Loop(plant=system)
    else:
        if not hardware.sampled:
            raise SimulationError("ulna export fmu", "the loop has no period.", "Give --period 1e-3, say.")
        with progress(f"designing for '{system.name}'"):
            asked = run_of(system, plant, run, design, hardware, open_references=True)
        loop, initial = asked.loop, asked.initial
    if part is _Part.controller:
        initial = controllers_part(loop, initial)
    with progress("writing"):
        made = fmu(loop, out, part=part.value, version=fmi, initial=initial)
    names = {"inputs": made.inputs, "outputs": made.outputs, "parameters": made.parameters}
    if as_json:
        data = {"file": str(made.path), "part": str(made.part), "fmi": fmi, "design": made.design}
        print_json(data | {"platform": made.platform, **{k: list(v) for k, v in names.items()}})
        return
    typer.echo(f"{made.path}: FMI {fmi}.0 co-simulation of the {made.part}, design {made.design}")
    typer.echo(f"binary for {made.platform}" if made.platform else "sources only: there is no C compiler here")
    for what, found in names.items():
        if found:
            typer.echo(f"{what}: {', '.join(found)}")


def _tell(made: CProject, compared: Comparison | None, asked: Run, *, as_json: bool) -> None:
    shipped, fixed = made.firmware, made.fixed
    kind = shipped.precision.value if fixed is None else fixed.fixed.name
    if as_json:
        data: dict[str, Any] = {
            "folder": str(made.folder),
            "name": shipped.name,
            "design": shipped.fingerprint,
            "target": made.target.name,
            "number": kind,
            "operations": made.operations,
            "files": list(made.files),
        }
        if fixed is not None:
            data["accuracy"] = {
                "bounds": dict(fixed.bounds),
                "seen": dict(fixed.seen),
                "along_run": dict(fixed.difference),
            }
        if made.cost is not None:
            data["cost"] = asdict(made.cost)
        if compared is not None:
            data["comparison"] = {
                "equal": compared.equal,
                "samples": compared.samples,
                "against": compared.against,
                "first_difference": compared.first_difference,
                "largest": compared.largest,
            }
        print_json(data)
        return
    typer.echo(f"{made.folder}: {shipped.name}, design {shipped.fingerprint}, for {made.target.text}")
    typer.echo(
        f"{made.operations} operations on {kind} every {shipped.hardware.period} s, "
        f"{len(shipped.memory)} numbers of memory"
    )
    if fixed is not None:
        typer.echo(fixed.accuracy)
    if made.cost is not None:
        typer.echo(f"{made.cost}, on an emulated {made.target.name}")
    if compared is not None:
        typer.echo(str(compared))
    missing = [s.name for s in asked.loop.references if s.name not in asked.inputs]
    if missing:
        typer.echo(f"references to set at each call: {', '.join(missing)}")


def _tell_verdict(found: Verdict, *, as_json: bool) -> None:
    evidence = {name: list(v) if isinstance(v, tuple) else v for name, v in found.evidence.items()}
    if as_json:
        print_json({"belongs": found.holds, **evidence})
    else:
        typer.echo(found.claim if found.holds else f"NOT: {found.claim}")
        for what in ("changed", "missing"):
            if evidence[what]:
                typer.echo(f"{what} files: {', '.join(evidence[what])}")
        if evidence["design_now"] != evidence["design"]:
            typer.echo(f"the design is {evidence['design_now']} now")
    if not found.holds:
        raise typer.Exit(1)
