"""`ulna new FILE`: a commented plant file that works, to be changed into one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ulna.base import PlantError
from ulna.cli.files import write_text

_PLANT = """# A plant for ulna: change the lines below into yours, they work as they are.
# Everything that is possible here: docs/plant-file.md.

format = 1
name = "NAME"
text = "a pendulum with a motor at its joint"   # what it is, in a line; may be left out

[parameters]                  # what is constant: value and unit, or only a number: m = 0.5
m = { value = 0.5, unit = "kg", range = [0.1, 2], text = "mass" }
l = { value = 30, unit = "cm", text = "length" }
g = { value = 9.81, unit = "m/s^2" }
d = { value = 0.02, unit = "N*m*s/rad", text = "friction" }

[definitions]                 # abbreviations for the formulas below, in any order; may be left out
J = "m*l**2"

[states]                      # what changes in time, in order; each with the formula of its derivative
theta = { unit = "rad", equation = "omega", text = "angle, from hanging" }
omega = { unit = "rad/s", equation = "(u - m*g*l*sin(theta) - d*omega)/J" }

[inputs]                      # what acts on it
u = { unit = "N*m", text = "torque of the motor" }

[outputs]                     # what is measured and to be controlled
y = { unit = "rad", equation = "theta" }

[operating_point]             # where it is to be held; what is left out is solved for
theta = 0

# Without units anywhere nothing is checked: theta = "omega" is enough for a state then.
# Functions: sin cos tan exp log sqrt abs min max tanh atan2 ..., powers with ** or ^.
"""


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The plant file to write, 'arm.toml'.")],
) -> None:
    """Write a commented plant file that works, to be changed into one's own.

    Examples:
        ulna new arm.toml
        ulna models --export cart_pole.toml cart_pole
    """
    if file.suffix != ".toml":
        raise PlantError(f"the file '{file}'", "its name does not end in .toml.", f"Try: ulna new {file.stem}.toml")
    write_text(file, _PLANT.replace("NAME", file.stem))
    typer.echo(f"{file} is written: a pendulum, with a line on everything that may be changed.")
    typer.echo(f"Next: ulna analyse {file}")
