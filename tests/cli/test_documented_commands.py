"""Every command that README and documentation show can be typed: its options exist and take such values."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from ulna.cli.main import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def commands(text: str) -> Iterator[str]:
    """The commands of a page, those over several lines in one."""
    joined = re.sub(r"\\\n\s*", " ", text)
    for line in joined.splitlines():
        if re.match(r"\$ ulna [a-z]", line) and not re.search(r"\.\.\.|…", line):
            yield line.removeprefix("$ ulna ")


def parse(command: str) -> None:
    """Read the options of a command without running it."""
    group: Any = get_command(app)
    rest = shlex.split(command, comments=True)
    context = group.make_context("ulna", rest)
    while hasattr(group, "resolve_command"):
        _, group, rest = group.resolve_command(context, rest)
        context = group.make_context("", rest, parent=context)


@pytest.mark.parametrize("command", [each for page in PAGES for each in commands(page.read_text(encoding="utf-8"))])
def test_a_documented_command_can_be_typed(command):
    parse(command)


@pytest.mark.parametrize("command", ["simulate one_link_arm --time 5", "simulat arm", "simulate arm --horizon long"])
def test_a_wrong_command_is_noticed(command):
    with pytest.raises(Exception, match="(?i)no such|valid number"):
        parse(command)
