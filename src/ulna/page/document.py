"""The text of a page: one file that asks nothing of any network and runs no text that a user gave."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any, Final

from markupsafe import Markup

from ulna.page.embedding import json_text
from ulna.page.script import runtime_script
from ulna.plot.style import PALETTE

_VIEW = (
    "words",
    "record",
    "curves",
    "shapes",
    "pictures",
    "stage",
    "plane",
    "fields",
    "figures",
    "share",
    "controls",
    "main",
    "open",
)
"""Files of the view, in order."""
_DARK: Final = ("#6CA8F0", "#F2914A", "#4DBB8A", "#D685BD", "#D9A92B", "#9AA6F2", "#ABABAB")
"""The palette on a dark ground, lighter and in the same order."""


def page_text(
    payload: Mapping[str, Any], programs: Sequence[str], *, notes: Sequence[str], hint: str, legend: str
) -> str:
    """The page as HTML.

    Its security policy allows the scripts and the style that it holds, by their hashes, and nothing else: no request,
    no other script, no text turned into code.

    Args:
        payload: what the view reads: titles, facts of the loops, picture, poles; JSON.
        programs: an expression of JavaScript for each loop.
        notes, hint, legend: sentences for the page.
    """
    # Loops that differ in their starts alone share a program.
    texts = list(dict.fromkeys(programs))
    loops, places = ",\n".join(texts), [texts.index(each) for each in programs]
    script = f"{{\nconst texts = [\n{loops}\n];\nglobalThis.ulnaPrograms = {places}.map((k) => texts[k]);\n}}\n"
    scripts = [_uplot(), runtime_script(), script, view_script()]
    style = style_text()
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_hash, scripts))}; style-src {_hash(style)}; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    # The texts below are the package's own or were made for a script element.
    return _template().render(
        title=payload["title"],
        text=payload["text"],
        policy=policy,
        style=Markup(style),  # noqa: S704
        data=Markup(json_text(payload)),  # noqa: S704
        scripts=[Markup(each) for each in scripts],  # noqa: S704
        notes=notes,
        hint=hint,
        legend=legend,
        held=", ".join(each["key"].upper() for each in payload["loops"][0]["facts"].get("held", ())),
    )


@cache
def view_script() -> str:
    """The view: what draws the loops and takes what hands do."""
    place = files("ulna.page") / "view"
    body = "\n".join((place / f"{name}.js").read_text(encoding="utf-8") for name in _VIEW)
    return f'(() => {{\n"use strict";\n{body}\n}})();\n'


@cache
def style_text() -> str:
    """The style sheet, with the colours of the figures."""
    own = (files("ulna.page") / "templates" / "page.css").read_text(encoding="utf-8")
    curves = (files("ulna.page") / "vendor" / "uplot" / "uPlot.min.css").read_text(encoding="utf-8")
    light, dark = (" ".join(f"--c{k}: {each};" for k, each in enumerate(row)) for row in (PALETTE, _DARK))
    colours = f":root {{ {light} }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}\n"
    return curves + "\n" + colours + own


@cache
def _uplot() -> str:
    return (files("ulna.page") / "vendor" / "uplot" / "uPlot.iife.min.js").read_text(encoding="utf-8")


@cache
def _template() -> Any:  # a jinja2.Template
    from jinja2 import Environment, StrictUndefined  # only where a page is written

    text = (files("ulna.page") / "templates" / "page.html").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(text)


def _hash(text: str) -> str:
    """How a security policy names an inline script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
