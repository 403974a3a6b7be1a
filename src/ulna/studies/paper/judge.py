"""All verdicts: every passage of the paper, and every sentence in it that claims something."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

import sympy as sp

from ulna.base import UlnaError
from ulna.studies.paper.carry import Checked
from ulna.studies.paper.compare import Comparison, Finding, compare_terms
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.mechanics import mechanics
from ulna.studies.paper.notation import read_printed
from ulna.studies.paper.printed import Claim, Paper, Passage
from ulna.studies.paper.runs import Loop
from ulna.studies.paper.statements import statements
from ulna.studies.paper.verdict import Judged, Shown
from ulna.system import Equilibria


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedClaim:
    """A sentence with its verdict: `holds` is None where it cannot be judged on this plant."""

    claim: Claim
    holds: bool | None
    meaning: str


def judge(paper: Paper, exact: Exact, chain: Mapping[str, Checked]) -> tuple[Judged, ...]:
    """Return the verdict on every passage, in the order of the paper.

    Raises:
        UlnaError: a passage of which nothing was compared.
    """
    laws = {**mechanics(paper), **statements(paper, exact)}
    found = []
    for passage in paper.passages:
        numbers = _from_chain(passage, chain)
        extra = _beside(passage, exact)
        general = laws.get(passage.key)
        comparisons = (*(general.comparisons if general else ()), *extra, *(numbers.comparisons if numbers else ()))
        if not comparisons:
            raise UlnaError(f"a verdict on {passage.label} '{passage.key}'", "no part of it was compared.")
        shown = (*(general.shown if general else ()), *(numbers.shown if numbers else ()))
        found.append(Judged(passage=passage, comparisons=comparisons, shown=shown))
    return tuple(found)


def judge_claims(paper: Paper, exact: Exact, rests: Equilibria, loops: Sequence[Loop]) -> tuple[JudgedClaim, ...]:
    """Return the verdict on every sentence that claims something."""
    origin = exact.form.map.forward.subs(dict.fromkeys(exact.view.x, 0))
    determinant = exact.brackets.det()
    printed = [loop for loop in loops if loop.printed]
    laws = {str(paper.entry(key, "u")).replace("xbar", "x") for key in ("law", "compensator_law")}
    speed = exact.view.x[1]
    answers: dict[str, bool | None] = {
        "several_equilibria": len(rests) > 1,
        "origin_kept": origin.is_zero_matrix,
        "full_rank": bool(determinant.is_number and determinant != 0),
        "motor_speed": None if not exact.view.h.has(speed) else False,
        "exponential_convergence": all(abs(loop.steady_error_degrees) < 1e-6 for loop in printed),
        "three_controllers": len(laws) == 3,
    }
    texts = notes()["claim"]
    return tuple(JudgedClaim(claim=claim, holds=answers[claim.key], meaning=texts[claim.key]) for claim in paper.claims)


@cache
def notes() -> Mapping[str, Mapping[str, str]]:
    """What verdicts mean, in words: passages, claims and figures, by key."""
    data: dict[str, Any] = tomllib.loads((files("ulna.studies.paper") / "notes.toml").read_text(encoding="utf-8"))
    return data


def count(judged: Sequence[Judged]) -> dict[Finding, int]:
    """How many numbered equations there are of each finding."""
    numbered = [entry for entry in judged if entry.passage.number]
    return {finding: sum(entry.finding is finding for entry in numbered) for finding in Finding}


def _from_chain(passage: Passage, chain: Mapping[str, Checked]) -> Judged | None:
    """The numbers of a passage; several results in it are told apart by their names."""
    steps = [checked for checked in chain.values() if checked.step.passage == passage.key and checked.step.listed]
    if not steps:
        return None
    several = len(steps) > 1
    comparisons = [_named(c, checked.step.entry) if several else c for checked in steps for c in checked.comparisons]
    shown = [Shown(value=checked.exact, name=checked.step.entry) for checked in steps]
    return Judged(passage=passage, comparisons=tuple(comparisons), shown=tuple(shown))


def _named(comparison: Comparison, entry: str) -> Comparison:
    return replace(comparison, place=", ".join(part for part in (entry, comparison.place) if part))


def _beside(passage: Passage, exact: Exact) -> tuple[Comparison, ...]:
    """What a passage says beside its numbers."""
    if passage.key == "controllability":
        rank = sp.Integer(exact.brackets.rank())
        return tuple(compare_terms(read_printed(str(passage.printed["rank"])), rank, place="rank"))
    return ()
