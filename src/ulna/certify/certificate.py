"""`Certificate`: a claim with all that a second program needs to check it, and its file."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ulna.base import text_of_file, whole_file
from ulna.certify.errors import CertifyError

FORMAT = 3
"""Of the file."""
LARGEST_FILE = 200_000_000
"""Bytes: a certificate of a million boxes has some ten million."""
THEOREM = "quadratic Lyapunov function, mean-value form"
CASCADE = "cascade of a linear part and its decaying errors, growth at most linear"


OVER = "characteristic polynomials over parameters, Kharitonov's test"


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A part of the box of parameters: for each of their values an equilibrium lies within the radii of the center."""

    center: tuple[str, ...]
    radii: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certificate:
    """Every run of x' = f(x, s), s = k(x) within limits, that starts where V ≤ level converges to the equilibrium.

    By the theorem of cascades, without limits: every run does, and the equilibrium is stable.
    Over parameters: at each of their values there is an exponentially stable equilibrium where no limit is met.
    V = (ζ − ζ*)ᵀ P (ζ − ζ*) in coordinates ζ = T(x), where the loop is ζ' = g + β (s − k). All numbers are rational and
    written as text, so that nothing is lost in a file.

    Attributes:
        name: of the loop. design: hash of what it was made from. theorem: its name.
        states: names of x. wires: name and formula of what runs between the loop's parts, in states and earlier wires.
        rates: in states and wires. limited: the wires that are limited; wherever such a name is used it is the limited
            value. lower, upper: their limits.
        coordinates: names of ζ. forward: T, in x. inverse: T⁻¹, in ζ.
        closed: g. gains: rows of β. moved_commands: k in ζ.
        outer: how many coordinates come before those of errors e' = A e. still_closed, still_gains, still_commands: the
            loop of the outer ones with the errors at 0; empty where there are none.
        center, radii: ζ* lies within these of the center, and is the only equilibrium there.
        P: rows. level: of V. tree: the boxes, halved where `/k` stands, along coordinate k. A cascade has none.
        box: a box about x* by state, contained in the level set; empty where none was asked for.
        parameters: name, lowest and highest value of each. splits: the tree of their boxes. pieces: of its leaves.
        decay: of a cascade the rates (λ, μ) at which √V falls, in the states without errors and in the errors.
    """

    name: str
    design: str
    theorem: str
    states: tuple[str, ...]
    wires: tuple[tuple[str, ...], ...]
    rates: tuple[str, ...]
    limited: tuple[str, ...]
    lower: tuple[str, ...]
    upper: tuple[str, ...]
    coordinates: tuple[str, ...]
    forward: tuple[str, ...]
    inverse: tuple[str, ...]
    closed: tuple[str, ...]
    gains: tuple[tuple[str, ...], ...]
    moved_commands: tuple[str, ...]
    outer: int
    still_closed: tuple[str, ...]
    still_gains: tuple[tuple[str, ...], ...]
    still_commands: tuple[str, ...]
    center: tuple[str, ...]
    radii: tuple[str, ...]
    P: tuple[tuple[str, ...], ...]
    level: str
    tree: str
    box: Mapping[str, str]
    decay: tuple[str, ...]
    parameters: tuple[tuple[str, ...], ...] = ()
    splits: str = ""
    pieces: tuple[Piece, ...] = ()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file.

        Raises:
            CertifyError: a place that cannot be written.
        """
        place = Path(path)
        data = {"format": FORMAT, **asdict(self)}
        try:
            with whole_file(place) as file:
                file.write((json.dumps(data, indent=1) + "\n").encode())
        except OSError as error:
            raise CertifyError(f"the file '{place}'", f"it cannot be written ({error.strerror or error}).") from None

    def __repr__(self) -> str:
        count = (self.tree or self.splits).count(".")
        boxes = f", {count} boxes" if count else ""
        return f"Certificate of '{self.name}': {self.theorem}{boxes}"


def read_certificate(path: str | os.PathLike[str]) -> Certificate:
    """The certificate in a file.

    Raises:
        CertifyError: a file that cannot be read or is no certificate of this version.
    """
    place = Path(path)
    try:
        text = text_of_file(place, most=LARGEST_FILE)
    except ValueError as error:
        raise CertifyError(f"the certificate '{place}'", f"{error}.", "Check the path.") from None
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        raise CertifyError(f"the certificate '{place}'", "it is not JSON: damaged or cut off.") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise CertifyError(f"the certificate '{place}'", f"it is not of format {FORMAT}.", "Prove the claim anew.")
    try:
        return _of(data)
    except (KeyError, TypeError, ValueError, AttributeError):
        raise CertifyError(f"the certificate '{place}'", "parts of it are missing or of another kind.") from None


_ROWS = ("states", "rates", "limited", "lower", "upper", "coordinates", "forward", "inverse", "closed")
_ROWS += ("moved_commands", "still_closed", "still_commands", "center", "radii", "decay")
_WORDS = ("name", "design", "theorem", "level", "tree", "splits")
_TABLES = ("wires", "gains", "still_gains", "P", "parameters")


def _of(data: Mapping[str, Any]) -> Certificate:
    given: dict[str, Any] = {name: tuple(_text(each) for each in data[name]) for name in _ROWS}
    given |= {name: _text(data[name]) for name in _WORDS}
    given |= {name: tuple(tuple(_text(each) for each in row) for row in data[name]) for name in _TABLES}
    given["box"] = {_text(name): _text(value) for name, value in data["box"].items()}
    outer = data["outer"]
    if type(outer) is not int:
        raise TypeError
    given["pieces"] = tuple(
        Piece(**{name: tuple(_text(each) for each in piece[name]) for name in ("center", "radii")})
        for piece in data["pieces"]
    )
    return Certificate(outer=outer, **given)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value
