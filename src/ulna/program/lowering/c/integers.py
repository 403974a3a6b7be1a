"""A program of fixed point as statements of C99."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.program.fixed.integers import IntegerInstruction, IntegerProgram, Step

_HEADER = """\
#include <stdint.h>
"""
_WHOLE = """
/* Divided by 2^by, rounded down; no sign bit is shifted. */
static inline int64_t whole(int64_t value, uint32_t by)
{
    const uint64_t flip = (value < 0) ? UINT64_MAX : UINT64_C(0);
    const uint64_t shifted = ((uint64_t)value ^ flip) >> by;
    int64_t part = (int64_t)shifted;
    if (value < 0)
    {
        part = -1 - part;
    }
    return part;
}
"""
_DOWN = """
/* Divided by 2^by, half a unit rounded up. */
static inline int64_t down(int64_t value, uint32_t by)
{
    return whole(value + (INT64_C(1) << (by - 1U)), by);
}
"""
_ROOT = """
/* The largest integer whose square is not above the value. */
static int32_t root(int64_t value)
{
    int64_t found = 0;
    for (int32_t bit = 31; bit >= 0; bit--)
    {
        const int64_t tried = found + (INT64_C(1) << bit);
        if ((tried <= INT64_C(3037000499)) && ((tried * tried) <= value))
        {
            found = tried;
        }
    }
    return (int32_t)found;
}
"""
_LIMITED = """
/* The value within two ends. */
static inline int32_t limited(int32_t value, int32_t low, int32_t high)
{
    return (value < low) ? low : ((value > high) ? high : value);
}
"""
# Of the type of what they go into: the plain 1 would be a char to MISRA.
_TRUE, _FALSE = "(int32_t)1", "(int32_t)0"
_SIGNS = {Step.ADD: "+", Step.SUB: "-", Step.MUL: "*", Step.DIV: "/"}
_COMPARED = {Step.LESS: "<", Step.LESS_EQUAL: "<=", Step.EQUAL: "=="}


def integer_header(text: str) -> str:
    """The functions that statements need above them: those that the text calls."""
    text += _DOWN if "down(" in text else ""
    parts = {"whole(": _WHOLE, "down(": _DOWN, "root(": _ROOT, "limited(": _LIMITED}
    return _HEADER + "".join(part for call, part in parts.items() if call in text)


def integer_literal(value: int) -> str:
    """The number as 32 bits."""
    return f"INT32_C({value})" if value >= 0 else f"(-INT32_C({-value}))"


def integer_statements(program: IntegerProgram, inputs: Sequence[str]) -> tuple[list[tuple[str, str]], list[str]]:
    """Pairs (name, expression) of v0, v1, … in order, and the expressions of the outputs.

    Args:
        program: what to write out. inputs: for each input the text that stands for it.
    """
    known, pairs = list(inputs), []
    for place, each in enumerate(program.instructions):
        if each.step is Step.CONSTANT:
            known.append(integer_literal(each.value))
            continue
        text = _expression(each, [known[k] for k in each.operands])
        known.append(f"v{place}")
        pairs.append((known[-1], text))
    return pairs, [known[k] for k in program.results]


def _wide(text: str, by: int) -> str:
    """An operand in 64 bits, shifted."""
    wide = f"(int64_t){text}"
    return wide if by == 0 else f"down({wide}, {by}U)" if by > 0 else f"({wide} * INT64_C({1 << -by}))"


def _narrow(text: str, by: int) -> str:
    """A result of 64 bits, shifted, in 32."""
    return f"(int32_t)({_scaled(text, by)})"


def _scaled(text: str, by: int) -> str:
    return text if by == 0 else f"down({text}, {by}U)" if by > 0 else f"({text}) * INT64_C({1 << -by})"


def _expression(each: IntegerInstruction, texts: list[str]) -> str:  # noqa: PLR0911 - one for each kind
    step, shifts = each.step, each.shifts
    if step is Step.SELECT:
        chosen = [_narrow(_wide(text, 0), by) if by else text for text, by in zip(texts[1:], shifts, strict=True)]
        return f"({texts[0]} != 0) ? {chosen[0]} : {chosen[1]}"
    if step in (Step.AND, Step.OR):
        sign = "&&" if step is Step.AND else "||"
        return f"(({texts[0]} != 0) {sign} ({texts[1]} != 0)) ? {_TRUE} : {_FALSE}"
    if step is Step.NOT:
        return f"({texts[0]} == 0) ? {_TRUE} : {_FALSE}"
    if step is Step.FLOOR:
        return _narrow(f"whole((int64_t){texts[0]}, {shifts[0]}U)", shifts[-1])
    plain = not any(shifts) and step is not Step.MUL
    wide = texts if plain else [_wide(text, by) for text, by in zip(texts, shifts, strict=False)]
    if step in _COMPARED:
        return f"({wide[0]} {_COMPARED[step]} {wide[1]}) ? {_TRUE} : {_FALSE}"
    if step in (Step.MIN, Step.MAX):
        sign = "<" if step is Step.MIN else ">"
        chosen = f"(({wide[0]} {sign} {wide[1]}) ? {wide[0]} : {wide[1]})"
        return chosen if plain else _narrow(chosen, shifts[-1])
    if step is Step.NEG:
        return f"-{texts[0]}"
    if step is Step.ABS:
        return f"({texts[0]} < 0) ? -{texts[0]} : {texts[0]}"
    if step is Step.ROOT:
        return f"root({wide[0]})"
    if step is Step.MOVED:
        return _narrow(wide[0], 0)
    expression = f"{wide[0]} {_SIGNS[step]} {wide[1]}"
    return expression if plain else _narrow(expression, shifts[-1] if step is not Step.DIV else 0)
