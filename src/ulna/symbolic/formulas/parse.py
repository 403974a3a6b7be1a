"""Formula text → SymPy expression. The text is data: it is read, checked and never run.

SymEngine's own parser does the reading (DESIGN section 3). It evaluates numbers as it goes (`9**9**9` would hang it)
and dies on some operators, so the text is first cut into words here: every name and every number goes in as a
placeholder, only arithmetic and comparison signs pass, and powers are sized on the finished tree before they are
computed. Decimal numbers become exact rationals.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, NamedTuple

import sympy as sp
from sympy.logic.boolalg import Boolean

from ulna.base import FormulaError
from ulna.symbolic.formulas.long_sums import grouped
from ulna.symbolic.formulas.text import MOST_DIGITS, decimal

_WORD = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[^\W\d]\w*)"
    r"|(?P<sign>\*\*|<=|>=|==|!=|[-+*/^(),<>&|])"
    r"|(?P<space>\s+)"
    r"|(?P<other>.)",
    re.DOTALL,
)
_JOINING = {"and": "&", "or": "|"}
_MAX_LENGTH = 2_000_000
_MAX_DEPTH = 150
"""Levels of a formula as a tree."""
_MAX_OPEN = 2 * _MAX_DEPTH
"""Parentheses and powers of powers in one another: a tree that may be read is also written with fewer."""
_MAX_EXPONENT = 1000

_FUNCTIONS: Mapping[str, tuple[str, int]] = {
    # formula name: (name in SymEngine's parser, number of arguments; -1: one or more)
    "sin": ("sin", 1), "cos": ("cos", 1), "tan": ("tan", 1), "cot": ("cot", 1), "sec": ("sec", 1), "csc": ("csc", 1),
    "asin": ("asin", 1), "acos": ("acos", 1), "atan": ("atan", 1), "atan2": ("atan2", 2),
    "sinh": ("sinh", 1), "cosh": ("cosh", 1), "tanh": ("tanh", 1),
    "asinh": ("asinh", 1), "acosh": ("acosh", 1), "atanh": ("atanh", 1),
    "exp": ("exp", 1), "log": ("log", 1), "ln": ("log", 1), "sqrt": ("sqrt", 1),
    "abs": ("abs", 1), "Abs": ("abs", 1), "sign": ("sign", 1), "floor": ("floor", 1), "ceiling": ("ceiling", 1),
    "min": ("min", -1), "Min": ("min", -1), "max": ("max", -1), "Max": ("max", -1),
    "heaviside": ("heaviside", 1), "Heaviside": ("heaviside", 1),
    "Rational": ("Rational", 2), "Piecewise": ("Piecewise", -1),
    "And": ("And", -1), "Or": ("Or", -1), "Not": ("Not", 1), "Eq": ("Eq", 2), "Ne": ("Ne", 2),
}  # fmt: skip
RESERVED = frozenset(_FUNCTIONS) | {"pi", "True"}
"""Names that no state, input, output, parameter or definition may take."""

_TREE: Mapping[str, Callable[..., Any]] = {
    "Add": sp.Add, "Mul": sp.Mul, "Abs": sp.Abs, "Min": sp.Min, "Max": sp.Max,
    "StrictLessThan": sp.StrictLessThan, "LessThan": sp.LessThan, "Equality": sp.Eq, "Unequality": sp.Ne,
    "And": sp.And, "Or": sp.Or, "Not": sp.Not,
    **{n: getattr(sp, n) for n in (
        "sin", "cos", "tan", "cot", "sec", "csc", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
        "asinh", "acosh", "atanh", "exp", "log", "sign", "floor", "ceiling",
    )},
    # SymEngine rewrites sin(x + pi/2) and the like only for numbers, so no further heads appear.
}  # fmt: skip


class _Word(NamedTuple):
    """A word of a formula: its kind (a group of the pattern above), its text, and at which character it begins."""

    kind: str
    text: str
    place: int

    @classmethod
    def of(cls, match: re.Match[str], names: Collection[str]) -> _Word:
        word = match.group()
        if word in _JOINING and word not in names:
            return cls("sign", _JOINING[word], match.start() + 1)
        return cls(str(match.lastgroup), word, match.start() + 1)


@dataclass(frozen=True, slots=True)
class _Placeholders:
    """What stands behind the placeholder names that go into the parser."""

    values: dict[str, sp.Expr]

    def name(self, value: sp.Expr) -> str:
        # Another one each time: the parser itself must not take 0/0 for 1.
        key = f"q{len(self.values)}_"
        self.values[key] = value
        return key


def is_elementary(expression: sp.Expr) -> bool:
    """True if the formula language has every function that occurs: no exponential integral, no error function."""
    return {type(node).__name__ for node in expression.atoms(sp.Function)} <= _FUNCTIONS.keys()


def parse_formula(text: str, names: Mapping[str, sp.Expr], *, where: str = "formula") -> sp.Expr:
    """The expression that `text` writes, in the given names.

    Args:
        text: arithmetic with `+ - * / ** ^ ( )`, decimal numbers, `pi` and the usual functions.
        names: what each name stands for, usually real symbols.
        where: how an error names this formula (`"equation of state 'omega'"`).

    Raises:
        FormulaError: for syntax, unknown names or functions, attributes, and powers too large to compute.
    """
    if not isinstance(text, str):
        raise FormulaError(where, f"expected a text, found {type(text).__name__} {text!r}.", "Put it in quotes.")
    held = _Placeholders(values={})
    safe = _safe_words(text, names, where, held)
    try:
        from symengine.lib.symengine_wrapper import sympify

        tree = sympify(safe)
    except RuntimeError:
        raise FormulaError(where, f"'{_shown(text)}' is not a complete formula.", _syntax_hint(text)) from None
    return _checked(_to_sympy(tree, held.values, where), text, where)


def _safe_words(text: str, names: Mapping[str, sp.Expr], where: str, held: _Placeholders) -> str:
    """The text with placeholders for names and numbers; refuses what is no part of the language."""
    if len(text) > _MAX_LENGTH:
        raise FormulaError(where, f"{len(text)} characters long.", f"At most {_MAX_LENGTH} are read; use definitions.")
    if not text.strip():
        raise FormulaError(where, "the formula is empty.")
    parts: list[str] = []
    # Powers that stand open at each level of parentheses: a chain of them nests to the right.
    depth, powers = 0, [0]
    words = [_Word.of(m, names) for m in _WORD.finditer(text) if m.lastgroup != "space"]
    for i, (kind, word, place) in enumerate(words):
        before, after = words[i - 1] if i else _Word("", "", 0), words[i + 1].text if i + 1 < len(words) else ""
        if kind == "number":
            parts.append(held.name(_number(word, where)))
        elif kind == "name":
            parts.append(_safe_name(word, after == "(", names, where, held))
        elif kind == "sign":
            depth += {"(": 1, ")": -1}.get(word, 0)
            _follow_powers(word, before.text, powers)
            if depth < 0 or depth + sum(powers) > _MAX_OPEN:
                found = "a ')' too many" if depth < 0 else f"nested deeper than {_MAX_DEPTH}"
                raise FormulaError(where, f"{found} at character {place} of '{_shown(text)}'.")
            parts.append(word)
        else:
            raise FormulaError(
                where,
                f"'{word}' at character {place} of '{_shown(text)}' is not part of a formula.",
                "Formulas are arithmetic in declared names: + - * / ** and functions such as sin(x).",
            )
        if kind in ("number", "name") and before.kind in ("number", "name"):
            raise FormulaError(
                where,
                f"no operator between '{before.text}' and '{word}' in '{_shown(text)}'.",
                "Write products with '*'.",
            )
    if depth:
        raise FormulaError(where, f"{depth} '(' without ')' in '{_shown(text)}'.")
    return grouped(parts)


def _follow_powers(sign: str, before: str, powers: list[int]) -> None:
    """Count the powers that stand open behind a sign."""
    if sign == "(":
        powers.append(0)
    elif sign == ")":
        del powers[max(1, len(powers) - 1) :]
    elif sign in ("**", "^"):
        powers[-1] += 1
    elif before not in ("**", "^"):
        powers[-1] = 0


def _safe_name(word: str, called: bool, names: Mapping[str, sp.Expr], where: str, held: _Placeholders) -> str:
    if called:
        if word not in _FUNCTIONS:
            known = f"Known functions: {', '.join(sorted(n for n in _FUNCTIONS if n.islower()))}."
            found = f"'{word}' is a name, not a function." if word in names else f"unknown function '{word}'."
            raise FormulaError(where, found, "Write products with '*'." if word in names else known)
        return _FUNCTIONS[word][0]
    if word in names:
        return held.name(names[word])
    if word == "pi":
        return held.name(sp.pi)
    if word == "True":
        return word
    near = get_close_matches(word, names, n=1)
    hint = f"Did you mean '{near[0]}'?" if near else f"Declared names: {', '.join(names) or 'none'}."
    found = f"the function '{word}' without its argument." if word in _FUNCTIONS else f"unknown symbol '{word}'."
    raise FormulaError(where, found, hint)


def _number(word: str, where: str) -> sp.Expr:
    try:
        return decimal(word)
    except ValueError:
        raise FormulaError(where, f"the number {_shown(word)} has too many digits.") from None


def _to_sympy(node: Any, values: Mapping[str, sp.Expr], where: str, depth: int = 0) -> Any:
    """SymEngine's tree as SymPy's, every power sized before it is computed, every number real and finite."""
    head = type(node).__name__
    if head == "FunctionSymbol":
        head = node.get_name()
    if head == "Symbol":
        return values[str(node)]
    if not node.args:
        return sp.sympify(node)
    if depth > _MAX_DEPTH:
        raise FormulaError(where, f"it is nested deeper than {_MAX_DEPTH}.", "Use definitions for its parts.")
    arguments = [_to_sympy(child, values, where, depth + 1) for child in node.args]
    _check_arguments(head, arguments, where)
    try:
        found = _applied(head, arguments, where)
        wrong = isinstance(found, sp.Expr) and found.is_number and found not in _INFINITE and _wrong_number(found)
    except (ArithmeticError, NotImplementedError, RecursionError, TypeError, ValueError) as error:
        raise FormulaError(where, f"{head} has no value there ({error}).") from None
    if wrong:
        raise FormulaError(where, f"it {wrong}.", _COMPLEX if "real" in wrong else "Write a smaller one.")
    return found


def without_value(expression: sp.Expr) -> str:
    """Why an expression is not a real number anywhere, its parameters numbers: `"divides by zero"`; else empty."""
    if expression.has(*_INFINITE):
        return "divides by zero"
    if expression.has(sp.I):
        return "is not real"
    numbers = (node for node in expression.atoms(sp.Pow, sp.exp, sp.log, sp.Function) if node.is_number)
    return next(filter(None, map(_wrong_number, sorted(numbers, key=sp.Expr.count_ops))), "")


def _wrong_number(number: sp.Expr) -> str:
    """What is wrong with a number whose parts are right: it is enormous, or not real; else empty."""
    if isinstance(number, sp.exp | sp.sinh | sp.cosh) and not abs(number.args[0].evalf(5)) < _MOST_EXPONENT:
        return f"holds a number of more than {MOST_DIGITS} digits"
    if number.is_extended_real is False:
        return f"is not real: {_shown(str(number))} is a complex number"
    return ""


_MOST_EXPONENT = 2.3 * MOST_DIGITS
"""Of e, so that a number has at most so many digits."""
_INFINITE = frozenset({sp.zoo, sp.nan, sp.oo, -sp.oo})
_COMPLEX = "Roots and logarithms of negative numbers are complex; write -(8**(1/3)) for the real root of -8."


_LOGICAL = ("And", "Or", "Not")


def _check_arguments(head: str, arguments: Sequence[Any], where: str) -> None:
    """Refuse comparisons where numbers are due and the other way round, and numbers that are infinite."""
    for place, each in enumerate(arguments):
        if isinstance(each, sp.Expr) == (head in _LOGICAL or (head == "Piecewise" and place % 2 == 1)):
            due = (
                "a comparison stands where a number"
                if isinstance(each, Boolean)
                else "a number stands where a comparison"
            )
            raise FormulaError(where, f"{due} is expected.", "Write Piecewise((value, x < 1), (other, True)).")
        if each in _INFINITE:
            raise FormulaError(where, f"an argument of {head} divides by zero or is the logarithm of zero.")


def _applied(head: str, arguments: Sequence[Any], where: str) -> Any:
    if head == "Pow":
        check_power(arguments[0], arguments[1], where)
        return sp.Pow(*arguments)
    if head == "Rational" and len(arguments) == 2:
        if not all(a.is_Rational for a in arguments) or arguments[1] == 0:
            raise FormulaError(where, "Rational() takes two numbers, the second not 0.")
        return arguments[0] / arguments[1]
    if head == "heaviside" and len(arguments) == 1:
        return sp.Heaviside(arguments[0])
    if head == "Piecewise":
        return sp.Piecewise(*zip(arguments[::2], arguments[1::2], strict=True))
    if head in _TREE and _FUNCTIONS.get(head, ("", -1))[1] in (-1, len(arguments)):
        return _TREE[head](*arguments)
    due = _FUNCTIONS.get(head, ("", -1))[1]
    raise FormulaError(where, f"{head}() takes {due} argument{'s' * (due != 1)}, {len(arguments)} were given.")


def check_power(base: sp.Expr, exponent: sp.Expr, where: str) -> None:
    """Refuse a power that is too large to be computed.

    Raises:
        FormulaError: naming its size.
    """
    if exponent.is_Rational and abs(exponent) > _MAX_EXPONENT and base is not sp.E:
        found = f"the exponent {_shown(str(exponent))} is too large (limit {_MAX_EXPONENT})."
        raise FormulaError(where, found, "Use exp() for steep growth.")
    if base.is_Rational and exponent.is_Rational and abs(base) not in (0, 1):
        digits = max(len(str(base.p)), len(str(base.q))) * abs(exponent)
        if digits > MOST_DIGITS:
            raise FormulaError(where, f"a number of some {int(digits)} digits (limit {MOST_DIGITS}).")
        return
    steep = base.is_number and exponent.is_number and base.is_positive
    if steep and not abs((exponent * sp.log(base, 10)).evalf(5)) < MOST_DIGITS:
        raise FormulaError(where, f"a number of more than {MOST_DIGITS} digits.")


def _checked(expression: Any, text: str, where: str) -> sp.Expr:
    if not isinstance(expression, sp.Expr):
        raise FormulaError(where, f"'{_shown(text)}' is a comparison, not a number.", "Use it inside Piecewise.")
    if expression.has(*_INFINITE):
        raise FormulaError(where, f"'{_shown(text)}' divides by zero.")
    # Powers of powers and products of powers have become one by now.
    for power in expression.atoms(sp.Pow):
        check_power(power.base, power.exp, where)
    return expression


def _syntax_hint(text: str) -> str:
    stripped = text.strip()
    if stripped[-1] in "+-*/^(,":
        return f"It ends with '{stripped[-1]}'."
    if "&" in stripped or "|" in stripped:
        return "Conditions have a comparison on both sides: (x < 1) & (y > 0)."
    return "Look for two operators in a row, a missing operand or a wrong number of arguments."


def _shown(text: str, limit: int = 70) -> str:
    return text if len(text) <= limit else f"{text[: limit - 1]}…"
