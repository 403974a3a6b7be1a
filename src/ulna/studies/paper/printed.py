"""The data file `printed.toml` as values: what the paper prints, by key."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

Entry = str | list[str] | list[list[str]]
"""A printed formula, a column of them, or rows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Passage:
    """One printed statement.

    Attributes:
        key: its name.
        number: of the equation; 0 for a statement without number.
        after: the equation it is or follows; places it in the paper.
        section: of the paper.
        title, says: what it is and what it says.
        latex: the formula as printed; empty for words alone.
        printed: entries a program can read, by name.
    """

    key: str
    number: int
    after: int
    section: str
    title: str
    says: str
    latex: str
    printed: Mapping[str, Entry]

    @property
    def label(self) -> str:
        """How it is referred to: `(25)`, or `below (25)`."""
        return f"({self.number})" if self.number else f"below ({self.after})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A sentence of the paper that can be judged; `after` is the equation before it."""

    key: str
    after: int
    section: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedFigure:
    """A figure of the paper: its caption and what the text says that it shows."""

    number: int
    section: str
    caption: str
    shows: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Paper:
    """Everything the data file holds, in the order of the paper."""

    title: str
    citation: str
    passages: tuple[Passage, ...]
    claims: tuple[Claim, ...]
    figures: tuple[PrintedFigure, ...]

    def passage(self, key: str) -> Passage:
        """The passage of that key.

        Raises:
            KeyError: there is none.
        """
        return next(p for p in self.passages if p.key == key) if key in self.keys else _missing(key)

    def entry(self, key: str, name: str) -> Entry:
        """One printed entry of a passage."""
        return self.passage(key).printed[name]

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of all passages."""
        return tuple(passage.key for passage in self.passages)


@cache
def paper() -> Paper:
    """The paper as printed."""
    text = (files("ulna.studies.paper") / "printed.toml").read_text(encoding="utf-8")
    data = tomllib.loads(text)
    passages = [_passage(row) for row in [*data["equation"], *data["aside"]]]
    passages.sort(key=lambda passage: (passage.after, passage.number == 0))
    return Paper(
        title=data["source"]["title"],
        citation=data["source"]["citation"],
        passages=tuple(passages),
        claims=tuple(Claim(**row) for row in data["claim"]),
        figures=tuple(
            PrintedFigure(
                number=row["number"], section=row["section"], caption=row["caption"], shows=row.get("shows", "")
            )
            for row in data["figure"]
        ),
    )


def _passage(row: Mapping[str, Any]) -> Passage:
    number = row.get("number", 0)
    return Passage(
        key=row["key"],
        number=number,
        after=row.get("after", number),
        section=row["section"],
        title=row["title"],
        says=row["says"],
        latex=row["latex"],
        printed=MappingProxyType(row.get("printed", {})),
    )


def _missing(key: str) -> Passage:
    raise KeyError(f"no passage '{key}' in printed.toml")
