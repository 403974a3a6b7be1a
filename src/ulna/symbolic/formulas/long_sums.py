"""Long sums and products in parentheses of a few parts each: SymEngine's parser adds one term at a time to a copy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

_FEW = 64
_GROUPS = 8

_SUM, _PRODUCT = ("+", "-"), ("*", "/")
_JOINING = {",": "", "|": "Or", "&": "And", "==": "Eq", "!=": "Ne"}
"""What separates conditions, loosest first, and the function that stands for it."""
_BETWEEN = (*_JOINING, "<", ">", "<=", ">=")


def grouped(words: Iterable[str]) -> str:
    """The words of a formula as text of the same meaning, without a sum or product of more than a few parts."""
    levels: list[_Level] = [_Level()]
    before = ""
    for word in words:
        operand = before not in ("", "(", *_BETWEEN, *_SUM, *_PRODUCT, "**", "^")
        if word == "(":
            levels.append(_Level())
        elif word == ")":
            inner = levels.pop().text()
            levels[-1].add(f"( {inner} )")
        elif word in _SUM and operand:
            levels[-1].next_term(word)
        elif word in _PRODUCT:
            levels[-1].next_factor(word)
        elif word in _BETWEEN:
            levels[-1].next_part(word)
        else:
            levels[-1].add(word)
        before = word
    return levels[0].text()


class _Level:
    """What stands between two parentheses, while it is read."""

    def __init__(self) -> None:
        self._done: list[str] = []
        self._terms: list[tuple[str, str]] = []
        self._factors: list[tuple[str, list[str]]] = [("", [])]
        self._sign = ""

    def add(self, word: str) -> None:
        self._factors[-1][1].append(word)

    def next_factor(self, sign: str) -> None:
        self._factors.append((sign, []))

    def next_term(self, sign: str) -> None:
        factors = [(before, " ".join(words)) for before, words in self._factors]
        self._terms.append((self._sign, _joined(factors, first="1", between="*")))
        self._factors, self._sign = [("", [])], sign

    def next_part(self, sign: str) -> None:
        self.next_term("")
        self._done += [_joined(self._terms, first="", between="+"), sign]
        self._terms = []

    def text(self) -> str:
        self.next_part("")
        return _conditions(self._done[:-1])


def _conditions(words: Sequence[str]) -> str:
    """Parts and the signs between them, And(a, b) for a & b: the parser dies of such a sign between numbers."""
    for sign, function in _JOINING.items():
        cuts = [-1, *(k for k in range(1, len(words), 2) if words[k] == sign), len(words)]
        if len(cuts) > 2:
            joined = ", ".join(_conditions(words[a + 1 : b]) for a, b in pairwise(cuts))
            return f"{function}({joined})" if function else joined
    return " ".join(words)


def _joined(parts: Sequence[tuple[str, str]], *, first: str, between: str) -> str:
    """Parts with the signs before them; a group begins with the sign of its first part, or with `first` and that."""
    if len(parts) <= _FEW:
        return " ".join(f"{sign} {text}" if sign else text for sign, text in parts)
    size = -(-len(parts) // _GROUPS)
    groups = []
    for start in range(0, len(parts), size):
        group = parts[start : start + size]
        begin = first if group[0][0] and size <= _FEW else ""
        groups.append(f"( {begin} {_joined(group, first=first, between=between)} )")
    return f" {between} ".join(groups)
