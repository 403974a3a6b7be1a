"""One Taylor step of many runs at a time, and what is read off its polynomials, as one compiled function."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import heyoka as hy

from ulna.base import UlnaError
from ulna.program import FlowSeries, Kernel
from ulna.program.lowering.heyoka import to_heyoka
from ulna.sim.continuous.lane import FIGURES, LaneStep

CAUTION = 0.1
"""Largest last term of a step's series in units of the tolerance; global errors are then those of `Taylor` runs."""

ORDERS = range(6, 31)
"""Orders that are considered."""

OVERHEAD = 700
"""What a step costs besides its series, in operations."""

LOOKING = 100
"""What looking at an output costs besides, in operations for each order."""

HASTE = 1.1
"""How much slower runs may be for the sake of a shorter series, which compiles faster."""

LARGEST = 6000
"""Operations of a series beyond which compiling takes longer than the runs are worth."""

POINTS = 8
"""Parts of a step at whose ends outputs are looked at, before extremes and crossings between them are polished."""

POLISHING = 3
"""Newton steps from a point of a step to an extreme of the polynomial beside it."""

CROSSING = 5
"""Newton steps to a crossing, which may be close to an extreme."""

NEARLY = 0.9
"""Part of a band beyond which a parabola's top is looked at closely."""


def lane_step(
    field: Kernel,
    states: Sequence[str],
    constants: Sequence[str],
    outputs: Sequence[str],
    tolerance: float,
    *,
    optimise: bool,
) -> LaneStep | None:
    """The step of x' = f(x) whose first n outputs are the rates; None where its series is unknown or too long.

    Of the states divided by their sizes, the last term of the series is at most CAUTION · tolerance of the larger of 1
    and the largest entry, and so is the one before (Jorba and Zou, A software package for the numerical integration of
    ODEs by means of high-order Taylor methods, Experimental Mathematics 14, 2005). Order and step are balanced by cost:
    high orders and long steps win where many runs share each instruction.

    Args:
        field: inputs states and constants, outputs the rates and then the functions `outputs`.
        outputs: of which figures are kept.
    """
    small = max(CAUTION * tolerance, 1e-17)
    rates = field.outputs[: len(states)]
    series = FlowSeries(field, states, rates)
    order = _best_order(series, small, len(outputs))
    if order is None:
        return None
    moving = [hy.expression(name) for name in ("t", *(f"x{k}" for k in range(len(states))))]
    sizes = [hy.expression(f"m{k}") for k in range(len(states))]
    kept = [hy.expression(f"r{k}") for k in range(FIGURES * len(outputs))]
    end, *inverses = (hy.expression(name) for name in ("end", *(f"i{k}" for k in range(len(states)))))
    known = [hy.expression(f"c{k}") for k in range(len(constants))]
    edges = [hy.expression(f"b{k}") for k in range(2 * len(outputs))]
    sources = dict(zip((*states, *constants), (*moving[1:], *known), strict=True))
    found = to_heyoka(series.kernel(order), sources)
    polynomials = {name: [found[f"{name}:{k}"] for k in range(order + 1)] for name in (*states, *outputs)}
    step = _step([polynomials[name] for name in states], inverses, small)
    time = moving[0]
    last = hy.gte(time + step, end)
    step = hy.select(last, end - time, step)
    after = [hy.select(last, end, time + step), *(_horner(polynomials[name], step) for name in states)]
    after += [_largest([size, _size(state)]) for size, state in zip(sizes, after[1:], strict=True)]
    for k, name in enumerate(outputs):
        own = _scaled(polynomials[name], step)
        after += _followed(own, time, step, kept[FIGURES * k : FIGURES * (k + 1)], *edges[2 * k : 2 * k + 2])
    arguments = [*moving, *sizes, *kept, end, *inverses, *known, *edges]
    evaluate = hy.cfunc(after, arguments, opt_level=3 if optimise else 0)
    return LaneStep(evaluate=evaluate, order=order, states=len(states), outputs=len(outputs), moving=len(after))


def _best_order(series: FlowSeries, small: float, outputs: int) -> int | None:
    """The lowest order with about the least work per unit of time, up to which the series is grown at least."""
    costs: dict[int, float] = {}
    for order in range(ORDERS.stop):
        try:
            series.grow()
        except UlnaError:
            # heyoka knows functions whose recurrences are not among ours.
            return None
        if series.operations > LARGEST:
            break
        if order in ORDERS:
            costs[order] = (series.operations + OVERHEAD + LOOKING * outputs * order) * small ** (-1.0 / order)
            if costs[order] > 1.1 * min(costs.values()):
                break
    return next((order for order, cost in costs.items() if cost <= HASTE * min(costs.values())), None)


def _step(states: list[list[Any]], inverses: list[Any], small: float) -> Any:
    """The longest step whose last two terms are small beside the state, or beside 1; each state by its own size."""
    one = hy.expression(1.0)

    def sizes(order: int) -> list[Any]:
        return [_size(series[order]) * inverse for series, inverse in zip(states, inverses, strict=True)]

    allowed = small * _largest([one, *sizes(0)])
    steps = []
    for order in (len(states[0]) - 1, len(states[0]) - 2):
        last = _largest(sizes(order))
        steps.append(hy.exp(hy.log(allowed / last) / float(order)))
    return hy.select(hy.lt(steps[0], steps[1]), steps[0], steps[1])


