"""What follows from the numbers, as blocks of the report: loops, causes, equilibria, the passive forearm."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import sympy as sp

from ulna.plants import SmallOscillations
from ulna.report import Badge, Block, Picture, Row, Table, Text, Tone
from ulna.studies.paper.cards import decimals, place_text
from ulna.studies.paper.compare import number_text
from ulna.studies.paper.judge import notes
from ulna.studies.paper.passive import Passive, rest_angle
from ulna.studies.paper.runs import Cause, Loop
from ulna.system import Equilibria, linearise

_NOTHING = 1e-6


def degrees(value: float) -> str:
    """An angle in degrees for reading."""
    return "0°" if abs(value) < _NOTHING else f"{value:+.2f}°".replace("-", "−")


def loop_table(loops: Sequence[Loop]) -> Table:
    """Where each loop ends and what it costs to stay there."""
    rows = tuple(
        (
            loop.title,
            Badge(text=degrees(loop.steady_error_degrees), tone=Tone.BAD if loop.printed else Tone.GOOD),
            " / ".join(f"{run.peak_voltage:.1f}" for run in loop.runs),
            f"{loop.holding_voltage:.2f}".replace("-", "−"),
            f"{loop.holding_power:.1f}",
        )
        for loop in loops
    )
    starts = " / ".join(f"{run.angle:g}" for run in loops[0].runs).replace("-", "−")
    return Table(
        head=("loop", "steady error", "peak voltage (V)", "holding (V)", "power (W)"),
        rows=rows,
        numeric=frozenset({2, 3, 4}),
        caption=f"Peak voltage from {starts} rad. {_arrival(loops)}",
    )


def _arrival(loops: Sequence[Loop]) -> str:
    left = [run for loop in loops for run in loop.runs if not run.arrives]
    if left:
        return f"{len(left)} of the runs do not come to rest."
    return "Every run comes to rest; where does not depend on the initial angle."


def consequence_blocks(
    loops: Sequence[Loop], causes: Sequence[Cause], pictures: Mapping[str, str]
) -> tuple[Block, ...]:
    """The four loops: poles, figures 5 to 7, voltage, and which number moves the rest point."""
    return (
        Text(
            text="The printed law (32)/(54) and estimator (53) were built from their printed text and run on the "
            "exact arm, beside the exact ones."
        ),
        _figure("steady", pictures, "The end of the runs from −1 rad, in degrees.", "Angles over time, at the end."),
        _cause_table(causes),
        Text(
            text="Only what stands in the balance of torques, voltages and estimates at rest moves the rest point. "
            "Factors of the velocity, and of the error of the estimate where that is zero at rest, change the way and "
            "not the end. The errors do not simply add up: each changes the weight of the others.",
            quiet=True,
        ),
        Row(
            blocks=(
                _pole_table(loops),
                _figure("poles", pictures, "Poles of the loop with estimator, at rest.", "Poles in the complex plane."),
            )
        ),
        _figure("figure-5", pictures, f"Figure 5, redrawn. {notes()['figure']['5']}", "Link angle over time."),
        _figure("figure-6", pictures, f"Figure 6, redrawn. {notes()['figure']['6']}", "Link angle over time."),
        _figure("figure-7", pictures, f"Figure 7, redrawn. {notes()['figure']['7']}", "Estimated angle over time."),
        _figure("voltage", pictures, "The voltage of the runs of Figure 6.", "Voltage over time."),
    )


def rest_table(rests: Equilibria) -> Table:
    """Every equilibrium with its eigenvalues."""
    rows = tuple(
        (
            f"{p['theta']:+.4f}".replace("-", "−"),
            f"{math.degrees(p['theta']):+.0f}°".replace("-", "−"),
            Badge(text="stable", tone=Tone.GOOD) if near.stable else Badge(text="unstable", tone=Tone.BAD),
            _complex_list(near.eigenvalues),
        )
        for p, near in ((p, linearise(p)) for p in rests)
    )
    return Table(head=("angle (rad)", "angle", "", "eigenvalues (1/s)"), rows=rows, numeric=frozenset({0, 1}))


def passive_blocks(passive: Passive, pictures: Mapping[str, str]) -> tuple[Block, ...]:
    """Static equilibria (10), natural frequencies (12), and how far the linear equation (11) reaches."""
    chosen = tuple(
        (f"${_symbol(p.name)}$", f"{number_text(p.value or sp.nan)} {p.unit.replace('*', ' ')}", p.text, p.source)
        for p in passive.chosen
    )
    releases = tuple((f"{r.degrees:g}°", f"{r.largest_difference:.2f}°") for r in passive.releases)
    return (
        Text(text="The paper gives no numbers for the muscles. Chosen here:"),
        Table(head=("parameter", "value", "what it is", "why"), rows=chosen),
        _rest_table(
            passive.rests, "Static equilibria (10) within one turn either way, proved to be all, and (12) there."
        ),
        _rest_table(
            passive.weaker,
            f"With a biceps {passive.weaker_by} times weaker there are several (some where no elbow goes); where "
            "(12) has no real value the forearm falls away.",
        ),
        Row(
            blocks=(
                _figure(
                    "forearm", pictures, "Let go beside the equilibrium: (6) solid, (11) dashed.", "Angle over time."
                ),
                Table(
                    head=("let go at", "largest difference"),
                    rows=releases,
                    numeric=frozenset({0, 1}),
                    caption="Linear against nonlinear response.",
                ),
            )
        ),
    )


def _rest_table(found: SmallOscillations, caption: str) -> Table:
    rows = tuple(
        (
            f"{rest_angle(p):+.4f}".replace("-", "−"),
            f"{math.degrees(rest_angle(p)):+.1f}°".replace("-", "−"),
            f"{float(p.natural_frequency):.3f}" if p.swings else "none",
            f"{float(p.damping_ratio):.3f}" if p.swings else "falls away",
        )
        for p in found.points
    )
    return Table(
        head=("angle (rad)", "angle", "natural frequency (rad/s)", "damping ratio"),
        rows=rows,
        numeric=frozenset(range(4)),
        caption=caption,
    )


def _pole_table(loops: Sequence[Loop]) -> Table:
    rows = tuple((loop.title, _complex_list(loop.poles)) for loop in loops)
    return Table(head=("loop", "poles at rest (1/s)"), rows=rows)


def _cause_table(causes: Sequence[Cause]) -> Table:
    rows = tuple(
        (
            place_text(cause.deviation.place),
            f"${decimals(cause.deviation.printed)}$",
            f"${decimals(cause.deviation.exact)}$",
            degrees(cause.alone),
            degrees(cause.repaired),
        )
        for cause in sorted(causes, key=lambda cause: -abs(cause.alone))
    )
    return Table(
        head=("number", "printed", "exactly", "it alone as printed", "all but it as printed"),
        rows=rows,
        numeric=frozenset({3, 4}),
        caption="Which number causes which steady error, one at a time, in the loop with the estimator.",
    )


def _figure(name: str, pictures: Mapping[str, str], caption: str, description: str) -> Picture:
    return Picture(svg=pictures[name], caption=caption, description=description)


def _complex_list(values: Sequence[complex]) -> str:
    """Conjugate pairs once, with ±."""
    parts = []
    for value in values:
        if abs(value.imag) < _NOTHING:
            parts.append(f"{value.real:.3f}")
        elif value.imag > 0:
            parts.append(rf"{value.real:.3f} \pm {value.imag:.3f} j")
    return " ".join(f"${part},$" for part in parts[:-1]) + f" ${parts[-1]}$"


def _symbol(name: str) -> str:
    return f"{name[0]}_{name[1:]}" if len(name) > 1 else name
