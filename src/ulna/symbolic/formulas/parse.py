"""Formula text → SymPy expression. The text is data: it is read, checked and never run.

SymEngine's own parser does the reading (DESIGN section 3). It evaluates numbers as it goes (`9**9**9` would hang it)
and dies on some operators, so the text is first cut into words here: every name and every number goes in as a
placeholder, only arithmetic and comparison signs pass, and powers are sized on the finished tree before they are
computed. Decimal numbers become exact rationals.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import sympy as sp

from ulna.base import FormulaError

_WORD = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[^\W\d]\w*)"
    r"|(?P<sign>\*\*|<=|>=|[-+*/^(),<>])"
    r"|(?P<space>\s+)"
    r"|(?P<other>.)",
    re.DOTALL,
)
_MAX_LENGTH = 2_000_000
_MAX_DEPTH = 150
_MAX_DIGITS = 4000
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
}  # fmt: skip
RESERVED = frozenset(_FUNCTIONS) | {"pi", "True"}
"""Names that no state, input, output, parameter or definition may take."""

_TREE: Mapping[str, Callable[..., Any]] = {
    "Add": sp.Add, "Mul": sp.Mul, "Abs": sp.Abs, "Min": sp.Min, "Max": sp.Max,
    "StrictLessThan": sp.StrictLessThan, "LessThan": sp.LessThan,
    **{n: getattr(sp, n) for n in (
        "sin", "cos", "tan", "cot", "sec", "csc", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
        "asinh", "acosh", "atanh", "exp", "log", "sign", "floor", "ceiling",
    )},
    # SymEngine rewrites sin(x + pi/2) and the like only for numbers, so no further heads appear.
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Placeholders:
    """What stands behind the placeholder names that go into the parser."""

    values: dict[str, sp.Expr]

    def name(self, value: sp.Expr) -> str:
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
        raise FormulaError(where, f"a text is due, {type(text).__name__} {text!r} was found.", "Put it in quotes.")
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
    depth = 0
    matches = [m for m in _WORD.finditer(text) if m.lastgroup != "space"]
    for i, match in enumerate(matches):
        kind, word, after = match.lastgroup, match.group(), matches[i + 1].group() if i + 1 < len(matches) else ""
        if kind == "number":
            parts.append(held.name(_number(word, where)))
        elif kind == "name":
            parts.append(_safe_name(word, after == "(", names, where, held))
        elif kind == "sign":
            depth += {"(": 1, ")": -1}.get(word, 0)
            if depth < 0 or depth > _MAX_DEPTH:
                found = "a ')' too many" if depth < 0 else f"parentheses nested deeper than {_MAX_DEPTH}"
                raise FormulaError(where, f"{found} at character {match.start() + 1} of '{_shown(text)}'.")
            parts.append(word)
        else:
            raise FormulaError(
                where,
                f"'{word}' at character {match.start() + 1} of '{_shown(text)}' is no part of a formula.",
                "Formulas are arithmetic in declared names: + - * / ** and functions such as sin(x).",
            )
        if i and kind in ("number", "name") and matches[i - 1].lastgroup in ("number", "name"):
            raise FormulaError(
                where,
                f"no operator between '{matches[i - 1].group()}' and '{word}' in '{_shown(text)}'.",
                "Write products with '*'.",
            )
    if depth:
        raise FormulaError(where, f"{depth} '(' without ')' in '{_shown(text)}'.")
    return " ".join(parts)


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
    exponent = re.search(r"[eE]([+-]?\d+)", word)
    if len(word) > _MAX_DIGITS or (exponent and abs(int(exponent.group(1)[:8])) > _MAX_DIGITS):
        raise FormulaError(where, f"the number {_shown(word)} is too long to be meant.")
    return sp.Rational(word)


def _to_sympy(node: Any, values: Mapping[str, sp.Expr], where: str) -> Any:
    """SymEngine's tree as SymPy's, every power sized before it is computed."""
    head = type(node).__name__
    if head == "FunctionSymbol":
        head = node.get_name()
    if head == "Symbol":
        return values[str(node)]
    if not node.args:
        return sp.sympify(node)
    arguments = [_to_sympy(child, values, where) for child in node.args]
    if head == "Pow":
        return _power(arguments[0], arguments[1], where)
    if head == "Rational" and len(arguments) == 2 and all(a.is_Rational for a in arguments) and arguments[1] != 0:
        return arguments[0] / arguments[1]
    if head == "heaviside" and len(arguments) == 1:
        return sp.Heaviside(arguments[0])
    if head == "Piecewise":
        return sp.Piecewise(*zip(arguments[::2], arguments[1::2], strict=True))
    if head in _TREE and _FUNCTIONS.get(head, ("", -1))[1] in (-1, len(arguments)):
        return _TREE[head](*arguments)
    due = _FUNCTIONS.get(head, ("", -1))[1]
    raise FormulaError(where, f"{head}() takes {due} argument{'s' * (due != 1)}, {len(arguments)} were given.")


def _power(base: sp.Expr, exponent: sp.Expr, where: str) -> sp.Expr:
    if exponent.is_Rational and abs(exponent) > _MAX_EXPONENT:
        found = f"the exponent {_shown(str(exponent))} is too large (limit {_MAX_EXPONENT})."
        raise FormulaError(where, found, "Use exp() for steep growth.")
    if base.is_Rational and exponent.is_Rational and base not in (0, 1, -1):
        digits = max(len(str(base.p)), len(str(base.q))) * abs(exponent)
        if digits > _MAX_DIGITS:
            raise FormulaError(where, f"a number of some {int(digits)} digits (limit {_MAX_DIGITS}).")
    return sp.Pow(base, exponent)


def _checked(expression: Any, text: str, where: str) -> sp.Expr:
    if not isinstance(expression, sp.Expr):
        raise FormulaError(where, f"'{_shown(text)}' is a comparison, not a number.", "Use it inside Piecewise.")
    if expression.has(sp.zoo, sp.nan, sp.oo, -sp.oo):
        raise FormulaError(where, f"'{_shown(text)}' divides by zero.")
    if expression.is_number and expression.is_real is False:
        raise FormulaError(where, f"'{_shown(text)}' = {expression} is not real.")
    return expression


def _syntax_hint(text: str) -> str:
    stripped = text.strip()
    if stripped[-1] in "+-*/^(,":
        return f"It ends with '{stripped[-1]}'."
    return "Look for two operators in a row, a missing operand or a wrong number of arguments."


def _shown(text: str, limit: int = 70) -> str:
    return text if len(text) <= limit else f"{text[: limit - 1]}…"
