"""Every command that README and documentation show can be typed: its options exist and take such values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from terminal import parse

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def commands(text: str) -> Iterator[str]:
    """The commands of a page, those over several lines in one."""
    joined = re.sub(r"\\\n\s*", " ", text)
    for line in joined.splitlines():
        if re.match(r"\$ ulna [a-z]", line) and not re.search(r"\.\.\.|…", line):
            yield line.removeprefix("$ ulna ")


@pytest.mark.parametrize("command", [each for page in PAGES for each in commands(page.read_text(encoding="utf-8"))])
def test_a_documented_command_can_be_typed(command):
    parse(command)


@pytest.mark.parametrize("command", ["simulate one_link_arm --time 5", "simulat arm", "simulate arm --horizon long"])
def test_a_wrong_command_is_noticed(command):
    with pytest.raises(Exception, match="(?i)no such|valid number"):
        parse(command)
