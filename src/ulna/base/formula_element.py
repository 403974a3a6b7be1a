"""Formulas for a page without network: LaTeX in, MathML out, which every current browser sets by itself.

Covered is the LaTeX that SymPy prints and that printed formulas need: fractions, roots, scripts, accents, matrices,
functions, Greek, the usual signs. Anything else is refused by name rather than set wrongly.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from html import escape
from typing import Final

from ulna.base.errors import FormulaError
from ulna.base.letters import ACCENTS, BRACKETS, DOUBLE_STRUCK, FUNCTIONS, LETTERS, MATRICES, SIGNS, SPACES

_WORD: Final = re.compile(r"\\[a-zA-Z]+|\\.|\d+(?:\.\d+)?|\s+|.")
_STOPS: Final = frozenset({"}", r"\right", r"\end", "&", r"\\"})
_SIGNED: Final = frozenset({"-", "+", r"\pm", r"\mp"})
_ALIGNED: Final = (' style="text-align: right; padding-right: 0"', ' style="text-align: left; padding-left: 0.2em"')
_THIN: Final = '<mspace width="0.167em"></mspace>'


@dataclass(slots=True)
class _Reader:
    """The words of one formula and how far they are read."""

    source: str
    words: list[str]
    at: int = 0

    def peek(self) -> str:
        return self.words[self.at] if self.at < len(self.words) else ""

    def take(self) -> str:
        word = self.peek()
        if not word:
            raise self.refuse("it ends too early.")
        self.at += 1
        return word

    def expect(self, word: str) -> None:
        found = self.peek()
        if found != word:
            raise self.refuse(f"'{word}' is missing before '{found}'." if found else f"'{word}' is missing at its end.")
        self.at += 1

    def skip_spaces(self) -> None:
        while self.peek().isspace():
            self.at += 1

    def refuse(self, found: str) -> FormulaError:
        return FormulaError(f"the formula '{self.source}' on a page", found)


def mathml(formula: str, *, display: bool = False) -> str:
    """Return the formula as one `<math>` element.

    Args:
        formula: LaTeX without dollar signs.
        display: set as a line of its own, not in running text.

    Raises:
        FormulaError: a command, environment or bracket that is not covered, by name.
    """
    reader = _Reader(source=formula, words=_WORD.findall(formula))
    body = _row(reader, frozenset())
    if reader.peek():
        raise reader.refuse(f"'{reader.peek()}' ends what was not begun.")
    block = ' display="block"' if display else ""
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML"{block}>{body}</math>'


def _row(reader: _Reader, ends: frozenset[str]) -> str:
    """Everything up to one of `ends`, which stays unread, as one row."""
    parts: list[str] = []
    while reader.peek() and reader.peek() not in ends and reader.peek() not in _STOPS:
        word = reader.peek()
        if word.isspace():
            reader.at += 1
            continue
        first = not parts or parts[-1].startswith("<mo>")
        if word[1:] in FUNCTIONS and not first:
            parts.append(_THIN)
        part = _with_scripts(reader, _atom(reader))
        parts.append(part.replace("<mo>", '<mo form="prefix">', 1) if first and word in _SIGNED else part)
        if word[1:] in FUNCTIONS:
            parts.append(_space_after_function(reader))
    return parts[0] if len(parts) == 1 else f"<mrow>{''.join(parts)}</mrow>"


def _space_after_function(reader: _Reader) -> str:
    """A thin space between a function and an argument without brackets: sin x, but sin(x)."""
    reader.skip_spaces()
    ahead = "".join(reader.words[reader.at : reader.at + 2])
    bracket = ahead.startswith((r"\left", "(", r"{\left", "{("))
    return "<mo>&#8289;</mo>" if bracket else _THIN


def _with_scripts(reader: _Reader, base: str) -> str:
    """The base with the sub- and superscript that follow it."""
    below = above = ""
    while True:
        reader.skip_spaces()
        if reader.peek() == "_" and not below:
            reader.at += 1
            below = _argument(reader)
        elif reader.peek() == "^" and not above:
            reader.at += 1
            above = _argument(reader)
        elif reader.peek() == "'" and not above:
            primes = 0
            while reader.peek() == "'":
                reader.at += 1
                primes += 1
            above = f"<mo>{'′' * primes}</mo>"
        else:
            break
    if below and above:
        return f"<msubsup>{base}{below}{above}</msubsup>"
    if below:
        return f"<msub>{base}{below}</msub>"
    return f"<msup>{base}{above}</msup>" if above else base


def _argument(reader: _Reader) -> str:
    """One group in braces, or one atom."""
    reader.skip_spaces()
    if reader.peek() != "{":
        return _atom(reader)
    reader.at += 1
    inner = _row(reader, frozenset())
    reader.expect("}")
    return inner


def _atom(reader: _Reader) -> str:
    word = reader.take()
    if word == "{":
        reader.at -= 1
        return _argument(reader)
    if word[0].isdigit():
        return f"<mn>{word}</mn>"
    if word.startswith("\\"):
        return _command(reader, word[1:])
    if word.isalpha():
        return f"<mi>{escape(word)}</mi>"
    if word in "()[]|":
        return f'<mo stretchy="false">{word}</mo>'
    if word in "+-=<>,;:/*!.":
        return f"<mo>{'−' if word == '-' else escape(word)}</mo>"
    raise reader.refuse(f"'{word}' cannot be set.")


def _command(reader: _Reader, name: str) -> str:
    if name in LETTERS:
        return f"<mi>{LETTERS[name]}</mi>"
    if name in SIGNS:
        return f"<mo>{SIGNS[name]}</mo>"
    if name in SPACES:
        return f'<mspace width="{SPACES[name]}"></mspace>'
    if name in FUNCTIONS:
        return f"<mi>{name}</mi>"
    if name in ACCENTS:
        return f'<mover accent="true">{_argument(reader)}<mo stretchy="{_stretch(name)}">{ACCENTS[name]}</mo></mover>'
    structure = _STRUCTURES.get(name)
    if structure is None:
        raise reader.refuse(f"the command '\\{name}' is not among those that can be set.")
    return structure(reader)


def _stretch(accent: str) -> str:
    return "true" if accent == "overline" else "false"


def _fraction(reader: _Reader) -> str:
    return f"<mfrac>{_argument(reader)}{_argument(reader)}</mfrac>"


def _root(reader: _Reader) -> str:
    reader.skip_spaces()
    if reader.peek() != "[":
        return f"<msqrt>{_argument(reader)}</msqrt>"
    reader.at += 1
    degree = _row(reader, frozenset("]"))
    reader.expect("]")
    return f"<mroot>{_argument(reader)}{degree}</mroot>"


def _words(reader: _Reader) -> str:
    """The letters of a text in braces as they stand, spaces too."""
    reader.skip_spaces()
    reader.expect("{")
    words = ""
    while reader.peek() != "}":
        words += reader.take()
    reader.expect("}")
    return words


def _text(reader: _Reader) -> str:
    return f"<mtext>{escape(_words(reader)).replace(' ', '&#160;')}</mtext>"


def _upright(reader: _Reader) -> str:
    return f'<mi mathvariant="normal">{escape(_words(reader))}</mi>'


def _double_struck(reader: _Reader) -> str:
    letter = _words(reader)
    if letter not in DOUBLE_STRUCK:
        raise reader.refuse(f"'{letter}' has no double-struck form here.")
    return f"<mi>{DOUBLE_STRUCK[letter]}</mi>"


def _fence(reader: _Reader) -> str:
    """Brackets as tall as what they hold."""
    opening = _bracket(reader)
    inner = _row(reader, frozenset())
    reader.expect(r"\right")
    return _fenced(opening, inner, _bracket(reader))


def _bracket(reader: _Reader) -> str:
    reader.skip_spaces()
    word = reader.take()
    if word not in BRACKETS:
        raise reader.refuse(f"'{word}' is not a bracket.")
    return BRACKETS[word]


def _fenced(opening: str, inner: str, closing: str) -> str:
    left = f'<mo stretchy="true" form="prefix">{opening}</mo>' if opening else ""
    right = f'<mo stretchy="true" form="postfix">{closing}</mo>' if closing else ""
    return f"<mrow>{left}{inner}{right}</mrow>"


def _environment(reader: _Reader) -> str:
    kind = _words(reader)
    if kind not in MATRICES:
        raise reader.refuse(f"the environment '{kind}' is not among those that can be set.")
    rows: list[list[str]] = [[]]
    while True:
        side = "" if kind != "aligned" else _ALIGNED[len(rows[-1]) % 2]
        rows[-1].append(f"<mtd{side}>{_row(reader, frozenset())}</mtd>")
        word = reader.take()
        if word == r"\\":
            rows.append([])
        elif word == r"\end":
            break
        elif word != "&":
            raise reader.refuse(f"'{word}' ends what was not begun.")
    if _words(reader) != kind:
        raise reader.refuse(f"'\\begin{{{kind}}}' has no end of its own.")
    table = "".join(f"<mtr>{''.join(cells)}</mtr>" for cells in rows if cells != ["<mtd><mrow></mrow></mtd>"])
    style = ' displaystyle="true"' if kind == "aligned" else ""
    return _fenced(MATRICES[kind][0], f"<mtable{style}>{table}</mtable>", MATRICES[kind][1])


_STRUCTURES: Final = {
    "frac": _fraction,
    "sqrt": _root,
    "text": _text,
    "mathrm": _upright,
    "operatorname": _upright,
    "mathbb": _double_struck,
    "left": _fence,
    "begin": _environment,
}
