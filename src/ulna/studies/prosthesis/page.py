"""The report on the comparison as a document."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

from ulna.plants import hold, torque_margin
from ulna.report import Badge, Block, Cell, Document, Fold, Picture, Section, Table, Text, Tone, verbatim
from ulna.studies.prosthesis.baselines import VISUAL_DELAY
from ulna.studies.prosthesis.comparison import Comparison
from ulna.studies.prosthesis.hardware import NOISE
from ulna.studies.prosthesis.plant import Bench
from ulna.studies.prosthesis.verdict import SHARE, advice_text, recommendation, standings

COLUMNS: tuple[tuple[str, str, str], ...] = (
    ("reach", "settling", "reach: settling (s)"),
    ("reach", "overshoot", "overshoot (%)"),
    ("hold", "steady_error", "hold: steady error (°)"),
    ("hold", "ripple", "tremor ripple (°)"),
    ("follow", "rms_error", "follow: RMS error (°)"),
    ("pick_up", "peak_error", "pick up: peak error (°)"),
    ("drop", "peak_error", "drop: peak (°)"),
    ("push", "peak_error", "push: peak (°)"),
)
"""Task, measure and heading of the table of precision."""

EFFORTS: tuple[tuple[str, str, str], ...] = (
    ("reach", "rise", "reach: rise (s)"),
    ("reach", "energy", "energy (J)"),
    ("reach", "peak_current", "peak current (A)"),
    ("reach", "limited", "limited (%)"),
    ("hold", "rms_current", "hold: RMS current (A)"),
    ("hold", "power", "power (W)"),
    ("hold", "power_with_brake", "power with brake (W)"),
    ("hold", "warming", "winding after 10 s (K)"),
    ("hold", "chatter", "chatter (V)"),
)
"""Task, measure and heading of the table of effort."""

NAMED = 3
"""Leaders of a measure up to which they are named."""

_PICTURES = {
    "reach": "The reach, the follow-up and the hold: angle wanted and reached, and the motor's current.",
    "follow": "A curve through six points.",
    "pick_up": "A load taken up after one second by the held arm.",
    "push": "A push at the held arm.",
}


def document(
    found: Sequence[Comparison], pictures: Mapping[str, str], muscles: str, live: Mapping[str, tuple[Block, ...]]
) -> Document:
    """Return the report; `pictures` holds every figure as SVG text by name, `live` the page to drive of each arm."""
    plants = found[0].count
    alone, shared, races = _tally(found)
    return Document(
        title="A prosthesis one could build",
        lead="Seven controllers, from proportional voltage to a load-robust compensator, on the same arms with the "
        "same noise at the same tasks: which one to build, which not. Every number comes from the runs of this page.",
        facts=(
            (str(len(found)), "arms" if len(found) > 1 else "arm", Tone.PLAIN),
            (str(plants), "plants for each arm, task and controller", Tone.PLAIN),
            (
                f"{alone} of {races}",
                f"measures led by designs of the paper or this package, {shared} shared within 5 %, the rest by others",
                Tone.PLAIN,
            ),
        ),
        sections=(
            Section(anchor="short", title="In short", blocks=_short(found)),
            *(_arm_section(each, pictures, live[each.bench.preset.name]) for each in found),
            Section(
                anchor="muscles", title="From muscle to motion", blocks=_muscles(pictures, muscles, live["muscles"])
            ),
            Section(anchor="method", title="How this was made", blocks=_method(found[0])),
        ),
    )


def _short(found: Sequence[Comparison]) -> tuple[Block, ...]:
    arms = tuple(_plain(each.bench.preset.name) for each in found)
    return (
        *(Text(text=f"{arm.capitalize()}. {recommendation(each)}") for arm, each in zip(arms, found, strict=True)),
        Table(
            head=("controller", *arms),
            rows=_standing_rows(found),
            caption="RMS error over the least of each task, geometric mean over the six tasks, of what 95 of 100 "
            "plants stay below. ✓ best, ✗ lost (RMS error above 10°) at a task.",
            numeric=frozenset(range(1, len(found) + 1)),
        ),
        Table(
            head=("measure", *arms),
            rows=_leader_rows(found),
            caption="Who has the least of each measure, and its value, by what 95 of 100 plants stay below; all within "
            "5 % of the best are named, or counted where they are many. ✓ only designs of the paper or this package; "
            "the others are common practice, "
            "tuned on the same cost by the same search.",
        ),
    )


def _standing_rows(found: Sequence[Comparison]) -> tuple[tuple[Cell, ...], ...]:
    tables = [{s.contender.key: s for s in standings(each)} for each in found]
    first = [standings(each)[0].contender.key for each in found]
    rows = []
    for contender in found[0].contenders:
        cells: list[Cell] = [contender.title]
        for table, best in zip(tables, first, strict=True):
            standing = table[contender.key]
            text = _number(standing.score)
            if standing.lost:
                cells.append(Badge(text=text, tone=Tone.BAD))
            else:
                cells.append(Badge(text=text, tone=Tone.GOOD) if best == contender.key else text)
        rows.append(tuple(cells))
    return tuple(rows)


def _leader_rows(found: Sequence[Comparison]) -> tuple[tuple[Cell, ...], ...]:
    rows = []
    for task, measure, heading in (*COLUMNS, *EFFORTS):
        cells: list[Cell] = [f"{_plain(task)}: {heading.split(': ')[-1]}"]
        for each in found:
            leaders = each.leaders(task, measure, SHARE)
            if not leaders:
                cells.append("nobody")
                continue
            value = each.entries[leaders[0].key, task].quantile(measure, SHARE)
            names = ", ".join(c.title for c in leaders) if len(leaders) <= NAMED else f"{len(leaders)} controllers"
            # Plain text: a badge would not break into lines.
            cells.append(f"{'✓ ' if all(c.proposed for c in leaders) else ''}{names} {_number(value)}")
        rows.append(tuple(cells))
    return tuple(rows)


def _plain(name: str) -> str:
    return name.replace("_", " ")


def each_title(found: Comparison, task: str) -> str:
    """The task's title on this bench."""
    return next(t.title for t in found.tasks if t.key == task)


