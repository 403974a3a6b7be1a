"""Answers to yes/no mathematics that say how sure they are and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Any, NoReturn

from ulna.base.errors import UlnaError
from ulna.base.tables import html_table


class Status(StrEnum):
    """How a claim stands.

    Examples:
        >>> verdict = ulna.Verdict.proved("the plant is involutive")
        >>> verdict.status is ulna.Status.PROVED
        True
    """

    PROVED = "proved"
    """True, by exact computation."""
    REFUTED = "refuted"
    """False; the evidence holds a counterexample or the failing object."""
    SUPPORTED = "supported"
    """True at every sampled point; true with probability one for analytic expressions, but no proof."""
    UNDECIDED = "undecided"
    """Nothing can be said: the evidence tells what was tried."""


_PARTS = {Status.REFUTED: "fails", Status.UNDECIDED: "open"}
"""Key of the claim that an answer rests on, "because" where that claim holds: under a "no" it is one that fails."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """A claim, how it stands, and the evidence.

    It is no bool: `if verdict` raises. Ask `holds`, `fails` or `status`.
    Evidence is a mapping of short names to plain values or expressions (the bracket that leaves the span,
    the point, the minor, the number of sampled points, the seed, the tolerance). The claim that the answer rests on
    stands under `because` where it holds, under `fails` where it is refuted, under `open` where it is undecided, so
    that nothing reads as its opposite; a reason in words stands under `reason`.

    Examples:
        >>> ulna.Verdict.refuted("x squared is linear", point=2).fails
        True
    """

    claim: str
    status: Status
    evidence: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        evidence = dict(self.evidence)
        if self.status in _PARTS and "because" in evidence:
            # In its place, and in place of what a part of the claim has under that name.
            name = _PARTS[self.status]
            evidence.pop(name, None)
            evidence = {name if key == "because" else key: value for key, value in evidence.items()}
        object.__setattr__(self, "evidence", MappingProxyType(evidence))

    @classmethod
    def proved(cls, claim: str, /, **evidence: Any) -> Verdict:
        """A claim that exact computation shows to be true."""
        return cls(claim=claim, status=Status.PROVED, evidence=evidence)

    @classmethod
    def refuted(cls, claim: str, /, **evidence: Any) -> Verdict:
        """A claim that is false; give the counterexample as evidence."""
        return cls(claim=claim, status=Status.REFUTED, evidence=evidence)

    @classmethod
    def supported(cls, claim: str, /, **evidence: Any) -> Verdict:
        """A claim that holds at every sampled point."""
        return cls(claim=claim, status=Status.SUPPORTED, evidence=evidence)

    @classmethod
    def undecided(cls, claim: str, /, **evidence: Any) -> Verdict:
        """A claim nothing can be said of; give what was tried as evidence."""
        return cls(claim=claim, status=Status.UNDECIDED, evidence=evidence)

    def restated(self, claim: str, /, **evidence: Any) -> Verdict:
        """The same answer to another claim, which rests on this one: its evidence, and what is given besides."""
        why = _PARTS.get(self.status, "because")
        return Verdict(claim=claim, status=self.status, evidence={why: self.claim, **self.evidence, **evidence})

    @property
    def rests_on(self) -> Any:
        """The part of the claim that the answer rests on: holding, failing or open as the claim itself; else None."""
        return self.evidence.get(_PARTS.get(self.status, "because"))

    @property
    def holds(self) -> bool:
        """True if proved or supported."""
        return self.status in (Status.PROVED, Status.SUPPORTED)

    @property
    def fails(self) -> bool:
        """True if refuted."""
        return self.status is Status.REFUTED

    def __bool__(self) -> NoReturn:
        raise UlnaError(
            f"the truth of '{self.claim}'",
            f"it is {self.status}: a verdict is more than true or false.",
            "Ask .holds (proved, or supported at sampled points), .fails (refuted) or .status.",
        )

    def __str__(self) -> str:
        return f"{self.status}: {self.claim}"

    def _repr_html_(self) -> str:
        rows = [(name.replace("_", " "), value) for name, value in self.evidence.items()]
        return html_table(rows, title=str(self))


_TELLING = ("fails", "open", "reason", "ran_out", "contradiction", "bracket", "observable_while", "tried", "side")
"""What of the evidence is always shown; the rest on demand."""
_SAMPLING = frozenset({"points", "seed", "digits", "tolerance", "generically"})
_OF_A_PROOF = frozenset(
    {"point", "rank", "rows", "method", "because", "per_output", "manifold", "inputs", "regular", "psi"}
)
_LABELS = {
    "fails": "what fails",
    "open": "what is open",
    "ran_out": "the time ran out",
    "side": "on the side of the operating point, where",
}


def evidence_label(key: str) -> str:
    """What stands before a piece of evidence."""
    return _LABELS.get(key, key.replace("_", " "))


def told_evidence(verdict: Verdict, *, whole: bool = False) -> dict[str, Any]:
    """The evidence that people read, by its label: what was asked, then what was found.

    A counterexample is told whole, of a proof only what bounds it; `whole`: else the telling part.
    """
    dropped = _SAMPLING | (_OF_A_PROOF if verdict.holds else frozenset())
    told = {key: value for key, value in verdict.evidence.items() if key not in dropped}
    if getattr(told.get("singular"), "is_number", False):
        del told["singular"]  # singular nowhere
    return {
        evidence_label(key): value
        for key, value in sorted(told.items(), key=lambda item: item[0] not in ("fails", "open"))
        if value not in (None, (), [], {}) and (whole or key in _TELLING)
    }


def all_of(claim: str, verdicts: tuple[Verdict, ...] | list[Verdict], /, **evidence: Any) -> Verdict:
    """The conjunction: refuted by the first refuted part, else as sure as its least sure part."""
    for status in (Status.REFUTED, Status.UNDECIDED, Status.SUPPORTED):
        worst = next((v for v in verdicts if v.status is status), None)
        if worst is not None:
            return Verdict(claim=claim, status=status, evidence={**worst.evidence, "because": worst.claim, **evidence})
    return Verdict(claim=claim, status=Status.PROVED, evidence=evidence)
