"""A document as one HTML page that needs nothing else: no network, no second file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from html import unescape
from importlib.resources import files
from typing import Any, Final

from markupsafe import Markup, escape

from ulna.base import mathml
from ulna.report.document import Block, Cell, Document, Frame, Tone

_SIGNS: Final = {Tone.GOOD: "✓", Tone.MILD: "≈", Tone.BAD: "✗", Tone.PLAIN: ""}
_SCRIPTS: Final = re.compile(r"script-src ([^;]*);")
_INLINE: Final = re.compile(r"(?<!\\)\$([^$]+)\$")


def render_page(document: Document) -> str:
    """Return the document as the text of one self-contained HTML page.

    Texts are escaped; formulas become MathML, pictures inline SVG. The page's security policy allows no script but
    those of pages inside it, by their hashes, and no request.

    Raises:
        FormulaError: a formula that cannot be set.
    """
    frames = [frame for section in document.sections for frame in _frames(section.blocks)]
    return _environment().get_template("page.html").render(document=document, policy=_policy(frames))


def _frames(blocks: Sequence[Block]) -> Iterator[Frame]:
    for block in blocks:
        if isinstance(block, Frame):
            yield block
        else:
            yield from _frames(getattr(block, "blocks", ()))


def _policy(frames: Sequence[Frame]) -> str:
    """A page inside obeys this policy too, beside its own; figures and formulas bring styles of their own."""
    allowed = dict.fromkeys(each for f in frames for each in _SCRIPTS.findall(unescape(f.html.partition("<title>")[0])))
    hashes = " ".join(dict.fromkeys(" ".join(allowed).split())) or "'none'"
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


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
    environment.filters["quoted"] = _quoted
    return environment


def _with_formulas(text: str) -> Markup:
    r"""The text, escaped, with what stands between dollar signs set as formulas; `\$` is a dollar sign."""
    parts = _INLINE.split(text)
    pieces = (Markup(mathml(p)) if i % 2 else escape(p.replace(r"\$", "$")) for i, p in enumerate(parts))  # noqa: S704 (escapes by itself)
    return Markup("").join(pieces)


def _kind(value: Block | Cell) -> str:
    """The name under which the templates show the value."""
    return "words" if isinstance(value, str) else type(value).__name__.lower()


def _drawing(svg: str) -> Markup:
    """The SVG text without a fixed size, so that it takes the width of its place."""
    head, end, rest = svg.partition(">")
    return Markup(re.sub(r'\s(?:width|height)="[^"]*"', "", head) + end + rest)  # noqa: S704 (our own drawing)


def _quoted(html: str) -> Markup:
    """A page as an attribute between single quotes: it holds many more double ones, which stay as they are."""
    return Markup(html.replace("&", "&amp;").replace("'", "&#39;"))  # noqa: S704 (nothing ends the attribute)
