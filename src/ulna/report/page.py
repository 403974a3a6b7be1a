"""A document as one HTML page that needs nothing else: no network, no second file; a script only to stop what moves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any, Final

from markupsafe import Markup, escape

from ulna.base import mathml
from ulna.report.document import Block, Cell, Document, Picture, Tone

_SIGNS: Final = {Tone.GOOD: "✓", Tone.MILD: "≈", Tone.BAD: "✗", Tone.PLAIN: ""}
# The one script of a report, and only of one with a picture that moves: the button that stops it.
_HALT: Final = """for (const figure of document.querySelectorAll("figure.moving")) {
  const [svg, button] = [figure.querySelector("svg"), figure.querySelector("button")];
  const halt = (still) => {
    if (still) svg.pauseAnimations();
    else svg.unpauseAnimations();
    button.textContent = still ? "Play" : "Pause";
  };
  button.hidden = false;
  button.addEventListener("click", () => halt(!svg.animationsPaused()));
  halt(matchMedia("(prefers-reduced-motion: reduce)").matches);
}"""
_INLINE: Final = re.compile(r"(?<!\\)\$([^$]+)\$")


def render_page(document: Document) -> str:
    """Return the document as the text of one self-contained HTML page.

    Texts are escaped; formulas become MathML, pictures inline SVG.

    Raises:
        FormulaError: a formula that cannot be set.
    """
    moving = any(_moves(section.blocks) for section in document.sections)
    script = Markup(_HALT) if moving else ""  # noqa: S704 (our own)
    return _environment().get_template("page.html").render(document=document, script=script)


@cache
def _environment() -> Any:  # a jinja2.Environment
    from jinja2 import DictLoader, Environment, StrictUndefined  # only where a page is written

    place = files("ulna.report") / "templates"
    texts = {name: (place / name).read_text(encoding="utf-8") for name in ("page.html", "blocks.html", "style.css")}
    environment = Environment(
        loader=DictLoader(texts), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["with_formulas"] = _with_formulas
    environment.filters["display_formula"] = lambda latex: Markup(mathml(latex, display=True))  # noqa: S704 (escapes by itself)
    environment.filters["kind"] = _kind
    environment.filters["sign"] = lambda tone: _SIGNS[tone]
    environment.filters["drawing"] = _drawing
    return environment


def _with_formulas(text: str) -> Markup:
    r"""The text, escaped, with what stands between dollar signs set as formulas; `\$` is a dollar sign."""
    parts = _INLINE.split(text)
    pieces = (Markup(mathml(p)) if i % 2 else escape(p.replace(r"\$", "$")) for i, p in enumerate(parts))  # noqa: S704 (escapes by itself)
    return Markup("").join(pieces)


def _moves(blocks: Sequence[Block]) -> bool:
    return any(block.moving if isinstance(block, Picture) else _moves(getattr(block, "blocks", ())) for block in blocks)


def _kind(value: Block | Cell) -> str:
    """The name under which the templates show the value."""
    return "words" if isinstance(value, str) else type(value).__name__.lower()


def _drawing(svg: str) -> Markup:
    """The SVG text without a fixed size, so that it takes the width of its place."""
    head, end, rest = svg.partition(">")
    return Markup(re.sub(r'\s(?:width|height)="[^"]*"', "", head) + end + rest)  # noqa: S704 (our own drawing)
