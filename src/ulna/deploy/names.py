"""Names of signals as names in C."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

from ulna.deploy.errors import DeployError
from ulna.program import is_plain_name

LONGEST = 60
"""Letters of a name in C."""

_GREEK = {"GREEK SMALL LETTER ": "", "GREEK CAPITAL LETTER ": "capital_"}


def c_name(name: str) -> str:
    """The name as an identifier of C: Greek letters by their names, other signs as underscores.

    Words that C, C++, Python or JavaScript keep for themselves get an underscore at the end.
    """
    text = "".join(map(_spelt, unicodedata.normalize("NFKC", name)))
    text = re.sub(r"__+", "_", re.sub(r"[^A-Za-z0-9_]", "_", text)).strip("_")[:LONGEST]
    text = text if text[:1].isalpha() else f"signal_{text}".rstrip("_")
    return text if is_plain_name(text) else f"{text}_"


def c_names(names: Iterable[str], *, what: str) -> tuple[str, ...]:
    """The names in C of all signals of one structure.

    Raises:
        DeployError: two that become the same.
    """
    found: dict[str, str] = {}
    for name in names:
        short = c_name(name)
        if short in found:
            raise DeployError(
                f"the {what} '{name}' in C",
                f"its name becomes '{short}', as that of '{found[short]}' does.",
                "Rename one of them.",
            )
        found[short] = name
    return tuple(found)


def _spelt(letter: str) -> str:
    title = unicodedata.name(letter, "")
    for head, before in _GREEK.items():
        if title.startswith(head):
            return before + title.removeprefix(head).split()[0].lower() + "_"
    return letter