def _arm_section(found: Comparison, pictures: Mapping[str, str], live: tuple[Block, ...]) -> Section:
    bench, name = found.bench, found.bench.preset.name
    held, margin = hold(bench.preset), torque_margin(bench.preset)
    available = "no limit is known" if math.isinf(margin.available) else f"{margin.available:.3g} N m are there"
    blocks: list[Block] = [
        Text(
            text=f"{bench.preset.text} ({bench.preset.source}). Holding its load horizontally takes {held.torque:.3g} "
            f"N m, "
            f"{held.current:.3g} A, {held.voltage:.3g} V, {held.power:.3g} W; {available}. La/Ra is "
            f"{1e3 * bench.electrical_time:.3g} ms against a sample of 1 ms. {_pick_up_note(bench)}"
        ),
        Text(text=advice_text(bench.preset)),
        Text(
            text="Every controller as tuned, side by side on the nominal arm: move the angle wanted, push an arm, "
            "hand it a load."
        ),
        *live,
        _table(
            found,
            COLUMNS,
            "How exact: nominal / 95 of 100 plants. ✓ lowest 95 % value, ✗ lost (RMS error above 10°), – never.",
        ),
        _table(
            found,
            EFFORTS,
            "At what effort: nominal / 95 of 100 plants. ✓ lowest 95 % value, ✗ lost (RMS error above 10°), – never.",
        ),
        Picture(
            svg=pictures[f"{name}-spread"],
            caption="RMS error: ring, the nominal plant; bar, from the median to 95 of 100 plants.",
            description="For each task a row of bars, one for each controller, on a logarithmic scale.",
        ),
    ]
    blocks += [
        Fold(
            title=f"{each_title(found, key)}: curves",
            blocks=(
                Picture(
                    svg=pictures[f"{name}-{key}"],
                    caption=f"{caption} Nominal plant; errors are cut at 2°.",
                    description="Curves of angle and current over time, one for each controller.",
                ),
            ),
        )
        for key, caption in _PICTURES.items()
    ]
    blocks.append(Fold(title="Tuned numbers", blocks=(_tuned_table(found),)))
    return Section(anchor=name, title=name.replace("_", " "), blocks=tuple(blocks))


def _pick_up_note(bench: Bench) -> str:
    if bench.extra_load == 1.0:
        return "1 kg is picked up."
    return (
        f"1 kg is more than the weakest drive of the draws could lift with a fifth to spare, so {bench.extra_load:g} "
        f"kg is "
        "picked up."
    )


