"""One card for each passage: what it says, what is printed, what comes out, the verdict and what it means."""

from __future__ import annotations

import re
from typing import Final

import sympy as sp

from ulna.base import FormulaError
from ulna.report import Badge, Block, Card, Formula, Table, Text, Tone, with_decimals
from ulna.studies.paper.chain import XBAR, U, X, Y, Z
from ulna.studies.paper.compare import Comparison, Finding, number_text
from ulna.studies.paper.judge import notes
from ulna.studies.paper.notation import read_formula
from ulna.studies.paper.verdict import Judged, Shown

_DIGITS: Final = 6
_LETTERS: Final = {
    "thetaP": r"\theta_P",
    "dthetaP": r"\dot{\theta}_P",
    "ddthetaP": r"\ddot{\theta}_P",
    "dtheta": r"\dot{\theta}",
    "ddtheta": r"\ddot{\theta}",
    "dia": r"\frac{d i_a}{dt}",
    **{name: f"{name[0]}_{name[1]}" for name in ("ia", "Ra", "La", "Km", "km", "kb", "kp")},
}
_NAMES: Final = {sp.Symbol(name, real=True): latex for name, latex in _LETTERS.items()}
_TONES: Final = {
    Finding.STATEMENT: Tone.PLAIN,
    Finding.AGREES: Tone.GOOD,
    Finding.ROUNDING: Tone.MILD,
    Finding.MISPRINT: Tone.BAD,
}
_LONG: Final = 90
_WIDE: Final = 150
_EXACTLY: Final = "comes out exactly"
_COORDINATES: Final = {*X, *Z, *XBAR, Y, U}
# A name of the paper inside a sentence: one of the letters above, or products of letters with an index (f1*h1), or R.
_NAME: Final = re.compile(r"\b(?:" + "|".join(_LETTERS) + r"|[a-zA-Z]\d(?:\*[a-zA-Z]\d)*|R)\b")


def passage_card(judged: Judged) -> Card:
    """Return the card of one passage."""
    passage = judged.passage
    blocks: list[Block] = [Text(text=passage.says), *_as_printed(passage.latex)]
    found = [c for c in judged.comparisons if c.finding in (Finding.ROUNDING, Finding.MISPRINT)]
    shown = [s for s in judged.shown if found or has_fractions(s.value)]
    blocks += [formula for s in shown for formula in _exactly(s)]
    listed = [c for c in found if printed_text(c) and exact_text(c.exact)]
    if listed:
        blocks.append(comparison_table(listed))
    blocks += [Text(text=f"{plain_words(c.meaning)}.") for c in found if c not in listed]
    blocks += [Text(text=words) for words in _words(judged)]
    return Card(
        anchor=anchor(judged), label=passage.label, title=passage.title, badges=(badge(judged),), blocks=tuple(blocks)
    )


def anchor(judged: Judged) -> str:
    """The name by which the card is linked."""
    return f"passage-{judged.passage.key.replace('_', '-')}"


def badge(judged: Judged) -> Badge:
    """The verdict; a misprint that only follows from an earlier one says so."""
    if judged.finding is Finding.MISPRINT and not judged.own_misprints:
        return Badge(text="misprint, copied", tone=Tone.BAD)
    return finding_badge(judged.finding)


def finding_badge(finding: Finding) -> Badge:
    """A verdict as a badge."""
    return Badge(text=finding.value, tone=_TONES[finding])


def comparison_table(comparisons: list[Comparison]) -> Table:
    """What differs, line by line: printed against exact."""
    rows = tuple(
        (
            place_text(c.place),
            printed_text(c),
            exact_text(c.exact),
            Badge(text="copied", tone=Tone.BAD) if c.copied else finding_badge(c.finding),
            plain_words(c.meaning),
        )
        for c in comparisons
    )
    return Table(head=("where", "printed", "exactly", "verdict", "what it is"), rows=rows)


def place_text(place: str) -> str:
    """A place for reading: terms in it as formulas."""
    return ", ".join(_part(part) for part in place.split(", ")) if place else ""


def is_number(value: sp.Expr | sp.MatrixBase | None) -> bool:
    """Whether a comparison is one of numbers."""
    return value is not None and not isinstance(value, sp.MatrixBase) and bool(value.is_number)


