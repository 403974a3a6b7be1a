"""Text for a terminal of any width: formulas broken at their signs and aligned, sentences at spaces."""

from __future__ import annotations

import re
import shutil
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import typer

_LEAST = 40
"""Columns below which lines are rather too long than all broken."""

_LONGEST = 4_000
"""Characters of a formula that are shown."""

_BREAK = re.compile(r" (?=[+-] )|(?<=[,;]) | (?=[<>=]+ )|(?<=[^*])(?=[*/][^*])")
"""Where a formula may go on in the next line: before a sign, after a comma."""


def columns() -> int:
    """How wide the terminal is; 80 where there is none."""
    return max(shutil.get_terminal_size().columns, _LEAST)


def say(text: str, *, indent: int = 0, hanging: int = 0) -> None:
    """Write a sentence, broken at spaces only."""
    for line in text.splitlines():
        first, rest = " " * indent, " " * (indent + hanging)
        for part in textwrap.wrap(
            line,
            columns(),
            initial_indent=first,
            subsequent_indent=rest,
            break_long_words=False,
            break_on_hyphens=False,
        ):
            typer.echo(part)


def write_rows(rows: Mapping[str, Any], *, exact: bool = False, indent: int = 2, sign: str = "=") -> None:
    """Write `name = formula` a line each, the signs below each other, long formulas over several aligned lines."""
    widest = min(max(map(len, rows), default=0), columns() // 3)
    for name, value in rows.items():
        head = f"{'':{indent}}{name:<{widest}} {sign} " if sign else f"{'':{indent}}{name:<{widest}}  "
        for part in broken(head, shown(value, exact=exact)):
            typer.echo(part)


def write_texts(rows: Mapping[str, str], *, indent: int = 2) -> None:
    """Write a name and a sentence a line, the sentences below each other."""
    widest = max(map(len, rows), default=0)
    for name, text in rows.items():
        say(f"{name:<{widest}}  {text}", indent=indent, hanging=widest + 2)


def shown(value: Any, *, exact: bool = False, limit: int = _LONGEST) -> str:
    """A value as text: vectors and one-row matrices without brackets, mappings as equations, numbers as decimals.

    Args:
        value: numbers, expressions, matrices, lists and mappings of them.
        exact: fractions in place of decimals of six digits.
        limit: characters after which the rest is left out.
    """
    from ulna.report.words import value_text

    text = value_text(value, exact=exact)
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text)} characters; --json shows all)"


def broken(head: str, text: str) -> Iterator[str]:
    """The lines of `head` and a formula behind it: the rest stands below where the formula or its bracket begins."""
    start, room = len(head), columns()
    if start > room // 2:
        yield head.rstrip()
        head = " " * (start := 6)
    line, depths = head, [start]
    rest = text
    while len(line) + len(rest) > room and (cut := _cut(rest, room - len(line))):
        part, rest = rest[:cut].rstrip(), rest[cut:].lstrip()
        yield line + part
        depths = _columns_of_brackets(line, part, depths)
        line = " " * (depths[-1] if depths[-1] <= room // 2 else start + 2)
    yield line + rest


def _cut(text: str, room: int) -> int:
    """Where to break so that the first part fits: outside of as many brackets as possible, then as late as possible."""
    places = [(match.start(), _cost(text, match.start())) for match in _BREAK.finditer(text) if match.start()]
    fitting = [(place, cost) for place, cost in places if place <= room]
    if not fitting:
        return places[0][0] if places else 0
    # A break that leaves most of the line empty is worse than one inside a bracket.
    useful = [(cost, -place) for place, cost in fitting if place >= room // 2] or [(c, -p) for p, c in fitting]
    return -min(useful)[1]


def _cost(text: str, place: int) -> int:
    """How much a break there hurts: by the brackets it is in, and more inside a product than before a sign."""
    before = text[:place]
    return 2 * (before.count("(") - before.count(")")) + (text[place] in "*/")


def _columns_of_brackets(line: str, part: str, depths: Sequence[int]) -> list[int]:
    """Columns behind the brackets that are open at the end of a line."""
    found = list(depths)
    for place, sign in enumerate(part):
        if sign == "(":
            found.append(len(line) + place + 1)
        elif sign == ")" and len(found) > 1:
            found.pop()
    return found


def numbered(notes: Iterable[tuple[int, str]]) -> None:
    """Write notes, each behind its number."""
    for number, text in notes:
        say(f"{number:>2} {text}", hanging=3)
