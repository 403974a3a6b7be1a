"""The reference of the Python names: one page for each package of the front, its text from the docstrings."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import ulna


def api_pages() -> Iterator[tuple[str, str]]:
    """An overview, and one page for each package whose names are public."""
    homes: dict[str, list[str]] = {}
    for name in ulna.__all__:
        if name != "__version__":
            homes.setdefault(ulna._HOME[name], []).append(name)
    rows = []
    for package, names in homes.items():
        word = package.rpartition(".")[2]
        summary = (import_module(package).__doc__ or "").strip().splitlines()[0]
        entries = [f"::: {_path(package, name)}" for name in names]
        yield f"reference/python/{word}.md", "\n\n".join([f"# {package}", summary, *entries]) + "\n"
        links = ", ".join(f"[`{name}`]({word}.md#{_path(package, name)})" for name in names)
        rows.append(f"| [`{package}`]({word}.md) | {links} |")
    table = ["| package | names |", "|---|---|", *rows]
    text = ["# Python", "", "Every name below is at the top, too: `ulna.simulate` is `ulna.sim.simulate`.", "", *table]
    yield "reference/python/index.md", "\n".join(text) + "\n"


def _path(package: str, name: str) -> str:
    """Where the name is defined: a function may have the name of the file that it is in."""
    value = getattr(ulna, name)
    return f"{value.__module__}.{name}" if getattr(value, "__name__", "") == name else f"{package}.{name}"
