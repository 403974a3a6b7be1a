"""The report on the paper as a document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ulna.report import Badge, Block, Document, Fold, Formula, Link, Picture, Row, Section, Table, Text, Tone
from ulna.studies.paper.cards import (
    anchor,
    badge,
    decimals,
    exact_text,
    finding_badge,
    is_number,
    passage_card,
    place_text,
    plain_words,
    printed_text,
    to_latex,
)
from ulna.studies.paper.compare import Finding
from ulna.studies.paper.consequences import consequence_blocks, degrees, loop_table, passive_blocks, rest_table
from ulna.studies.paper.convergence import Convergence, convergence_blocks
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.judge import JudgedClaim, count, notes
from ulna.studies.paper.passive import Passive
from ulna.studies.paper.printed import Paper
from ulna.studies.paper.runs import Cause, Loop
from ulna.studies.paper.verdict import Judged
from ulna.system import Equilibria

_SECTIONS = {
    "2": "2  Mathematical modelling",
    "3": "3  Nonlinear control",
    "4": "4  State feedback",
    "5": "5  Observer form",
    "6": "6  Compensator",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """Everything the report tells."""

    paper: Paper
    exact: Exact
    judged: tuple[Judged, ...]
    claims: tuple[JudgedClaim, ...]
    loops: tuple[Loop, ...]
    convergence: Convergence
    causes: tuple[Cause, ...]
    rests: Equilibria
    passive: Passive


def document(found: Findings, pictures: Mapping[str, str], live: Mapping[str, tuple[Block, ...]]) -> Document:
    """Return the report; `pictures` holds every figure as SVG text by name, `live` the pages to drive by hand."""
    counts = count(found.judged)
    printed = next(loop for loop in found.loops if loop.key == "compensator_printed")
    names = {Finding.AGREES: "agree", Finding.ROUNDING: "carry a rounding", Finding.MISPRINT: "hold a misprint"}
    tones = {Finding.AGREES: Tone.GOOD, Finding.ROUNDING: Tone.MILD, Finding.MISPRINT: Tone.BAD}
    return Document(
        title="The paper, equation by equation",
        lead=f"{found.paper.title} ({found.paper.citation}): every numbered equation recomputed from the plant, "
        "exactly, compared with what is printed, and the printed controller run beside the exact one.",
        facts=(
            *((str(counts[finding]), f"equations {words}", tones[finding]) for finding, words in names.items()),
            (str(counts[Finding.STATEMENT]), "definitions and laws hold", Tone.PLAIN),
            (degrees(printed.steady_error_degrees), "off target, as printed", Tone.BAD),
        ),
        sections=(
            Section(anchor="short", title="In short", blocks=_in_short(found)),
            Section(anchor="live", title="Drive it by hand", blocks=_live(live["loop"])),
            Section(anchor="misprints", title="The misprints", blocks=_misprints(found.judged)),
            Section(
                anchor="consequences",
                title="What the printed controller does",
                blocks=consequence_blocks(found.loops, found.causes, pictures),
            ),
            Section(anchor="convergence", title="Does it converge?", blocks=convergence_blocks(found.convergence)),
            Section(
                anchor="uncontrolled",
                title="The arm without voltage",
                blocks=(*_uncontrolled(found, pictures), *live["free"]),
            ),
            Section(anchor="forearm", title="The passive forearm", blocks=passive_blocks(found.passive, pictures)),
            Section(anchor="schematics", title="Figures 1 to 3", blocks=_schematics(found.paper, pictures)),
            Section(anchor="claims", title="Claims in the text", blocks=_claims(found.claims)),
            *_equations(found.judged),
            Section(anchor="method", title="How this was made", blocks=_method()),
        ),
    )


def _in_short(found: Findings) -> tuple[Block, ...]:
    exact = found.exact
    poles = ", ".join(f"${to_latex(pole)}$" for pole in exact.choices.controller_poles)
    observer = ", ".join(f"${to_latex(pole)}$" for pole in exact.choices.observer_poles)
    printed = next(loop for loop in found.loops if loop.key == "compensator_printed")
    feedback = next(loop for loop in found.loops if loop.key == "state_feedback_printed")
    worst = max(found.causes, key=lambda cause: abs(cause.alone))
    law = exact.named(exact.law.expressions)[0]
    return (
        Text(
            text="The method of the paper is sound: done exactly, it gives a law and an estimator that bring the arm "
            f"to the horizontal from every initial angle tried, with the poles {poles} of the loop and {observer} of "
            "the estimate, the ones the paper asks for."
        ),
        Formula(latex=f"u = {decimals(law)}", caption="the law, exactly (printed as (32) and (54))"),
        Text(
            text="The numbers that are printed do not. With the law as printed and the true states the arm rests at "
            f"{degrees(feedback.steady_error_degrees)}; with the printed estimator as well, at "
            f"{degrees(printed.steady_error_degrees)}, whatever the initial angle. The largest single cause is no "
            f"misprint but a rounding: {place_text(worst.deviation.place)}, printed "
            f"${decimals(worst.deviation.printed)}$ for "
            f"${decimals(worst.deviation.exact)}$, is worth {degrees(worst.alone)} by itself."
        ),
        loop_table(found.loops),
    )


def _live(blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    told = (
        "The loop of Figures 5 to 7 from its three initial angles, and beside it the one as printed: push an arm, take "
        "its load away, start it elsewhere. The arm of Figure 4, without voltage, stands further below."
    )
    return (Text(text=told), *blocks)


def _misprints(judged: Sequence[Judged]) -> tuple[Block, ...]:
    """Every misprint that is not merely copied from an earlier one, those in numbers first."""
    found = [(entry, c) for entry in judged for c in entry.own_misprints]
    numbers = [pair for pair in found if is_number(pair[1].exact)]
    others = [pair for pair in found if not is_number(pair[1].exact)]
    return (
        Text(text="Without those that only copy an earlier one; they are marked in the sections below."),
        Table(
            head=("equation", "where", "printed", "exactly", "what it is"),
            rows=tuple(
                (_link(e), place_text(c.place), printed_text(c), exact_text(c.exact), plain_words(c.meaning))
                for e, c in numbers
            ),
            caption="In numbers",
        ),
        Table(
            head=("equation", "what it is"),
            rows=tuple((_link(e), plain_words(c.meaning)) for e, c in others),
            caption="In names and formulas",
        ),
    )


def _link(judged: Judged) -> Link:
    return Link(text=judged.passage.label, anchor=anchor(judged))


def _uncontrolled(found: Findings, pictures: Mapping[str, str]) -> tuple[Block, ...]:
    return (
        Text(
            text="Without voltage the arm has an equilibrium at every odd multiple of a quarter turn. Those within one "
            "turn either way were found, and interval arithmetic proves that there are no others there."
        ),
        rest_table(found.rests),
        _picture(
            found.paper, 4, pictures, "Three curves of the link angle over ten seconds, each ending at a quarter turn."
        ),
    )


def _schematics(paper: Paper, pictures: Mapping[str, str]) -> tuple[Block, ...]:
    return (
        Row(
            blocks=(
                _picture(paper, 1, pictures, "A forearm with biceps, triceps and a load at the hand."),
                _picture(paper, 2, pictures, "An arm driven by a motor through a gear."),
            )
        ),
        _picture(paper, 3, pictures, "The armature circuit: voltage, resistance, inductance, motor."),
    )


def _picture(paper: Paper, number: int, pictures: Mapping[str, str], description: str) -> Picture:
    figure = next(f for f in paper.figures if f.number == number)
    return Picture(
        svg=pictures[f"figure-{number}"],
        caption=f"Figure {number}, redrawn. {figure.caption}. {notes()['figure'].get(str(number), '')}",
        description=description,
    )


def _claims(claims: Sequence[JudgedClaim]) -> tuple[Block, ...]:
    """Those that do not hold, and all of them folded."""
    wrong = [claim for claim in claims if claim.holds is False]
    table = Fold(title=f"All {len(claims)}", blocks=(_claim_table(claims),))
    return (_claim_table(wrong), table) if wrong else (table,)


def _claim_table(claims: Sequence[JudgedClaim]) -> Table:
    words = {True: Badge(text="holds", tone=Tone.GOOD), False: Badge(text="does not hold", tone=Tone.BAD)}
    rows = tuple(
        (
            f"“{c.claim.text}”",
            words[c.holds] if c.holds is not None else Badge(text="not about this plant"),
            c.meaning,
        )
        for c in claims
    )
    return Table(head=("the paper says", "verdict", "why"), rows=rows)


def _equations(judged: Sequence[Judged]) -> list[Section]:
    return [_section(key, [entry for entry in judged if entry.passage.section == key]) for key in _SECTIONS]


def _section(key: str, judged: Sequence[Judged]) -> Section:
    """What differs from the print stands open; what holds as it is printed is folded."""
    different = [entry for entry in judged if entry.finding in (Finding.MISPRINT, Finding.ROUNDING)]
    same = [entry for entry in judged if entry not in different]
    blocks: list[Block] = [Fold(title="Overview of this section", blocks=(_overview(judged),))]
    blocks += [passage_card(entry) for entry in different]
    if same:
        title = f"{len(same)} {'hold' if len(same) > 1 else 'holds'} as printed"
        blocks.append(Fold(title=title, blocks=tuple(passage_card(entry) for entry in same)))
    return Section(anchor=f"section-{key}", title=_SECTIONS[key], blocks=tuple(blocks))


def _overview(judged: Sequence[Judged]) -> Table:
    rows = tuple((_link(e), e.passage.title, badge(e)) for e in judged)
    return Table(head=("equation", "what it is", "verdict"), rows=rows)


def _method() -> tuple[Block, ...]:
    return (
        Text(
            text="Exact values come from the plant alone, in rational arithmetic: the brackets, the transformation, "
            "the law, the observer. Printed ones come from a data file that holds the paper's formulas digit by digit."
        ),
        Table(
            head=("verdict", "rule"),
            rows=(
                (
                    finding_badge(Finding.AGREES),
                    "The exact value rounded to the printed digits is the printed value; or the formulas are the same.",
                ),
                (
                    finding_badge(Finding.ROUNDING),
                    "It comes out of the paper's own rounded numbers, or digits were cut off instead of rounded.",
                ),
                (finding_badge(Finding.MISPRINT), "Neither. “Copied” where it follows from an earlier misprint."),
                (
                    finding_badge(Finding.STATEMENT),
                    "A definition or a general law; it holds, evaluated on the arm or for arbitrary functions.",
                ),
            ),
        ),
        Text(
            text="Angles are in radians, counted upward in (1) to (12) and downward from (13) on; everything is in "
            "SI units.",
            quiet=True,
        ),
    )
