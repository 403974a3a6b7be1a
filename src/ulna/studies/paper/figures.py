"""The figures of the report: those of the paper redrawn, and what it does not show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ulna.plot import Curve, plot_curves, plot_poles
from ulna.sim import Trajectory
from ulna.studies.paper.passive import Passive
from ulna.studies.paper.runs import ANGLE, Loop
from ulna.studies.paper.schematics import arm_schematic, circuit_schematic, forearm_schematic
from ulna.system import Equilibria

_SHOWN_SECONDS = 5.0
_SETTLED_SECONDS = 2.0


def draw(
    loops: Mapping[str, Loop], free: Sequence[Trajectory], rests: Equilibria, passive: Passive
) -> dict[str, Figure]:
    """Return every figure by the name of its file, in the order of the report."""
    feedback = (loops["state_feedback_exact"], loops["state_feedback_printed"])
    output = (loops["compensator_exact"], loops["compensator_printed"])
    return {
        "figure-1": forearm_schematic(),
        "figure-2": arm_schematic(),
        "figure-3": circuit_schematic(),
        "figure-4": _uncontrolled(free, rests),
        "figure-5": _compared(feedback, ANGLE, "link angle"),
        "figure-6": _compared(output, ANGLE, "link angle"),
        "figure-7": _compared(output, f"{ANGLE}_hat", "estimated link angle"),
        "steady": _steady((output[0], feedback[1], output[1])),
        "voltage": _compared(output, "u", "armature voltage", unit="V"),
        "poles": plot_poles({"exact": output[0].poles, "as printed": output[1].poles}),
        "forearm": _passive(passive),
    }


def _uncontrolled(free: Sequence[Trajectory], rests: Equilibria) -> Figure:
    values = np.concatenate([run[ANGLE] for run in free])
    low, high = float(values.min()) - 0.3, float(values.max()) + 0.3
    levels = [point[ANGLE] for point in rests if low < point[ANGLE] < high]
    curves = [Curve(label=_from(run), times=run.times, values=run[ANGLE], hue=hue) for hue, run in enumerate(free)]
    return plot_curves(curves, quantity="link angle", unit="rad", levels=levels)


def _compared(pair: tuple[Loop, Loop], signal: str, quantity: str, *, unit: str = "rad") -> Figure:
    """The runs of the exact loop, solid, and of the printed one, dashed."""
    curves = []
    for hue in range(len(pair[0].runs)):
        for dash, (loop, words) in enumerate(zip(pair, ("exact", "as printed"), strict=True)):
            run = loop.runs[hue].trajectory
            shown = run.times <= _SHOWN_SECONDS
            label = f"{_from(run)}, {words}"
            curves.append(Curve(label=label, times=run.times[shown], values=run[signal][shown], hue=hue, dash=dash))
    return plot_curves(curves, quantity=quantity, unit=unit, levels=(0.0,))


def _steady(chosen: Sequence[Loop]) -> Figure:
    """The end of the runs from the second angle, in degrees: where the loops come to rest."""
    curves = []
    labels = ("exact", "law (32) as printed, true states", "(53) and (54) as printed")
    for hue, (loop, label) in enumerate(zip(chosen, labels, strict=True)):
        run = loop.runs[1].trajectory
        shown = (run.times >= _SETTLED_SECONDS) & (run.times <= _SHOWN_SECONDS)
        values = np.degrees(run[ANGLE][shown])
        curves.append(Curve(label=label, times=run.times[shown], values=values, hue=hue, dash=int(loop.printed)))
    return plot_curves(curves, quantity="link angle", unit="degrees", levels=(0.0,), height=3.0)


def _passive(passive: Passive) -> Figure:
    angle = passive.forearm.states[0].name
    curves = []
    for hue, release in enumerate(passive.releases):
        for dash, (run, words) in enumerate(((release.nonlinear, "nonlinear"), (release.linear, "linear"))):
            label = f"{release.degrees:g}°, {words}"
            curves.append(Curve(label=label, times=run.times, values=run[angle], hue=hue, dash=dash))
    rest = math.degrees(passive.releases[0].linear[angle][-1])
    return plot_curves(curves, quantity="angle, up from the horizontal", unit="rad", levels=(math.radians(rest),))


def _from(run: Trajectory) -> str:
    return f"from {run[ANGLE][0]:g} rad".replace("-", "−")
