"""Everything a plant's vector fields say, key by key: `analyse(system)` (keys and values: docs/analysis.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ulna.base import UlnaError
from ulna.design.findings import Finding, not_applicable
from ulna.design.large_questions import LARGE, large_findings
from ulna.design.questions import GROUPS
from ulna.symbolic.budget import attempt
from ulna.system.affine import control_affine
from ulna.system.operating_point import OperatingPoint, given_point, operating_point
from ulna.system.system import System

SECONDS = 8.0
"""Time that one group of answers may take; what is not found by then is undecided."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """The answers to the standard questions about a plant.

    Attributes:
        system: the plant.
        point: the operating point at which pointwise questions were asked.
        findings: by key, each a value with its verdict and evidence.
    """

    system: System
    point: OperatingPoint
    findings: Mapping[str, Finding]

    def __getitem__(self, key: str) -> Finding:
        return self.findings[key]


def analyse(system: System, *, seconds: float = SECONDS) -> Analysis:
    """Answer every question of docs/analysis.md for a plant.

    Args:
        system: the plant; parameters stay symbolic except where stability needs numbers.
        seconds: time for each group of answers.

    Raises:
        NotAffineError: if the plant is not affine in its inputs, the one thing nothing can be said without.
    """
    if len(system.states) >= LARGE:
        keys = tuple(key for group in GROUPS for key in group)
        return Analysis(system=system, point=given_point(system), findings=large_findings(system, keys))
    control_affine(system)
    findings: dict[str, Finding] = {}
    for keys, group in GROUPS.items():
        findings |= _answered(keys, group, system, seconds)
    return Analysis(system=system, point=operating_point(system), findings=findings)


def _answered(
    keys: tuple[str, ...], group: Callable[[System], dict[str, Finding]], system: System, seconds: float
) -> dict[str, Finding]:
    """The findings of a group; one that fails or runs out of time leaves its keys undecided, with the reason."""
    try:
        outcome = attempt(seconds, keys[0], group, system)
    except UlnaError as error:
        return {key: not_applicable(key, str(error)) for key in keys}
    found = outcome.value
    if found is None:
        return {key: not_applicable(key, outcome.reason) for key in keys}
    # What has no value of its own shares the verdict of the question it hangs on, the group's first.
    first = found[keys[0]].verdict
    return {key: found.get(key, Finding(verdict=first, value=None)) for key in keys}
