"""The table of options: written once, given to the commands that name its groups."""

from __future__ import annotations

import inspect
from dataclasses import dataclass, field, fields
from typing import Annotated

import pytest
import typer
from terminal import python_words, ulna
from typer.testing import CliRunner

from ulna.cli import analyse, design, simulate, sweep
from ulna.cli.option_groups import with_groups
from ulna.cli.options import DesignOptions, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.wording import in_terminal_words

COMMANDS = {
    analyse.analyse: (PlantOptions,),
    design.design: (PlantOptions, DesignOptions),
    simulate.simulate: (PlantOptions, RunOptions, DesignOptions, HardwareOptions),
    sweep.sweep: (PlantOptions, RunOptions, DesignOptions, HardwareOptions),
}


@dataclass(frozen=True, kw_only=True)
class Weather:
    """A group."""

    wind: Annotated[float, typer.Option("--wind", help="Speed, m/s.")] = 1.5
    clouds: Annotated[list[str], typer.Option("--cloud")] = field(default_factory=list)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_has_every_option_of_its_groups(command):
    names = list(inspect.signature(command).parameters)
    assert {each.name for group in COMMANDS[command] for each in fields(group)} <= set(names)
    assert len(set(names)) == len(names)


def test_a_group_arrives_as_a_value_with_its_defaults():
    seen = []

    @with_groups
    def walk(where: str, weather: Weather) -> None:
        """Walk."""
        seen.append((where, weather))

    app = typer.Typer()
    app.command()(walk)
    assert CliRunner().invoke(app, ["hill"]).exit_code == 0
    assert CliRunner().invoke(app, ["sea", "--wind", "9", "--cloud", "a", "--cloud", "b"]).exit_code == 0
    assert seen == [("hill", Weather()), ("sea", Weather(wind=9.0, clouds=["a", "b"]))]
    assert "Speed, m/s." in CliRunner().invoke(app, ["--help"]).output


def test_an_option_that_stands_twice_is_refused():
    with pytest.raises(TypeError, match="the option wind is given twice"):

        @with_groups
        def walk(wind: float, weather: Weather) -> None: ...


@pytest.mark.parametrize("name", ["analyse", "design", "simulate", "sweep"])
def test_help_says_what_every_option_is(name):
    done = ulna(name, "--help")
    assert done.exit_code == 0
    assert python_words(done.output) == []


def test_python_in_a_message_is_noticed():
    for message in (
        "Hardware(period=-1): no.",
        "Give parameters={'m': 1}.",
        "raise Taylor(maximum_steps=9)",
        "ulna.TIME",
    ):
        assert python_words(message)
    assert python_words("--vary 'm2=uniform(0,5)', --set \"m2=4\": T(x), [g, ad_f g], atan2(y, x), sin(t)") == []


def test_forms_are_named_by_their_options():
    told = in_terminal_words("Try `dynamic_extension`. Dynamic extension cannot help; try `input_output_form`.")
    assert told == "Add --extend. Dynamic extension cannot help; try --input-output."
