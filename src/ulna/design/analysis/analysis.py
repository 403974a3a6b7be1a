"""Everything a plant's vector fields say, key by key: `analyse(system)` (keys and values: docs/analysis.md)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial

import sympy as sp

from ulna.base import NotAffineError, Status, UlnaError, html_table
from ulna.design.analysis.answer import Answer, not_applicable
from ulna.design.analysis.consistency import consistent
from ulna.design.analysis.discrete_answers import discrete_answers
from ulna.design.analysis.formula_answers import GROUPS, RANKS, law_of_outputs, outputs_answered
from ulna.design.analysis.numeric_answers import LARGE, answers_in_numbers, law_in_numbers, structure_answers
from ulna.design.analysis.rest_answers import rest_points
from ulna.design.analysis.side_answers import asked_on_one_side, on_side
from ulna.design.analysis.summary import what_it_is, what_stands_in_the_way
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import attempt, patience, worked
from ulna.symbolic.formulas import is_longer, value_html
from ulna.system import (
    Equilibrium,
    System,
    control_affine,
    controlled_part,
    equilibrium,
    equilibrium_in_numbers,
    given_point,
    measured_part,
    on_one_side,
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

    Examples:
        >>> analysis = ulna.analyse("duffing", questions=["involutive"])
        >>> analysis["involutive"].verdict.holds
        True
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

    @property
    def summary(self) -> str:
        """Two sentences: what the plant is, and what stands in the way of a law and an observer."""
        return (
            f"{what_it_is(self.system, self.answers)} "
            f"{what_stands_in_the_way(self.system, self.answers, at_rest=self.point.verdict.holds)}"
        )

    def __repr__(self) -> str:
        rows = [
            f"  {key:<{max(map(len, self.answers))}}  {answer.verdict.status!s:<9}  {_short(answer.value, 80)}"
            for key, answer in self.answers.items()
        ]
        return "\n".join((f"Analysis of '{self.system.name}'", *rows))

    def _repr_html_(self) -> str:
        """A table for notebooks: question, verdict, answer."""
        rows = (
            (key.replace("_", " "), answer.verdict.status.value, _shown(answer.value))
            for key, answer in self.answers.items()
        )
        return html_table(rows, title=f"Analysis of '{self.system.name}'", headings=("question", "verdict", "answer"))


def analyse(
    system: PlantLike,
    *,
    questions: Collection[str] | None = None,
    within: Mapping[str, tuple[float, float]] | None = None,
    seconds: float = SECONDS,
    groups: float = TOTAL,
    told: Callable[[Mapping[str, Answer]], None] | None = None,
) -> Analysis:
    """The answers to every question of docs/analysis.md on a plant; in discrete time to those on its linearisation.

    Args:
        system: the plant, or its name or file. Keys that begin with `observ` are about its measured outputs, all others
            about the controlled ones; parameters stay symbolic except where stability needs numbers.
        questions: keys to be answered; left out, all.
        within: (lower, upper) by state, SI: where `rest_points` are looked for; left out, as `equilibria` has it.
        seconds: time for each group of answers.
        groups: all groups together may take this many times as long.
        told: called with the answers so far, at the start, where all are undecided, and after each group.

    Raises:
        UlnaError: for a question that is none of the keys.
        NotAffineError: if the plant is not affine in its inputs, the one thing nothing can be said without.

    Examples:
        >>> answer = ulna.analyse("duffing", questions=["relative_degree"])["relative_degree"]
        >>> answer.value, str(answer.verdict.status)
        ([2], 'proved')
    """
    system = as_plant(system)
    if system.discrete:
        point = equilibrium(system)
        answers = discrete_answers(system, point)
        return Analysis(system=system, point=point, answers={k: answers[k] for k in _asked(questions, tuple(answers))})
    by, seen = controlled_part(system), measured_part(system)
    wanted = _asked(questions, tuple(key for group in GROUPS for key in group))
    if [s.name for s in by.outputs] != [s.name for s in seen.outputs]:
        ask = partial(analyse, within=within, seconds=seconds, groups=groups, told=told)
        return _by_use(system, wanted, ask)
    system = by
    asked = {keys: question for keys, question in GROUPS.items() if set(keys) & set(wanted)}
    if within and ("rest_points",) in asked:
        asked["rest_points",] = partial(rest_points, within=within)
    keys = tuple(key for group in asked for key in group)
    answers = {key: not_applicable(key, "the time was spent", ran_out=True) for key in keys}
    if told is not None:
        told(answers)
    if len(system.states) >= LARGE:
        answers = consistent(system, _large(system, keys, seconds))
        return Analysis(system=system, point=given_point(system), answers={key: answers[key] for key in wanted})
    side = on_one_side(system)
    try:
        control_affine(system)
    except NotAffineError:
        if side is None:
            raise
        found = analyse(side.system, questions=wanted, within=within, seconds=seconds, groups=groups, told=told)
        return replace(found, system=system, answers={key: on_side(a, side) for key, a in found.items()})
    end = worked() + groups * seconds * patience()
    here = equilibrium_in_numbers(system)
    numbers = consistent(system, structure_answers(system, here, keys), here.where)
    answers |= numbers
    for group_keys, group in sorted(asked.items(), key=lambda item: item[0][0].startswith("observer")):
        if group_keys in RANKS and not any(_open(numbers[key]) for key in group_keys):
            continue
        # What numbers have answered formulas only make more of: they get a share of the time, the open questions all.
        share = seconds if _open(numbers[group_keys[0]]) else seconds * SHARE
        left = max(min(share, end - worked()), 0.5)
        found = _answered(group_keys, group, system, left)
        answers |= {key: numbers[key] if _open(a) and not _open(numbers[key]) else a for key, a in found.items()}
        if told is not None:
            told(answers)
    answers = consistent(system, answers, here.where)
    if "control" in answers and _open(answers["control"]) and _law_in_numbers_exists(system, answers):
        answers |= {"control": law_in_numbers(system).get("control", answers["control"])}
    answers = {key: answers[key] for key in wanted}
    if side is not None:
        part = partial(analyse, side.system, seconds=seconds, groups=groups)
        answers = asked_on_one_side(answers, side, lambda keys: part(questions=keys))
    return Analysis(system=system, point=equilibrium(system), answers=answers)


def _by_use(system: System, wanted: Collection[str], ask: Callable[..., Analysis]) -> Analysis:
    """What is asked about measured outputs of those, all else of the controlled ones."""
    watched = [key for key in wanted if key.startswith("observ")]
    parts = ((controlled_part(system), [key for key in wanted if key not in watched]), (measured_part(system), watched))
    found = [ask(part, questions=keys) for part, keys in parts if keys]
    answers = {key: answer for part in found for key, answer in part.items()}
    return replace(found[0], system=system, answers={key: answers[key] for key in wanted})


def _asked(questions: Collection[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    """The keys that are asked for, in the order known."""
    for key in questions or ():
        if key not in known:
            near = get_close_matches(key, known, n=3)
            hint = f"Did you mean {' or '.join(near)}? " if near else ""
            raise UlnaError(f"the question '{key}'", "there is no such question.", f"{hint}Known: {', '.join(known)}.")
    return known if questions is None else tuple(key for key in known if key in questions)


def _law_in_numbers_exists(system: System, answers: Mapping[str, Answer]) -> bool:
    """Whether a law can be compiled where its formula was not found: every parameter needs a value."""
    return answers["linearizing_outputs"].verdict.holds and len(system.values) == len(system.parameters)


def _in_numbers(system: System, keys: tuple[str, ...]) -> dict[str, Answer]:
    """What the numeric road answers; a plant it cannot take leaves every key undecided, with the reason."""
    try:
        return answers_in_numbers(system, keys)
    except UlnaError as error:
        return {key: not_applicable(key, str(error)) for key in keys}


def _open(answer: Answer) -> bool:
    return answer.verdict.status is Status.UNDECIDED


def _short(value: object, limit: int = 300) -> str:
    if isinstance(value, list | tuple | Mapping | sp.Basic) and is_longer(value, 5_000):
        return "an answer of more than 5000 parts"
    text = "" if value is None else str(value)
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text)} characters)"


def _shown(value: object) -> object:
    """What a table shows of a value: formulas set where they are short."""
    formulas = isinstance(value, list | tuple | Mapping | sp.Basic | sp.MatrixBase) and not is_longer(value, 200)
    return value_html(value) if formulas else _short(value)


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
    # What has no value of its own shares the verdict of the question it depends on, the group's first.
    first = found[keys[0]].verdict
    return {key: Answer(verdict=first, value=None) for key in keys} | found
