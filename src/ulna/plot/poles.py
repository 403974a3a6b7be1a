"""Poles in the complex plane."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ulna.base import UlnaError
from ulna.plot.style import INK, MUTED, RULE, SURFACE, axis_label, colour, dress, new_figure, set_legend
from ulna.system import HasSystem, System, linearise

_MARKERS = ("x", "+", "o", "s", "D", "^")
_DAMPING = (0.2, 0.5, 0.8)


def plot_poles(given: Any, *, title: str = "", width: float = 6.0) -> Figure:
    """Return the poles of each group in the plane, in 1/s, with lines of equal damping and the unstable half shaded.

    Args:
        given: name of the group → its poles, finite; or poles alone; or what has them: a law, an observer, what
            `controller_for` gives (the poles of the design); a linearisation, a closed loop or another system (those
            of its linearisation, at its operating point).
        title: stands over the axes.
        width: of the figure, in inches.

    Raises:
        UlnaError: no pole at all, or one that is not finite.

    Examples:
        >>> ulna.plot_poles([-1 + 2j, -1 - 2j]).axes[0].get_xlabel()
        'real part (1/s)'
    """
    groups = _groups(given)
    poles = [complex(pole) for group in groups.values() for pole in group]
    if not poles or not all(math.isfinite(p.real) and math.isfinite(p.imag) for p in poles):
        raise UlnaError("a figure of poles", f"the poles are {poles}.", "Give at least one pole, all of them finite.")
    left, right, top = _limits(poles)
    figure = new_figure(width, 1.45 + 0.86 * width * 2.0 * top / (right - left))
    axes = figure.subplots()
    dress(axes)
    axes.grid(visible=False)
    axes.set_xlim(left, right)
    axes.set_ylim(-top, top)
    axes.set_aspect("equal", adjustable="box")
    _shade(axes)
    _draw_damping(axes, poles)
    for index, (name, group) in enumerate(groups.items()):
        values = [complex(pole) for pole in group]
        hollow = index >= 2
        axes.plot(
            [p.real for p in values],
            [p.imag for p in values],
            linestyle="none",
            marker=_MARKERS[index % len(_MARKERS)],
            markersize=9 if not hollow else 7,
            markeredgewidth=2.2 if not hollow else 1.6,
            markerfacecolor="none",
            markeredgecolor=colour(index),
            label=name,
            zorder=4,
        )
    axes.set_xlabel(axis_label("real part", "1/s"), fontsize=10, color=INK)
    axes.set_ylabel(axis_label("imaginary part", "1/s"), fontsize=10, color=INK)
    set_legend(figure, axes, title)
    return figure


def _groups(given: Any) -> Mapping[str, Sequence[complex]]:
    found = getattr(given, "poles", getattr(given, "eigenvalues", None))
    if found is None:
        found = linearise(given).eigenvalues if isinstance(given, System | HasSystem) else given
    return found if isinstance(found, Mapping) else {"poles": found}


def _limits(poles: Sequence[complex]) -> tuple[float, float, float]:
    """Left, right and top of the view: every pole and the origin with room, height 0.6 to 0.75 of the width."""
    reach = max(1e-3, *(abs(p.real) for p in poles), *(abs(p.imag) for p in poles))
    left = min(-0.4 * reach, *(p.real for p in poles)) - 0.12 * reach
    right = max(0.0, *(p.real for p in poles)) + 0.16 * reach
    top = max(1.2 * max(abs(p.imag) for p in poles), 0.3 * (right - left))
    return min(left, right - 2.0 * top / 0.75), right, top


def _shade(axes: Axes) -> None:
    left, right = axes.get_xlim()
    axes.axvspan(0.0, right, color=SURFACE, zorder=0)
    axes.axvline(0.0, color=MUTED, linewidth=1.0, zorder=1)
    axes.axhline(0.0, color=MUTED, linewidth=1.0, zorder=1)
    axes.set_xlim(left, right)


def _draw_damping(axes: Axes, poles: Sequence[complex]) -> None:
    """Rays of equal damping ratio ζ: a pole at angle φ from the negative real axis has ζ = cos φ."""
    low, high = axes.get_xlim()[0], axes.get_ylim()[1]
    for ratio in _DAMPING:
        direction = complex(-ratio, math.sqrt(1.0 - ratio**2))
        reach = min(-low / ratio, high / direction.imag)
        for ray in (direction, direction.conjugate()):
            axes.plot([0.0, ray.real * reach], [0.0, ray.imag * reach], color=RULE, linewidth=1.1, zorder=1)
        # The label stands where it is farthest from every pole.
        spots = [part * reach * direction for part in (0.84, 0.7, 0.56, 0.42)]
        spot = max(spots, key=lambda at: min(0.2 * reach, *(abs(at - pole) for pole in poles)))
        axes.text(
            spot.real,
            spot.imag,
            f"ζ = {ratio:g}",
            fontsize=8.5,
            color=MUTED,
            ha="center",
            va="center",
            rotation=-math.degrees(math.acos(ratio)),
            rotation_mode="anchor",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
            zorder=2,
        )