def _table(found: Comparison, columns: Sequence[tuple[str, str, str]], caption: str) -> Table:
    best = {(task, measure): found.best(task, measure, 0.95) for task, measure, _ in columns}
    rows = []
    for contender in found.contenders:
        cells: list[Cell] = [contender.title]
        for task, measure, _ in columns:
            entry = found.entries[contender.key, task]
            text = f"{_number(entry.nominal_value(measure))} / {_number(entry.quantile(measure, 0.95))}"
            if entry.lost(0.95):
                cells.append(Badge(text=text, tone=Tone.BAD))
            else:
                cells.append(Badge(text=text, tone=Tone.GOOD) if best[task, measure] is contender else text)
        rows.append(tuple(cells))
    return Table(
        head=("controller", *(heading for *_, heading in columns)),
        rows=tuple(rows),
        caption=caption,
        numeric=frozenset(range(1, len(columns) + 1)),
    )


def _tuned_table(found: Comparison) -> Table:
    rows = tuple(
        (
            c.title,
            ", ".join(
                f"{name} = {value:.4g}" if abs(value) < 1e4 else f"{name} = {value:.0f}"
                for name, value in found.chosen[c.key].items()
            ),
            c.note,
        )
        for c in found.contenders
    )
    return Table(head=("controller", "numbers", "what it is"), rows=rows)


def _muscles(pictures: Mapping[str, str], said: str, live: tuple[Block, ...]) -> tuple[Block, ...]:
    return (
        Text(
            text="Two muscles, flexor and extensor: band-pass, notch, rectified, envelope, normalised, dead band, "
            "then a "
            "speed in proportion to their difference, held inside the range of motion; the load-robust compensator "
            "follows."
        ),
        Text(text=f"Read: {verbatim(said)}."),
        Picture(
            svg=pictures["muscles"],
            caption="Muscle signals, activations, and the angle wanted (dashed) and reached.",
            description="Three panels of curves over time.",
        ),
        Text(text="Hold the muscles yourself: two sliders, or the keys F and E, make the signals, noise and all."),
        *live,
    )


def _method(found: Comparison) -> tuple[Block, ...]:
    return (
        Text(
            text="Every controller runs once a millisecond on the encoder's angle with noise of "
            f"{NOISE:g} codes; its voltage acts one sample later, limited by supply, battery and peak current. The "
            "paper's state feedback alone also measures speed and current. The plant is the third-order arm with its "
            "drive in Runge-Kutta steps; the gear driven back has an efficiency of its own; the winding's resistance "
            "stays what it is during a run."
        ),
        Text(
            text=f"Proportional voltage and the velocity servo are driven by a person who sees the error "
            f"{VISUAL_DELAY:g} s late and knows the wanted speed and the nominal load by heart. Every controller "
            "starts from the nominal arm at rest; the plants differ from it: load 0.5 to 1.5 of the nominal one, "
            "resistance ±20 %, efficiency 0.85 to 1 of its value, Coulomb friction up to 5 % of the gravity moment."
        ),
        Text(
            text="Tuning: the same search on the same cost for all, RMS error + 10 · ripple + 10 · chatter over the "
            "supply, on plants that the comparison does not use; the numbers are data with the command that renews "
            "them. Where a number is a choice and not measured, the data file of the arms says so. A load is taken up "
            "at the hand's own speed."
        ),
        Table(
            head=("task", "what happens"), rows=tuple((task.key.replace("_", " "), task.title) for task in found.tasks)
        ),
    )


def _tally(found: Sequence[Comparison]) -> tuple[int, int, int]:
    """Measures led by proposed designs alone, by both kinds within `EQUAL`, and all that anybody leads."""
    led = [each.leaders(task, measure, SHARE) for each in found for task, measure, _ in (*COLUMNS, *EFFORTS)]
    decided = [{c.proposed for c in leaders} for leaders in led if leaders]
    return sum(kinds == {True} for kinds in decided), sum(len(kinds) == 2 for kinds in decided), len(decided)


def _number(value: float) -> str:
    """Three digits; a dash where it never happens or does not apply."""
    if not math.isfinite(value):
        return "–"
    for bound, digits in pairwise((math.inf, 100.0, 10.0, 1.0, 0.0)):
        if digits <= abs(value) < bound:
            places = {100.0: 0, 10.0: 1, 1.0: 2, 0.0: 3}[digits]
            return f"{value:.{places}f}".replace("-", "−")
    return f"{value:.3g}"