def exact_text(value: sp.Expr | sp.MatrixBase | None) -> str:
    """A number or a short expression between dollar signs; nothing for what is too long for a table."""
    if value is None or isinstance(value, sp.MatrixBase):
        return ""
    if value.is_number:
        return f"${number_text(value)}$"
    latex = decimals(value) if value.free_symbols <= _COORDINATES else to_latex(value)
    return f"${latex}$" if len(latex) <= _LONG else ""


def to_latex(value: sp.Expr | sp.MatrixBase) -> str:
    """LaTeX in the paper's letters."""
    return sp.latex(value, full_prec=False, mul_symbol=None, symbol_names=_NAMES, imaginary_unit="j")


def decimals(value: sp.Expr) -> str:
    """LaTeX with decimals in place of fractions."""
    return number_text(value) if is_number(value) else to_latex(with_decimals(value, _DIGITS))


def plain_words(meaning: str) -> str:
    """What a comparison says, for reading: names as formulas, without the exact value, which has a place of its own."""
    words = meaning.split(" exactly; ", 1)[-1]
    words = re.sub(r"(?<![\w.])-(?=\d)", "−", words)
    return _capital(_NAME.sub(lambda found: f"${to_latex(read_formula(found[0]))}$", words))


def _as_printed(latex: str) -> list[Block]:
    """The formula as printed; a list of equations as running text, which can be broken into lines."""
    if r", \;" not in latex:
        return [Formula(latex=part, caption="printed") for part in latex.split(r" \quad \text{or} \quad ")]
    parts = [part.strip() for part in latex.split(r", \;")]
    return [Text(text="Printed: " + ", ".join(f"${part}$" for part in parts))]


def _exactly(shown: Shown) -> list[Formula]:
    """What comes out: exactly, and in decimals beside or below it where there are fractions."""
    value = shown.value
    if isinstance(value, sp.MatrixBase) and value.shape == (1, 1):
        value = value[0, 0]
    exact, decimal = to_latex(value), to_latex(with_decimals(value, _DIGITS))
    name = ""
    if shown.name:
        name = f"{shown.name} = " if len(shown.name) <= 2 else rf"\text{{{shown.name.replace('_', ' ')}}} = "
    if exact == decimal or not has_fractions(value):
        return [Formula(latex=f"{name}{exact}", caption=_EXACTLY)]
    if len(exact) <= _WIDE:
        return [Formula(latex=rf"{name}{exact} \approx {decimal}", caption=_EXACTLY)]
    return [
        Formula(latex=f"{name}{exact}", caption=_EXACTLY),
        Formula(latex=rf"{name}{decimal}", caption="in decimals"),
    ]


def has_fractions(value: sp.Expr | sp.MatrixBase) -> bool:
    """Whether there are fractions in a result whose only letters are the paper's coordinates."""
    return value.free_symbols <= _COORDINATES and any(not number.is_Integer for number in value.atoms(sp.Rational))


def _words(judged: Judged) -> list[str]:
    """What the verdict means, and what was checked of a statement."""
    note = notes()["passage"].get(judged.passage.key, "")
    checked = [c.meaning for c in judged.comparisons if c.finding is Finding.STATEMENT and c.meaning]
    return [note] * bool(note) + [f"{_capital(words)}." for words in dict.fromkeys(checked)]


def printed_text(comparison: Comparison) -> str:
    """What is printed, as a formula; nothing for what is too long for a table."""
    text = comparison.printed
    if re.fullmatch(r"-?[\d.]+", text):
        return f"${text}$"
    try:
        latex = to_latex(read_formula(text))
    except FormulaError:
        return text
    return f"${latex}$" if len(latex) <= _LONG else ""


def _part(part: str) -> str:
    head, _, inner = part.rpartition(" of ")
    if head:
        return f"{head} of {_part(inner)}"
    if not re.search(r"[\d*(]", part) or " " in part or re.fullmatch(r"\(\d+\)", part):
        return part.replace("_", " ")
    try:
        return f"${to_latex(read_formula(part))}$"
    except FormulaError:
        return part


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]
