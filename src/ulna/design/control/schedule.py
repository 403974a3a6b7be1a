"""Gain schedules: laws on the linearisations along a family of rest points, one law in the set point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.base import DesignError, UlnaError
from ulna.design.control.law import Law
from ulna.design.control.local import reference_of, with_integrals
from ulna.design.gains import Gains, characteristic, gain_rule
from ulna.design.linear import LinearPlant, as_numbers, as_text, linear_plant, require_stabilisable, split
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.formulas import exact
from ulna.system import Signal, System, decimal_root, equilibrium


@dataclass(frozen=True, slots=True, kw_only=True)
class _Knot:
    """One rest point of the family: the output's value w there, A, B and K with the integral in front."""

    w: sp.Rational
    linear: LinearPlant
    A: sp.ImmutableDenseMatrix
    B: sp.ImmutableDenseMatrix
    K: sp.ImmutableDenseMatrix


def gain_schedule(
    plant: PlantLike,
    *,
    over: Mapping[str, tuple[float, float, int]],
    gains: Gains,
    integral: bool = False,
    measured: bool = False,
) -> Law:
    """The law u = u*(r) − K (x − x*(r)) along the points x*(w), u*(w) where the plant rests with an output y = w.

    It follows a slow set point r through a range that is too wide for one linearisation. At every knot the gains are
    those of the linearisation there; between them K is linear in the scheduling variable, x* and u* are cubic splines
    of r, so that the output comes to rest a little beside r, more knots or integral action closing it. r counts up to
    the ends of the range. What is promised is local at each rest point of the family, and for a set point that
    changes slowly.

    Args:
        plant: its parameters are put at their values; it has as many controlled outputs as inputs, the others stay
            where they are at the operating point.
        over: the output that is scheduled, with the ends of its range, SI, and the number of knots, two or more.
        gains: as in `local_law`, one rule for all knots.
        integral: add ∫(y − r) dt, its gain scheduled too.
        measured: K depends on the output as it is measured instead of on r.

    Raises:
        DesignError: for another output or range, a knot where the plant does not rest or that gains do not fit.

    Reference:
        H. K. Khalil, Nonlinear Systems, 3rd ed., 2002, section 12.5; W. J. Rugh, J. S. Shamma, Automatica 36 (2000).

    Examples:
        >>> law = ulna.gain_schedule("duffing", over={"y": (-1, 1, 5)}, gains=[-1, -2])
        >>> [signal.name for signal in law.system.inputs]
        ['x1', 'x2', 'y_ref']
    """
    system = as_plant(plant).with_values()
    asked = f"a gain schedule for '{system.name}'"
    output, (low, high, count) = _asked(system, over, asked)
    values = [exact(float(f"{v:.12g}")) for v in np.linspace(low, high, count)]
    knots = [_knot(p, w, output, gains, integral, asked) for w, p in _family(system, output, values, asked)]
    return _law(system, knots, output, integral=integral, measured=measured)


def _asked(
    system: System, over: Mapping[str, tuple[float, float, int]], asked: str
) -> tuple[int, tuple[float, float, int]]:
    names = [o.name for o in system.outputs]
    if len(over) != 1 or next(iter(over)) not in names:
        found = f"over= gives {', '.join(over) or 'nothing'}; the outputs are {', '.join(names) or 'none'}."
        raise DesignError(asked, found, "Schedule over one output, such as over={'y': (0.1, 0.5, 5)}.")
    (name, (low, high, count)) = next(iter(over.items()))
    if not (low < high and np.isfinite([low, high]).all() and count >= 2):
        raise DesignError(asked, f"the range of {name} is {low} to {high} with {count} knots.", "Give lower < upper.")
    others = [k for k, o in enumerate(system.outputs) if o.controlled and o.name != name]
    if len(others) + 1 != len(system.inputs):
        found = (
            f"{len(system.inputs)} inputs and {len(others) + 1} controlled outputs, expected the same number of both."
        )
        raise DesignError(
            asked, found, "Say which outputs, as many as inputs, with `with_uses(plant, controlled=[…])`."
        )
    return names.index(name), (float(low), float(high), int(count))


def _family(
    system: System, output: int, values: Sequence[sp.Rational], asked: str
) -> list[tuple[sp.Rational, LinearPlant]]:
    """The linearisation at every value, each point sought from its neighbour's, the first from the operating point."""
    start = dict(equilibrium(system).values)
    readouts = system.inline(system.readouts)
    others = [readouts[k] for k, o in enumerate(system.outputs) if o.controlled and k != output]
    held = [e - sp.Rational(str(sp.N(e.subs(start), 15))) for e in others]
    rates = [r for r in system.inline(system.balances) if r != 0]
    here = float(sp.N(readouts[output].subs(start)))
    first = min(range(len(values)), key=lambda k: abs(float(values[k]) - here))
    found: dict[int, LinearPlant] = {}
    for k in (*range(first, len(values)), *range(first - 1, -1, -1)):
        neighbour = found.get(k - 1) or found.get(k + 1)
        near = neighbour.point if neighbour else start
        equations = [*rates, *held, readouts[output] - values[k]]
        name = f"{system.outputs[output].name} = {as_text(values[k])}"
        root = decimal_root(equations, list(start), near) if len(equations) <= len(start) else None
        if root is None:
            raise DesignError(
                asked, f"no equilibrium of the plant was found with {name}.", "Choose a range where one exists."
            )
        try:
            found[k] = linear_plant(system, {s.name: v for s, v in root[0].items()})
        except UlnaError as error:
            raise DesignError(f"{asked} at {name}", error.found, error.hint) from None
    return [(values[k], found[k]) for k in range(len(values))]


