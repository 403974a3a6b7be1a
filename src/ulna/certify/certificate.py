"""`Certificate`: a claim with all that a second program needs to check it, and its file."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from ulna.base import text_of_file, whole_file
from ulna.certify.errors import CertifyError, ChangedError

FORMAT = 4
"""Of the file."""
LARGEST_FILE = 200_000_000
"""Bytes: a certificate of a million boxes has some ten million."""
THEOREM = "quadratic Lyapunov function, mean-value form"
CASCADE = "cascade of a linear part and its decaying errors, growth at most linear"
OVER = "characteristic polynomials over parameters, Kharitonov's test"
SAMPLED = "linearised period map with an enclosed rest, sums of its powers"


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
        write_data(asdict(self), path)

    def __repr__(self) -> str:
        count = (self.tree or self.splits).count(".")
        boxes = f", {count} boxes" if count else ""
        return f"Certificate of '{self.name}': {self.theorem}{boxes}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledCertificate:
    """Runs of a loop on its processor that start in a box stay in another one and end in a smaller one.

    The state is that of the plant, then the memory of the processor, at the samples. One period: the readings are
    measured, off by at most half a step each; the program runs; the plant moves by its rates, each stretch with its
    inputs held. In coordinates divided by `scale`, about `center`, that is d⁺ = A d + N δ and a rest. All numbers are
    rational.

    Attributes:
        name: of the loop. design: hash of what it was made from. theorem: its name.
        states: of the plant. rates: in states and inputs. inputs: names in the rates.
        readings: in states. half_steps: largest error of each. lower, upper: of what a sensor shows, "" for no end.
        memory: slots of the processor. program: names and formulas of what it computes, in order, from memory and
            measured values `y<k>`; `<slot>_new` is what a slot is afterwards. first: the same at the first sample.
        stretches: length in s, then for each input the slot that it holds.
        center, scale: by state. matrix, injection: A and N in units of 2⁻⁶⁰. powers: of A that are added up.
        start: box about the center. boxes: the first holds the whole run, each next one its end.
        shown: names of places of the state that have one: states of plant and controller.
    """

    name: str
    design: str
    theorem: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    rates: tuple[str, ...]
    readings: tuple[str, ...]
    half_steps: tuple[str, ...]
    lower: tuple[str, ...]
    upper: tuple[str, ...]
    memory: tuple[str, ...]
    program: tuple[tuple[str, ...], ...]
    first: tuple[tuple[str, ...], ...]
    stretches: tuple[tuple[str, ...], ...]
    center: tuple[str, ...]
    scale: tuple[str, ...]
    matrix: tuple[tuple[str, ...], ...]
    injection: tuple[tuple[str, ...], ...]
    powers: str
    start: tuple[str, ...]
    boxes: tuple[tuple[str, ...], ...]
    shown: Mapping[str, str]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file.

        Raises:
            CertifyError: a place that cannot be written.
        """
        write_data(asdict(self), path)

    def __repr__(self) -> str:
        return f"Certificate of '{self.name}': {self.theorem}"


def write_data(data: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a certificate's file with its digest.

    Raises:
        CertifyError: a place that cannot be written.
    """
    place = Path(path)
    whole = {"format": FORMAT, "digest": _digest(data), **data}
    try:
        with whole_file(place) as file:
            file.write((json.dumps(whole, indent=1) + "\n").encode())
    except OSError as error:
        raise CertifyError(f"the file '{place}'", f"it cannot be written ({error.strerror or error}).") from None


def _digest(data: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def read_certificate(path: str | os.PathLike[str]) -> Certificate | SampledCertificate:
    """The certificate in a file.

    Raises:
        CertifyError: a file that cannot be read, or is not a certificate of this version.
        ChangedError: a file that was changed since it was written.
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
        raise CertifyError(f"the certificate '{place}'", f"it is not of format {FORMAT}.", "Prove the claim again.")
    data.pop("format")
    if data.pop("digest", None) != _digest(data):
        found = "it was changed since it was written: its digest is another one."
        raise ChangedError(f"the certificate '{place}'", found, "Prove the claim again.")
    try:
        return _sampled_of(data) if data["theorem"] == SAMPLED else _of(data)
    except (KeyError, TypeError, ValueError, AttributeError):
        raise CertifyError(f"the certificate '{place}'", "parts of it are missing or have the wrong type.") from None


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


_SAMPLED_WORDS = ("name", "design", "theorem", "powers")
_SAMPLED_TABLES = ("program", "first", "stretches", "matrix", "injection", "boxes")


def _sampled_of(data: Mapping[str, Any]) -> SampledCertificate:
    given: dict[str, Any] = {}
    for each in fields(SampledCertificate):
        value = data[each.name]
        if each.name in _SAMPLED_WORDS:
            given[each.name] = _text(value)
        elif each.name in _SAMPLED_TABLES:
            given[each.name] = tuple(tuple(_text(entry) for entry in row) for row in value)
        elif each.name == "shown":
            given[each.name] = {_text(name): _text(place) for name, place in value.items()}
        else:
            given[each.name] = tuple(_text(entry) for entry in value)
    return SampledCertificate(**given)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value
