"""`IntegerProgram`: a kernel in fixed point, as operations on integers of 32 bits; the reference for its C."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from typing import Any

WORD = 32
"""Bits of every value; sums and products are formed in twice as many."""
LARGEST = 2 ** (WORD - 1) - 1


class Step(StrEnum):
    """What one instruction computes of integers a, b; `shifts` are those of its operands, then that of the result.

    A shift to the right rounds half a unit up, but for FLOOR; a negative one is to the left.
    """

    CONSTANT = "constant"
    ADD = "add"
    SUB = "sub"
    MUL = "mul"
    DIV = "div"
    """Rounded towards zero, as C does."""
    NEG = "neg"
    ABS = "abs"
    MOVED = "moved"
    """Another binary point."""
    FLOOR = "floor"
    """Whole units: a shift to the right without rounding, then one to the left."""
    MIN = "min"
    MAX = "max"
    LESS = "less"
    LESS_EQUAL = "less_equal"
    EQUAL = "equal"
    AND = "and"
    OR = "or"
    NOT = "not"
    SELECT = "select"
    """The second operand where the first is not 0, else the third; only the one that is chosen is shifted."""
    ROOT = "root"
    """The largest integer whose square is not above the operand."""


@dataclass(frozen=True, slots=True)
class IntegerInstruction:
    """One value; operand k is input k for k < number of inputs, else instruction k − number of inputs."""

    step: Step
    operands: tuple[int, ...] = ()
    shifts: tuple[int, ...] = ()
    value: int = 0


@dataclass(frozen=True, slots=True)
class Format:
    """An integer n stands for n · 2^−point, between lower and upper in SI."""

    point: int
    lower: float
    upper: float

    def integer(self, value: float) -> int:
        """The nearest integer, within the bounds; NaN becomes 0."""
        if math.isnan(value):
            return 0
        scaled = min(max(value, self.lower), self.upper) * 2.0**self.point
        return min(LARGEST, max(-LARGEST, math.floor(scaled + 0.5)))

    @property
    def ends(self) -> tuple[int, int]:
        """The bounds as integers, inward."""
        scale = 2.0**self.point
        return max(-LARGEST, math.ceil(self.lower * scale)), min(LARGEST, math.floor(self.upper * scale))

    def number(self, value: int) -> float:
        """What an integer stands for."""
        return value * 2.0**-self.point


@dataclass(frozen=True, slots=True)
class Doubt:
    """A comparison, or a rounding to whole numbers, that may come out otherwise than in double precision.

    Attributes:
        text: what is decided. margin: how near to each other its sides must be for that.
    """

    text: str
    margin: float


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegerProgram:
    """A function from named integers to named integers.

    Attributes:
        inputs, outputs: names with the format of each. instructions: the list. results: of each output its value.
        functions: largest error of each polynomial that stands for a function, by name, and where it is used.
        errors: of each output, how far it is from the same kernel in double precision on the same inputs at most, as
            long as every doubt comes out as there. doubts: of all outputs.
    """

    inputs: Mapping[str, Format]
    outputs: Mapping[str, Format]
    instructions: tuple[IntegerInstruction, ...]
    results: tuple[int, ...]
    functions: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[Doubt, ...] = ()

    def run(self, given: Sequence[int]) -> list[int]:
        """The outputs in order, of inputs in order, which are limited to their bounds."""
        return list(self.compiled(*given))

    @property
    def compiled(self) -> Callable[..., tuple[int, ...]]:
        """The program as a function of whole numbers of any size: what C computes where nothing overflows."""
        return _compiled(self.source)

    @property
    def source(self) -> str:
        """The function in Python."""
        known = [f"i{k}" for k in range(len(self.inputs))]
        lines = [f"def program({', '.join(known)}):"]
        for name, (low, high) in zip(known, (form.ends for form in self.inputs.values()), strict=True):
            lines.append(f"    {name} = {low} if {name} < {low} else {high} if {name} > {high} else {name}")
        for place, each in enumerate(self.instructions):
            lines.append(f"    v{place} = {_text(each, [known[k] for k in each.operands])}")
            known.append(f"v{place}")
        return "\n".join([*lines, f"    return ({''.join(f'{known[k]}, ' for k in self.results)})"]) + "\n"


@cache
def _compiled(source: str) -> Callable[..., tuple[int, ...]]:
    namespace: dict[str, Any] = {"root": math.isqrt}
    exec(compile(source, "<fixed point>", "exec"), namespace)  # noqa: S102 - whole numbers and names of our own
    return namespace["program"]


_SIGNS = {Step.ADD: "+", Step.SUB: "-", Step.MUL: "*"}
_COMPARED = {Step.LESS: "<", Step.LESS_EQUAL: "<=", Step.EQUAL: "=="}


def _shifted(text: str, by: int) -> str:
    """To the right with half a unit rounded up, or to the left."""
    return text if by == 0 else f"(({text} + {1 << (by - 1)}) >> {by})" if by > 0 else f"(({text}) << {-by})"


def _text(each: IntegerInstruction, names: list[str]) -> str:
    """One instruction in Python."""
    step, shifts = each.step, each.shifts
    if step is Step.CONSTANT:
        return str(each.value)
    if step is Step.SELECT:
        yes, no = (_shifted(name, by) for name, by in zip(names[1:], shifts, strict=True))
        return f"{yes} if {names[0]} != 0 else {no}"
    if step in (Step.AND, Step.OR):
        return f"int({names[0]} != 0 {step.value} {names[1]} != 0)"
    if step is Step.FLOOR:
        return _shifted(f"({names[0]} >> {shifts[0]})", shifts[-1])
    given = [_shifted(name, by) for name, by in zip(names, shifts, strict=False)]
    last = shifts[-1]
    if step in _SIGNS:
        return _shifted(f"({given[0]} {_SIGNS[step]} {given[1]})", last)
    if step in _COMPARED:
        return f"int({given[0]} {_COMPARED[step]} {given[1]})"
    if step in (Step.MIN, Step.MAX):
        return _shifted(f"{step.value}({given[0]}, {given[1]})", last)
    if step is Step.DIV:
        sign = f"(1 if ({given[0]} < 0) == ({given[1]} < 0) else -1)"
        return f"abs({given[0]}) // abs({given[1]}) * {sign}"
    forms = {Step.NEG: "-{}", Step.ABS: "abs({})", Step.NOT: "int({} == 0)", Step.ROOT: "root({})"}
    return forms.get(step, "{}").format(given[0])
