"""Everything a plant's vector fields say, key by key: `analyse(system)` (keys and values: docs/analysis.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from html import escape

import sympy as sp

from ulna.base import Status, UlnaError
from ulna.design.analysis.answer import Answer, not_applicable
from ulna.design.analysis.consistency import consistent
from ulna.design.analysis.discrete_answers import discrete_answers
from ulna.design.analysis.formula_answers import GROUPS, law_of_outputs, outputs_answered
from ulna.design.analysis.numeric_answers import LARGE, answers_in_numbers, law_in_numbers, structure_answers
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import attempt, patience, worked
from ulna.symbolic.formulas import is_longer
from ulna.system import (
    Equilibrium,
    System,
    control_affine,
    controlled_part,
    equilibrium,
    equilibrium_in_numbers,
    given_point,
    measured_part,
    system_kernel,
)

SECONDS = 8.0
"""Time that one group of answers may take; what is not found by then is undecided."""
SHORT = 150
"""Operations of rates and outputs up to which formulas are sought for a large plant too, of its given outputs only."""
SHARE = 0.4
"""Part of that time for formulas of what numbers have answered."""
TOTAL = 2.5
"""All groups together may take this many times as long."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis(Mapping[str, Answer]):
    """The answers to the standard questions about a plant, a mapping: `analysis["relative_degree"]`.

    Attributes:
        system: the plant.
        point: the operating point at which pointwise questions were asked.
        answers: by key, each a value with its verdict and evidence.
    """

    system: System
    point: Equilibrium
    answers: Mapping[str, Answer]

    def __getitem__(self, key: str) -> Answer:
        return self.answers[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.answers)

    def __len__(self) -> int:
        return len(self.answers)

    def __repr__(self) -> str:
        rows = [
            f"  {key:<{max(map(len, self.answers))}}  {answer.verdict.status!s:<9}  {_short(answer.value, 80)}"
            for key, answer in self.answers.items()
        ]
        return "\n".join((f"Analysis of '{self.system.name}'", *rows))

    def _repr_html_(self) -> str:
        """A table for notebooks: question, verdict, answer."""
        rows = "".join(
            f"<tr><td>{escape(key)}</td><td>{answer.verdict.status}</td><td>{escape(_short(answer.value))}</td></tr>"
            for key, answer in self.answers.items()
        )
        return f"<table><caption>{escape(self.system.name)}</caption>{rows}</table>"


def analyse(
    system: PlantLike,
    *,
    seconds: float = SECONDS,
    groups: float = TOTAL,
    told: Callable[[Mapping[str, Answer]], None] | None = None,
) -> Analysis:
    """Answer every question of docs/analysis.md for a plant; in discrete time those on its linearisation.

    Args:
        system: the plant, or its name or file. Keys that begin with `observ` are about its measured outputs, all others
            about the controlled ones; parameters stay symbolic except where stability needs numbers.
        seconds: time for each group of answers.
        groups: all groups together may take this many times as long.
        told: called with the answers so far, at the start, where all are undecided, and after each group.

    Raises:
        NotAffineError: if the plant is not affine in its inputs, the one thing nothing can be said without.
    """
    system = as_plant(system)
    if system.discrete:
        point = equilibrium(system)
        return Analysis(system=system, point=point, answers=discrete_answers(system, point))
    by, seen = controlled_part(system), measured_part(system)
    if [s.name for s in by.outputs] != [s.name for s in seen.outputs]:
        found = analyse(by, seconds=seconds, groups=groups, told=told)
        watched = analyse(seen, seconds=seconds, groups=groups)
        further = {key: answer for key, answer in watched.answers.items() if key.startswith("observ")}
        return replace(found, system=system, answers={**found.answers, **further})
    system = by
    keys = tuple(key for group in GROUPS for key in group)
    answers = {key: not_applicable(key, "the time was spent", ran_out=True) for key in keys}
    if told is not None:
        told(answers)
    if len(system.states) >= LARGE:
        answers = consistent(system, _large(system, keys, seconds))
        return Analysis(system=system, point=given_point(system), answers=answers)
    control_affine(system)
    end = worked() + groups * seconds * patience()
    here = equilibrium_in_numbers(system)
    numbers = consistent(system, structure_answers(system, here, keys), here.where)
    answers |= numbers
    for group_keys, group in GROUPS.items():
        # What numbers have answered formulas only make more of: they get a share of the time, the open questions all.
        share = seconds if _open(numbers[group_keys[0]]) else seconds * SHARE
        left = max(min(share, end - worked()), 0.5)
        found = _answered(group_keys, group, system, left)
        answers |= {key: numbers[key] if _open(a) and not _open(numbers[key]) else a for key, a in found.items()}
        if told is not None:
            told(answers)
    answers = consistent(system, answers, here.where)
    if _open(answers["control"]) and answers["linearizing_outputs"].verdict.holds and not _missing(system):
        answers |= {"control": law_in_numbers(system).get("control", answers["control"])}
    return Analysis(system=system, point=equilibrium(system), answers=answers)


def _in_numbers(system: System, keys: tuple[str, ...]) -> dict[str, Answer]:
    """What the numeric road answers; a plant it cannot take leaves every key undecided, with the reason."""
    try:
        return answers_in_numbers(system, keys)
    except UlnaError as error:
        return {key: not_applicable(key, str(error)) for key in keys}


def _missing(system: System) -> bool:
    """Whether a parameter has no value: then no law can be compiled."""
    return len(system.values) < len(system.parameters)


def _open(answer: Answer) -> bool:
    return answer.verdict.status is Status.UNDECIDED


def _short(value: object, limit: int = 300) -> str:
    if isinstance(value, list | tuple | Mapping | sp.Basic) and is_longer(value, 5_000):
        return "an answer of more than 5000 parts"
    text = "" if value is None else str(value)
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text)} characters)"


def _large(system: System, keys: tuple[str, ...], seconds: float) -> dict[str, Answer]:
    """The numeric road's answers, for a plant of few operations with the formulas of its given outputs."""
    answers = _in_numbers(system, keys)
    if not _short_program(system):
        return answers
    for question in (outputs_answered, law_of_outputs):
        try:
            found = attempt(seconds, "formulas of the outputs", question, system).value
        except UlnaError:
            break
        if found is None:
            break
        answers |= {key: a for key, a in found.items() if a.verdict.status is not Status.UNDECIDED}
    return answers


def _short_program(system: System) -> bool:
    try:
        return system_kernel(system).kernel.operation_count <= SHORT
    except UlnaError:
        return False


def _answered(
    keys: tuple[str, ...], group: Callable[[System], dict[str, Answer]], system: System, seconds: float
) -> dict[str, Answer]:
    """The answers of a group; one that fails or runs out of time leaves its keys undecided, with the reason."""
    try:
        outcome = attempt(seconds, keys[0], group, system)
    except UlnaError as error:
        return {key: not_applicable(key, str(error)) for key in keys}
    found = outcome.value
    if found is None:
        return {key: not_applicable(key, outcome.reason, ran_out=outcome.ran_out) for key in keys}
    # What has no value of its own shares the verdict of the question it hangs on, the group's first.
    first = found[keys[0]].verdict
    return {key: Answer(verdict=first, value=None) for key in keys} | found