def _followed(series: list[Any], time: Any, step: Any, kept: Sequence[Any], target: Any, band: Any) -> list[Any]:
    """Largest and smallest value so far, and the last time outside the band; `series` is over the step as unit."""
    parts = [k / POINTS for k in range(POINTS + 1)]
    values = [series[0], *(_horner(series, hy.expression(part)) for part in parts[1:])]
    left = _left(series, parts, values, target, band)
    return [
        _largest([kept[0], *values, _extreme(series, parts, values, 1.0)]),
        -_largest([-kept[1], *(-value for value in values), -_extreme(series, parts, values, -1.0)]),
        hy.select(hy.lt(left, 0.0), kept[2], time + left * step),
    ]


def _extreme(series: list[Any], parts: list[float], values: list[Any], sign: float) -> Any:
    """A value of the polynomial close to the top (sign 1) or the bottom (−1) of the points, mostly the extreme."""
    best, at = sign * values[0], hy.expression(parts[0])
    for part, value in zip(parts[1:], values[1:], strict=True):
        higher = hy.gt(sign * value, best)
        best, at = hy.select(higher, sign * value, best), hy.select(higher, hy.expression(part), at)
    return _horner(series, _flat(series, at, sign))


def _flat(series: list[Any], at: Any, sign: Any) -> Any:
    """The place of the top (sign 1) or bottom (−1) next to a place, where there is one."""
    slope = _derived(series)
    bend = _derived(slope)
    reach = 1.0 / POINTS
    low, high = _largest([at - reach, hy.expression(0.0)]), -_largest([-at - reach, hy.expression(-1.0)])
    place = at
    for _ in range(POLISHING):
        curvature = _horner(bend, place)
        # Only a hill has a top.
        move = hy.select(hy.lt(sign * curvature, 0.0), -_horner(slope, place) / curvature, 0.0)
        place = _within(place + move, low, high)
    return place


def _left(series: list[Any], parts: list[float], values: list[Any], target: Any, band: Any) -> Any:
    """The last place of the step outside the band, polished; 1 at its end, −1 if it is inside throughout."""
    start, before, after = hy.expression(-1.0), hy.expression(0.0), hy.expression(0.0)
    top, above = hy.expression(-1.0), hy.expression(1.0)
    for k, (part, value) in enumerate(zip(parts, values, strict=True)):
        outside = hy.gt(_size(value - target), band)
        start = hy.select(outside, hy.expression(part), start)
        before = hy.select(outside, value, before)
        if k < POINTS:
            after = hy.select(outside, values[k + 1], after)
        if 0 < k < POINTS:
            # Perhaps an excursion between points: the parabola through three of them comes close to the band's edge.
            rise, second = 0.5 * (values[k + 1] - values[k - 1]), values[k + 1] - 2.0 * value + values[k - 1]
            shift = -rise / second
            height = value + 0.5 * shift * rise - target
            near = hy.logical_and([hy.gt(_size(height), NEARLY * band), hy.lt(_size(shift), 1.0)])
            top, above = hy.select(near, part + shift / POINTS, top), hy.select(near, height, above)
    top = _flat(series, top, hy.select(hy.lt(above, 0.0), -1.0, 1.0))
    height = _horner(series, top)
    excursion = hy.logical_and([hy.gt(_size(height - target), band), hy.gt(top, start)])
    start, before = hy.select(excursion, top, start), hy.select(excursion, height, before)
    side = hy.select(hy.lt(before, target), -1.0, 1.0)
    edge = target + side * band
    slope = _derived(series)
    # From a point by the chord to the next one, from a top by its parabola.
    chord = (before - edge) / (before - after) / POINTS
    arc = hy.sqrt(_largest([2.0 * (edge - before) / _horner(_derived(slope), top), hy.expression(0.0)]))
    place = start + hy.select(excursion, arc, chord)
    for _ in range(CROSSING):
        place = _within(place - (_horner(series, place) - edge) / _horner(slope, place), start, start + 1.0 / POINTS)
    return hy.select(hy.lt(start, 0.0), -1.0, hy.select(hy.gte(start, 1.0), 1.0, place))


def _size(value: Any) -> Any:
    return hy.select(hy.lt(value, 0.0), -value, value)


def _largest(values: Sequence[Any]) -> Any:
    found = values[0]
    for value in values[1:]:
        found = hy.select(hy.lt(found, value), value, found)
    return found


def _within(value: Any, low: Any, high: Any) -> Any:
    # A NaN, of a slope that is zero, stays where the search began.
    return hy.select(hy.gt(value, low), hy.select(hy.lt(value, high), value, high), low)


def _horner(series: list[Any], at: Any) -> Any:
    value = series[-1]
    for coefficient in reversed(series[:-1]):
        value = value * at + coefficient
    return value


def _scaled(series: list[Any], step: Any) -> list[Any]:
    """The series over the step as unit of time."""
    scaled, power = [series[0]], step
    for coefficient in series[1:]:
        scaled.append(coefficient * power)
        power = power * step
    return scaled


def _derived(series: list[Any]) -> list[Any]:
    return [float(k) * series[k] for k in range(1, len(series))]
