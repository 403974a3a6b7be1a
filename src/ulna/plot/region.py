"""`plot_region`: what a certificate proves in the plane of two states, beside what runs show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from ulna.base import UlnaError, Verdict
from ulna.certify import Certificate, LevelSet, level_set
from ulna.plot.style import INK, MUTED, PALETTE, axis_label, colour, dress, new_figure, set_legend

EDGE_RUNS, POINTS, SEED = 8, 60, 0
"""Runs from the edge of the level set; points of the plane that are tried, at most 32 of them by a run."""
_MOST_RUNS, _GRID, _ROOM = 32, 161, 1.8
_PATIENCE = 40.0
"""Slowest time constants that a run is given."""
_FAR = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plane:
    """Two states of a level set; the others rest. `reach`: (n,) how far each state goes in the set."""

    found: LevelSet
    places: tuple[int, int]
    reach: np.ndarray
    horizon: float

    def points(self, across: ArrayLike, up: ArrayLike) -> np.ndarray:
        """(n, N) states of the plane."""
        across = np.ravel(across)
        points = np.repeat(self.found.rest[:, None], len(across), axis=1)
        points[list(self.places)] = across, np.ravel(up)
        return points


def plot_region(
    proof: Verdict | Certificate,
    states: Sequence[str] = (),
    *,
    units: Mapping[str, str] | None = None,
    title: str = "",
    width: float = 6.4,
) -> Figure:
    """Return the proved level set in the plane of two states, with sampled runs beside it; V along runs from its edge.

    The filled set is the section, where the other states rest: every run from it converges, proved. The dashed edge is
    the shadow of the whole set, exact from P, where both states are linear in the coordinates of the proof. Points are
    random: those outside the section are simulated (SciPy's LSODA, at most 32), until they enter the level set, are a
    hundred times farther off, or 40 slowest time constants are over; that is evidence and no proof. Dotted lines: where
    a command meets its limit.

    Args:
        proof: a proved verdict of `prove` on `Region` or `StableWithin`, or its certificate.
        states: names of the horizontal and the vertical one; the first two if left out.
        units: of the states by name, for the axes. title: stands over the axes. width: of the figure, in inches.

    Raises:
        UlnaError: a verdict without a certificate, a certificate without a level set, unknown states.

    Examples:
        >>> swing = ulna.model("duffing").with_values()
        >>> law = ulna.state_feedback(ulna.controller_form(swing), ulna.Poles(-2, -3))
        >>> verdict = ulna.prove(ulna.Loop(plant=swing, controller=law), ulna.StableWithin(box={"x1": 0.2}))
        >>> [axes.get_xlabel() for axes in ulna.plot_region(verdict).axes]
        ['x1', 'time (s)']
    """
    certificate = _certificate(proof)
    found = level_set(certificate)
    names = _names(found, states)
    plane = _Plane(
        found=found,
        places=(found.states.index(names[0]), found.states.index(names[1])),
        reach=found.reach(),
        horizon=_PATIENCE / found.slowest,
    )
    shadow = found.shadow(names)
    box = _box(plane, shadow)
    figure = new_figure(width, 1.1 * width)
    axes, below = figure.subplots(2, 1, height_ratios=(3.0, 1.0))
    for each in (axes, below):
        dress(each)
    _draw_set(axes, plane, box, shadow)
    _draw_points(axes, plane, box)
    _draw_runs(axes, below, plane, box)
    for name, set_label in zip(names, (axes.set_xlabel, axes.set_ylabel), strict=True):
        set_label(axis_label(name, (units or {}).get(name, "")), color=INK)
    axes.plot(*found.rest[list(plane.places)][:, None], "+", color=INK, markersize=9, zorder=6)
    set_legend(figure, axes, title or certificate.name)
    return figure


def _certificate(proof: Verdict | Certificate) -> Certificate:
    if isinstance(proof, Certificate):
        return proof
    certificate = proof.evidence.get("certificate")
    if not isinstance(certificate, Certificate):
        raise UlnaError(
            "a figure of a proved region",
            f"nothing was proved: the claim is {proof.status.value}.",
            "Ask for a smaller box or a weaker claim.",
        )
    return certificate


def _names(found: LevelSet, states: Sequence[str]) -> tuple[str, str]:
    chosen = list(states) or list(found.states[:2])
    unknown = [name for name in chosen if name not in found.states]
    if len(set(chosen)) != 2 or len(chosen) != 2 or unknown:
        given = f"{', '.join(chosen)} {'is' if len(chosen) == 1 else 'are'} not two different states of the loop."
        raise UlnaError("the plane of a proved region", given, f"Name two of {', '.join(found.states)}.")
    return chosen[0], chosen[1]


def _box(plane: _Plane, shadow: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Middle and half-widths of the picture: the set with room around it."""
    middle = plane.found.rest[list(plane.places)]
    half = plane.reach[list(plane.places)] if shadow is None else np.abs(shadow - middle[:, None]).max(axis=1)
    return middle, _ROOM * half


def _draw_set(axes: Axes, plane: _Plane, box: tuple[np.ndarray, np.ndarray], shadow: np.ndarray | None) -> None:
    found, (middle, half) = plane.found, box
    across, up = (np.linspace(c - h, c + h, _GRID) for c, h in zip(middle, half, strict=True))
    grid = np.meshgrid(across, up)
    points = plane.points(*grid)
    value = np.ma.masked_invalid(found.value(points).reshape(_GRID, _GRID))
    axes.contourf(across, up, value, levels=[0.0, 1.0], colors=[PALETTE[0]], alpha=0.15, zorder=1)
    axes.contour(across, up, value, levels=[1.0], colors=[PALETTE[0]], linewidths=1.8, zorder=3)
    axes.add_line(Line2D([], [], color=PALETTE[0], linewidth=1.8, label="proved, others at rest"))
    if shadow is not None and len(found.states) > 2:
        axes.plot(
            *shadow, color=PALETTE[0], linewidth=1.2, linestyle="dashed", label="shadow of what is proved", zorder=3
        )
    commands = found.commands(points)
    for k, (command, low, high) in enumerate(zip(commands, found.lower, found.upper, strict=True)):
        shown = np.ma.masked_invalid(command.reshape(_GRID, _GRID))
        met = [float(limit) for limit in (low, high) if shown.min() < limit < shown.max()]
        if met:
            axes.contour(across, up, shown, levels=met, colors=[MUTED], linestyles="dotted", linewidths=1.4, zorder=2)
            label = f"limit of {found.limited[k]}"
            axes.add_line(Line2D([], [], color=MUTED, linestyle="dotted", linewidth=1.4, label=label))


def _draw_points(axes: Axes, plane: _Plane, box: tuple[np.ndarray, np.ndarray]) -> None:
    found, (middle, half) = plane.found, box
    places = middle[:, None] + half[:, None] * np.random.default_rng(SEED).uniform(-1.0, 1.0, (2, POINTS))
    starts = plane.points(*places)
    inside = found.value(starts) <= 1.0
    tried = np.flatnonzero(~inside)[:_MOST_RUNS]
    arrived = np.array([_run(plane, starts[:, k], stop=1.0)[2] for k in tried], dtype=bool)
    kinds = (
        ("run that enters it", tried[arrived], "o", PALETTE[2]),
        ("run that does not", tried[~arrived], "x", PALETTE[1]),
    )
    for label, chosen, marker, hue in kinds:
        if len(chosen):
            axes.plot(*places[:, chosen], marker, color=hue, markersize=5, linestyle="none", label=label, zorder=4)
    if inside.any():
        axes.plot(*places[:, inside], ".", color=PALETTE[0], markersize=4, linestyle="none", zorder=4)


def _draw_runs(axes: Axes, below: Axes, plane: _Plane, box: tuple[np.ndarray, np.ndarray]) -> None:
    """Runs from the edge of the section in the plane, and V along them."""
    found, (middle, half) = plane.found, box
    for k, angle in enumerate(np.arange(EDGE_RUNS) * 2.0 * np.pi / EDGE_RUNS):
        start = _on_edge(plane, middle, half * np.array([np.cos(angle), np.sin(angle)]))
        times, run, _ = _run(plane, start, stop=1e-4)
        across, up = run[list(plane.places)]
        axes.plot(across, up, color=INK, linewidth=0.9, alpha=0.7, zorder=3, label="_" if k else "runs from its edge")
        below.semilogy(times, found.value(run), color=colour(k), linewidth=1.2)
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    below.set_xlabel(axis_label("time", "s"), color=INK)
    below.set_ylabel("V / level", color=INK)


def _on_edge(plane: _Plane, middle: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(n,) where the straight line from rest meets the edge of the section first, by halving; just inside."""
    parts = np.linspace(0.0, 1.5, 400)
    line = plane.points(*(middle[:, None] + direction[:, None] * parts))
    beyond = np.flatnonzero(~(plane.found.value(line) <= 1.0))
    high = parts[beyond[0]] if len(beyond) else parts[-1]
    low = parts[max(0, (beyond[0] if len(beyond) else len(parts)) - 1)]
    for _ in range(40):
        part = (low + high) / 2
        point = plane.points(*(middle[:, None] + part * direction[:, None]))
        low, high = (part, high) if plane.found.value(point)[0] <= 1.0 else (low, part)
    return plane.points(*(middle[:, None] + low * direction[:, None]))[:, 0]


def _run(plane: _Plane, start: np.ndarray, *, stop: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Times, states (n, N), and whether V came down to that part of the level."""
    found = plane.found

    def down(_: float, x: np.ndarray) -> float:
        value = float(found.value(x[:, None])[0])
        return value - stop if np.isfinite(value) else 1.0

    def away(_: float, x: np.ndarray) -> float:
        return _FAR - float(np.max(np.abs(x - found.rest) / plane.reach))

    down.terminal = away.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    rates = lambda _, x: np.nan_to_num(found.rates(x[:, None])[:, 0])  # noqa: E731
    done = solve_ivp(rates, (0.0, plane.horizon), start, method="LSODA", events=(down, away), rtol=1e-6, atol=1e-9)
    return done.t, done.y, bool(len(done.t_events[0]))
