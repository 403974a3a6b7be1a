"""`ulna excite PLANT`: the input to log, from which parameters come out most surely."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ulna.base import SimulationError
from ulna.cli.asked_plant import plant_of, signal_values
from ulna.cli.files import write_text
from ulna.cli.option_groups import with_groups
from ulna.cli.options import AsJson, PlantOptions
from ulna.cli.terminal import print_json, progress
from ulna.cli.typed_values import known_name, named_values, quantity, typed_list, unit_in

if TYPE_CHECKING:
    from ulna.identification import Excitation


@with_groups
def excite(
    plant: PlantOptions,
    free: Annotated[str, typer.Option(metavar="NAMES", help="Parameters to be identified: 'm2,Ra'.")],
    limit: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=LOW:HIGH",
            help="Keep an input, a state or an output within: 'u=24' (both ways), 'theta=-60deg:60deg'. All inputs "
            "need one. Repeatable.",
        ),
    ],
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="Length of the log.")] = 10.0,
    samples: Annotated[int, typer.Option(help="How often the input may change.")] = 1000,
    noise: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=SIZE", help="Standard deviation of an output: 'y=0.1deg'. Left out, 0.001 SI."),
    ] = None,
    initial: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Initial states of the log, inputs at 0: 'theta=90deg'."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the input (CSV).")] = None,
    as_json: AsJson = False,
) -> None:
    """Find the input within limits from which parameters are identified best.

    Examples:
        ulna excite one_link_arm --free m2,Ra --limit u=24 --initial theta=90deg --duration 4 --out input.csv
    """
    from ulna.identification import excite as best

    system = plant_of(plant)
    signals = {s.name: s for s in (*system.states, *system.inputs, *system.outputs)}
    limits = {}
    for name, text, asked in named_values(limit, "--limit"):
        signal = signals[known_name(name, list(signals), asked, "input, state or output")]
        ends = [float(quantity(end, asked, unit=unit_in(system, signal))) for end in text.split(":")]
        if len(ends) > 2:
            raise SimulationError(asked, "expected one value or two.", f'Write --limit "{name}=-1:1".')
        limits[name] = ends[0] if len(ends) == 1 else (ends[0], ends[1])
    with progress("looking for an input"):
        found = best(
            system,
            typed_list(free),
            limits=limits,
            duration=duration,
            samples=samples,
            noise=signal_values(system, system.outputs, noise or [], "--noise", "output"),
            initial=signal_values(system, system.states, initial, "--initial", "state") if initial else None,
        )
    if out is not None:
        write_text(out, found.csv())
    if as_json:
        keys = ("standard_errors", "relative_errors", "step_errors", "noise", "reached", "limited_by")
        print_json({"shape": found.shape.value} | {key: getattr(found, key) for key in keys})
    else:
        _tell(found, out)


def _tell(found: Excitation, out: Path | None) -> None:
    typer.echo(f"{found.shape}, {found.motion.times[-1]:g} s; standard errors that a fit of its log can reach (SI):")
    for name, error in found.standard_errors.items():
        share, step = found.relative_errors[name], found.step_errors[name]
        typer.echo(f"  {name}: {error:.3g} ({share:.2%}); from a single step {step:.3g}")
    used = ", ".join(f"{name} {share:.0%}" for name, share in found.reached.items())
    typer.echo(f"limits used: {used}; what limits it most: {found.limited_by}")
    typer.echo(f"input: {out}" if out is not None else "Next: --out input.csv writes the input.")
