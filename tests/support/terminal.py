"""The program as typed, and what all its refusals have in common."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

from typer.main import get_command
from typer.testing import CliRunner

from ulna.cli.main import app

_PYTHON = re.compile(
    r"\b[A-Za-z_]+\([^()]*="  # a call with a keyword
    r"|\b(?:[A-Z][a-z]+){1,4}\("  # a constructor
    r"|\b[a-z_]+=(?:\{|True|False|None)"  # an argument
    r"|\bulna\.[A-Za-z]"
)


def ulna(*arguments: str) -> Any:
    """The result of the command in this process, on a wide terminal."""
    return CliRunner().invoke(app, list(arguments), env={"COLUMNS": "160"})


def entry_point(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The result of the installed program in a process of its own."""
    program = Path(sysconfig.get_path("scripts")) / "ulna"
    return subprocess.run([str(program), *arguments], capture_output=True, text=True, check=False)


def parse(command: str) -> None:
    """Read the options of a command without running it."""
    group: Any = get_command(app)
    rest = shlex.split(command, comments=True)
    context = group.make_context("ulna", rest)
    while hasattr(group, "resolve_command"):
        _, group, rest = group.resolve_command(context, rest)
        context = group.make_context("", rest, parent=context)


def answered(*arguments: str) -> Any:
    """The JSON that a command prints that does what it is told."""
    done = ulna(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def refused(*arguments: str) -> str:
    """What a command says that the user got wrong: one message, exit status 2, in the words of the terminal."""
    done = ulna(*arguments)
    assert done.exit_code == 2, done.output
    assert done.stderr.startswith("error: "), done.stderr
    assert "Traceback" not in done.output
    message = " ".join(done.stderr.split())
    assert python_words(message) == [], message
    return message


def python_words(message: str) -> list[str]:
    """What of a message is Python: calls, constructors, arguments, modules."""
    return _PYTHON.findall(message)


MASS = """
name = "mass"
[parameters]
m = { value = 1, range = [0.5, 3] }
[states]
x = "v"
v = "u/m"
[inputs]
u = {}
[outputs]
x = "x"
"""
"""A plant file."""


def written(text: str, path: Path) -> str:
    """The path of a file with this text."""
    path.write_text(text)
    return str(path)