def _knot(linear: LinearPlant, w: sp.Rational, output: int, gains: Gains, integral: bool, asked: str) -> _Knot:
    where = f"{asked} at {linear.system.outputs[output].name} = {as_text(w)}"
    require_stabilisable(split(as_numbers(linear.A), as_numbers(linear.B), linear.names), where)
    A, B = with_integrals(linear, (output,) if integral else ())
    names = ("e1_int",) * integral + linear.names
    return _Knot(w=w, linear=linear, A=A, B=B, K=gain_rule(gains).feedback(A, B, names, where))


def _law(system: System, knots: Sequence[_Knot], output: int, *, integral: bool, measured: bool) -> Law:
    signal = reference_of(system.outputs[output])
    readout = system.inline(system.readouts)[output]
    grid = [k.w for k in knots]
    r = _within(signal.symbol, grid)
    x, u = system.state_symbols, system.input_symbols
    rest = {s: _spline(r, grid, [k.linear.point[s] for k in knots]) for s in (*x, *u)}
    by = _within(readout, grid) if measured else r
    K = sp.ImmutableDenseMatrix(len(u), len(x) + integral, lambda i, j: _hinges(by, grid, [k.K[i, j] for k in knots]))
    memories = (Signal(name="e1_int", text="integral of the error"),) * integral
    dx = sp.Matrix([*(m.symbol for m in memories), *(s - rest[s] for s in x)])
    expressions = sp.ImmutableDenseMatrix(sp.Matrix([rest[s] for s in u]) - K * dx)
    error = readout.xreplace(dict(zip(u, expressions, strict=True))) - r
    name = system.outputs[output].name
    return Law(
        plant=system,
        method=(
            f"gain schedule over {name if measured else signal.name}, local on the linearisations at {len(knots)} "
            f"rest points from {name} = {as_text(grid[0])} to {as_text(grid[-1])}"
        ),
        expressions=expressions,
        polynomials=tuple(characteristic(k.A - k.B * k.K) for k in knots),
        gains=sp.ImmutableDenseMatrix(K[:, int(integral) :]),
        integral_gains=tuple(K[:, : int(integral)]),
        system=System(
            name=f"law of {system.name}",
            text="gain-scheduled state feedback",
            states=memories,
            rates=(error,) * integral,
            inputs=(*system.states, signal),
            outputs=system.inputs,
            readouts=tuple(expressions),
        ),
    )


def _within(value: sp.Expr, grid: Sequence[sp.Rational]) -> sp.Expr:
    return sp.Max(grid[0], sp.Min(grid[-1], value))


def _hinges(s: sp.Expr, grid: Sequence[sp.Rational], values: Sequence[sp.Expr]) -> sp.Expr:
    """The piecewise linear function of s through the values, as a line and what its slope changes by at every knot."""
    slopes = [(b - a) / (q - p) for p, q, a, b in zip(grid, grid[1:], values, values[1:], strict=False)]
    bends = [
        (after - before) * sp.Max(0, s - w) for before, after, w in zip(slopes, slopes[1:], grid[1:], strict=False)
    ]
    return sp.Add(values[0] + slopes[0] * (s - grid[0]), *bends)


def _spline(s: sp.Expr, grid: Sequence[sp.Rational], values: Sequence[sp.Expr]) -> sp.Expr:
    """The cubic spline through the values; exact where they lie on a line."""
    if len(values) == 2 or _straight(values):
        return _hinges(s, [grid[0], grid[-1]], [values[0], values[-1]])
    from scipy.interpolate import CubicSpline

    spline = CubicSpline([float(w) for w in grid], [float(v) for v in values])
    pieces = []
    for k, coefficients in enumerate(spline.c.T):
        t = s - grid[k]
        cubic = sp.Add(*(exact(float(f"{c:.15g}")) * t ** (3 - j) for j, c in enumerate(coefficients)))
        pieces.append((cubic, s < grid[k + 1] if k + 2 < len(grid) else sp.true))
    return sp.Piecewise(*pieces)


def _straight(values: Sequence[sp.Expr]) -> bool:
    """Whether values at even distances lie on one line, but for rounding."""
    numbers = np.array([float(v) for v in values])
    line = np.linspace(numbers[0], numbers[-1], len(numbers))
    return bool(np.abs(numbers - line).max() <= 1e-10 * np.abs(numbers).max(initial=1e-300))
