"""What a report is made of: plain values, nested; `page.py` turns them into HTML."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Tone(StrEnum):
    """How a badge is meant; said by its colour and by a sign, so that it can be read without colour."""

    GOOD = "good"
    MILD = "mild"
    BAD = "bad"
    PLAIN = "plain"


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A paragraph; formulas in it stand between dollar signs, as LaTeX."""

    text: str
    quiet: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """A formula on a line of its own.

    Attributes:
        latex: the formula, without dollar signs.
        caption: what it is, in a word or two; empty for none.
    """

    latex: str
    caption: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Badge:
    """A short judgement."""

    text: str
    tone: Tone = Tone.PLAIN


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A reference to a section of the same document, by its anchor."""

    text: str
    anchor: str


Cell = str | Badge | Link
"""What stands in a table; formulas in a text stand between dollar signs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows under a head.

    Attributes:
        head: one title for each column.
        rows: of as many cells as the head has titles.
        caption: stands above; empty for none.
        numeric: columns, counted from zero, whose entries are numbers and stand to the right.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    numeric: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.head):
                raise ValueError(f"a row of {len(row)} cells in a table of {len(self.head)} columns: {row}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure as SVG text, with its caption and a description for those who cannot see it."""

    svg: str
    caption: str
    description: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """A whole page inside this one, which runs apart from it: its scripts reach nothing outside.

    Attributes:
        html: the text of the page, with a security policy of its own.
        title: what it is, for those who cannot see it.
    """

    html: str
    title: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Fold:
    """Blocks that are shown when their title is opened."""

    title: str
    blocks: tuple[Block, ...]
    opened: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """One subject in a frame: a label, a title, judgements, then blocks."""

    anchor: str
    label: str
    title: str
    badges: tuple[Badge, ...]
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Blocks side by side where there is room, else below one another."""

    blocks: tuple[Block, ...]


Block = Text | Formula | Table | Picture | Frame | Fold | Card | Row
"""One piece of a section."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A titled part of the document; `anchor` names it in links."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """A report.

    Attributes:
        title: stands on top and in the browser's tab.
        lead: a sentence or two below the title.
        facts: short figures shown on top, as (number, what it counts, tone).
        sections: in order; they also make the list of contents.
    """

    title: str
    lead: str
    facts: tuple[tuple[str, str, Tone], ...]
    sections: tuple[Section, ...]
