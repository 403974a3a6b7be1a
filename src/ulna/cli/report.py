"""`ulna report PLANT`: all that is known of a plant and its loop, on one page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ulna.base import SimulationError
from ulna.cli.asked_plant import plant_in_file
from ulna.cli.asked_run import Run, best_run_of
from ulna.cli.option_groups import with_groups
from ulna.cli.options import Arithmetic, DesignOptions, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.supervisor import kept
from ulna.cli.terminal import progress

if TYPE_CHECKING:
    from ulna.base import Verdict


@with_groups
def report(
    plant: PlantOptions,
    run: RunOptions,
    out: Annotated[Path, typer.Option(help="The page to write (HTML).")],
    alone: Annotated[bool, typer.Option("--alone", help="The plant without any controller.")] = False,
    prove: Annotated[
        bool, typer.Option("--prove", help="Prove from where the continuous loop within its limits converges.")
    ] = False,
    *,
    design: DesignOptions,
    hardware: HardwareOptions,
) -> None:
    """Write one page about a plant: equations, verdicts with their reasons, controller, a run, and the loop to drive.

    With neither a controller nor poles nor weights it is the best controller that the plant has, with a set point; a
    plant that has none moves by itself. With --period and its kin the run is shown with and without the hardware.

    Examples:
        ulna report one_link_arm --out arm.html
        ulna report plant.toml --controller ctl.toml --initial "theta=60deg" --period 1e-3 --limit 24 --out page.html
        ulna report cart_pole --lqr 10,1,10,1:1 --local --prove --out cart.html
    """
    from ulna.page import report_page
    from ulna.page.report import require_folder

    require_folder(out)
    if prove and hardware.sampled:
        found = "the page shows the region of a continuous loop."
        raise SimulationError("--prove with --period", found, "Leave one of them out.")
    system = plant_in_file(plant)
    plain = replace(hardware, arithmetic=Arithmetic.plain) if hardware.sampled and not hardware.arithmetic else hardware
    with progress(f"designing for '{system.name}'"):
        asked = best_run_of(system, plant, run, design, plain, alone=alone)
    with progress("proving"):
        proof = _proof(asked) if prove else None
    given = bool(run.initial or run.observer_initial)
    with progress("analysing and writing the page"):
        path = report_page(
            asked.loop,
            out=out,
            initial=asked.initial if given else None,
            inputs=asked.inputs,
            parameters=asked.parameters,
            horizon=run.horizon,
            engine=asked.engine,
            seed=run.seed,
            proof=proof,
        )
    kept(f"{path} is written")
    typer.echo(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def _proof(asked: Run) -> Verdict:
    from ulna.certify import Region
    from ulna.certify import prove as proved

    moving = [name for name, value in asked.inputs.items() if not isinstance(value, float | int)]
    if moving:
        raise SimulationError(
            f"the input '{moving[0]}'", "it varies, and the proof is about an equilibrium.", "Give a number."
        )
    loop = replace(asked.loop, plant=asked.loop.plant.with_parameters(dict(asked.parameters)).with_values())
    return proved(loop, Region(), inputs=asked.inputs)
