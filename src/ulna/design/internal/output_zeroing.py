"""Zero dynamics: what a plant still does while its outputs are held at zero (Isidori, sections 4.3 and 6.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import Verdict, all_of, html_table
from ulna.symbolic.exact import SampledZero, generic_rank, is_zero, null_space, rank_at, solve_linear, tidy, time_budget
from ulna.symbolic.formulas import listing, value_html
from ulna.symbolic.solving import graph_near, limit_at, on_branch
from ulna.system import ControlAffine, Equilibrium, System, control_affine, equilibrium_in_numbers

_QUICK = SampledZero(seconds=0.3)
_CLAIM = "the zero dynamics are found"


@dataclass(frozen=True, slots=True, kw_only=True)
class ZeroDynamics:
    """The dynamics on the largest manifold of states that can be kept with y = y* for all times.

    Attributes:
        plant: the plant.
        set_point: (p,) y*, the value at which the outputs are held.
        manifold: states solved for, as expressions in the other ones: the manifold is {x_i = expression}.
        inputs: the inputs that keep the plant there, by input symbol, as functions on the manifold.
        coordinates: coordinates of the manifold, here states, as functions of the plant's state.
        system: the zero dynamics as a system: its states the coordinates, its outputs the inputs needed. None unless
            the verdict holds. Without states if the manifold is a point.
        point: the operating point moved to the manifold, parameters at their values.
        regular: whether all ranks met are the same around that point as elsewhere on the manifold.
        verdict: on "the zero dynamics are found".
    """

    plant: System
    set_point: tuple[sp.Expr, ...]
    manifold: Mapping[sp.Symbol, sp.Expr]
    inputs: Mapping[sp.Symbol, sp.Expr]
    coordinates: Mapping[sp.Symbol, sp.Expr]
    system: System | None
    point: Mapping[sp.Symbol, sp.Expr]
    regular: Verdict
    verdict: Verdict

    @property
    def dimension(self) -> int | None:
        """The number of coordinates, None if the zero dynamics were not found."""
        return None if self.system is None else len(self.system.states)

    def __repr__(self) -> str:
        rows = [*self.manifold.items(), *self.inputs.items()]
        left = "" if self.system is None else f"\n{self.system!r}"
        return listing(f"Zero dynamics of '{self.plant.name}', {self.verdict}", [(s.name, e) for s, e in rows]) + left

    def _repr_html_(self) -> str:
        """A table for notebooks: the manifold, the inputs that keep the plant on it, the motion that is left."""
        rows: list[tuple[object, object]] = [
            ("verdict", str(self.verdict)),
            ("outputs held at", value_html(self.set_point)),
        ]
        if self.system is not None:
            rates = {
                f"{s.name}'": e for s, e in zip(self.system.states, self.system.inline(self.system.rates), strict=True)
            }
            told = (
                ("on the manifold", self.manifold),
                ("inputs that keep it there", self.inputs),
                ("motion left", rates),
            )
            rows += [(name, value_html(value) if value else "none") for name, value in told]
        return html_table(rows, title=f"Zero dynamics of '{self.plant.name}'")


@dataclass(slots=True, kw_only=True)
class _Manifold:
    """A graph over the states that are not solved for, and a point on it."""

    solved: dict[sp.Symbol, sp.Expr]
    point: dict[sp.Symbol, sp.Expr]
    regular: list[Verdict]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tangency:
    """offset + slope u = 0: what the inputs must satisfy to stay on the manifold; one row per solved state."""

    offset: sp.MatrixBase
    slope: sp.MatrixBase


class _StoppedError(Exception):
    """Carries the verdict that says why there is no answer."""

    def __init__(self, verdict: Verdict) -> None:
        self.verdict = verdict
        super().__init__(str(verdict))


def zero_dynamics(system: System, *, set_point: Sequence[sp.Expr] | None = None, seconds: float = 6.0) -> ZeroDynamics:
    """The zero dynamics of a plant, by the zero dynamics algorithm.

    M_0 = {h = y*}; M_{k+1} is the part of M_k where some input keeps the state in M_k. With a well defined relative
    degree this ends at {h = L_f h = … = 0} and u* = −β⁻¹ α; it needs no relative degree.

    Args:
        system: the plant, with at least one output and input.
        set_point: (p,) y*. Left out: zero, or the outputs at the operating point if the plant rests there or cannot be
            kept at zero.
        seconds: s, for everything together.

    Raises:
        NotAffineError: if the plant is not affine in its inputs.

    Examples:
        >>> ulna.zero_dynamics(ulna.model("cart_pole").with_values()).dimension
        2
    """
    view, base = control_affine(system), equilibrium_in_numbers(system)
    if set_point is None:
        held = _held(view, base)
        found = _at_set_point(system, held, seconds)
        given = tuple(view.h.xreplace(base.states))
        if found.system is not None or given == held or not _finite_and_held(given, base) or not view.u:
            return found
        # A temperature or a population of zero: what the equations say there is beside the point.
        instead = _at_set_point(system, given, seconds)
        return found if instead.system is None else instead
    return _at_set_point(system, tuple(set_point), seconds)


def _finite_and_held(values: Sequence[sp.Expr], base: Equilibrium) -> bool:
    numbers = [v.xreplace(base.where) for v in values]
    return not any(v.has(sp.nan, sp.zoo, sp.oo) or v.free_symbols for v in numbers) and any(v != 0 for v in numbers)


def _at_set_point(system: System, held: tuple[sp.Expr, ...], seconds: float) -> ZeroDynamics:
    view, base = control_affine(system), equilibrium_in_numbers(system)
    manifold = _Manifold(solved={}, point=dict(base.where), regular=[])
    if not view.u or not view.h.rows:
        missing = "output" if view.u else "input"
        return _none(system, held, manifold, Verdict.undecided(_CLAIM, reason=f"the plant has no {missing}"))
    try:
        with time_budget(seconds):
            tangency = _largest_manifold(view, held, manifold)
            inputs = _inputs(view, tangency, manifold)
            return _found(view, held, manifold, inputs)
    except _StoppedError as reason:
        return _none(system, held, manifold, reason.verdict)
    return _none(system, held, manifold, Verdict.undecided(_CLAIM, reason=f"out of time after {seconds:g} s"))


def _held(view: ControlAffine, base: Equilibrium) -> tuple[sp.Expr, ...]:
    """The outputs at the operating point if the plant rests there, else zero."""
    zero = tuple(sp.Integer(0) for _ in view.h)
    if not base.verdict.holds:
        return zero
    values = view.h.xreplace(base.where)
    if values.has(sp.nan, sp.zoo, sp.oo) or all(is_zero(v, test=_QUICK).holds for v in values):
        return zero
    given = view.h.xreplace(base.states)
    return tuple(sp.Integer(0) if is_zero(v, test=_QUICK).holds else g for g, v in zip(given, values, strict=True))


def _largest_manifold(view: ControlAffine, held: Sequence[sp.Expr], manifold: _Manifold) -> _Tangency:
    """Shrinks `manifold` from {h = y*} until it can be kept; returns the condition on the inputs there."""
    conditions = [h - y for h, y in zip(view.h, held, strict=True)]
    tangency: _Tangency | None = None
    for _ in range(len(view.x) + 1):
        before = len(manifold.solved)
        _restrict(view, conditions, manifold)
        if tangency is not None and len(manifold.solved) == before:
            return tangency  # the conditions left are on parameters alone, and their values fulfil them
        tangency = _tangency(view, manifold)
        conditions = _hidden_conditions(tangency, manifold)
        if not conditions:
            return tangency
    raise _StoppedError(Verdict.undecided(_CLAIM, reason="the algorithm did not end"))


def _restrict(view: ControlAffine, conditions: Sequence[sp.Expr], manifold: _Manifold) -> None:
    free = [x for x in view.x if x not in manifold.solved]
    # States driven by an input directly are solved for first: the others have the shorter rates.
    driven = [any(view.g[view.x.index(x), j] != 0 for j in range(view.g.cols)) for x in free]
    order = [x for x, d in zip(free, driven, strict=True) if d] + [
        x for x, d in zip(free, driven, strict=True) if not d
    ]
    graph = graph_near(conditions, order, near=manifold.point)
    if not graph.verdict.holds:
        make = Verdict.refuted if graph.verdict.fails else Verdict.undecided
        reason = "no state keeps the outputs there" if graph.verdict.fails else "the manifold could not be solved for"
        raise _StoppedError(make(_CLAIM, reason=reason, **graph.verdict.evidence))
    step = dict(graph.solved)
    manifold.point = dict(graph.point)
    manifold.solved = {s: _short(e.xreplace(step), manifold) for s, e in manifold.solved.items()} | {
        s: _short(e, manifold) for s, e in step.items()
    }
    for symbol, expression in manifold.solved.items():
        value = expression.xreplace({s: v for s, v in manifold.point.items() if s not in manifold.solved})
        if value.is_number:
            manifold.point[symbol] = value


def _tangency(view: ControlAffine, manifold: _Manifold) -> _Tangency:
    """d/dt (x_i − s_i(ζ)) on the manifold, split into offset and slope in u."""
    solved = manifold.solved
    free = [x for x in view.x if x not in solved]
    f, g = view.f.xreplace(solved), view.g.xreplace(solved)
    if f.has(sp.nan):
        f = view.f.applyfunc(lambda e: limit_at(e, solved))
    place = {x: k for k, x in enumerate(view.x)}
    offset: list[sp.Expr] = []
    slope: list[sp.Expr] = []
    for symbol, expression in solved.items():
        slopes = [(place[z], expression.diff(z)) for z in free]
        row = place[symbol]
        offset.append(f[row] - sum((d * f[k] for k, d in slopes if d != 0), sp.Integer(0)))
        for j in range(g.cols):
            slope.append(g[row, j] - sum((d * g[k, j] for k, d in slopes if d != 0), sp.Integer(0)))
    columns = sp.Matrix(len(solved), g.cols, slope)
    return _Tangency(offset=sp.Matrix(len(solved), 1, offset), slope=columns.applyfunc(_without_zeros))


def _without_zeros(expression: sp.Expr) -> sp.Expr:
    return sp.Integer(0) if expression == 0 or is_zero(expression, test=_QUICK).holds else expression


def _hidden_conditions(tangency: _Tangency, manifold: _Manifold) -> list[sp.Expr]:
    """What the state must satisfy for an input to exist: the offset along the left kernel of the slope."""
    rank = generic_rank(tangency.slope, seconds=0.3)
    manifold.regular.append(_constant_rank(tangency.slope, rank.value, manifold))
    hidden = [(vector.T * tangency.offset)[0] for vector in null_space(tangency.slope.T)]
    return [e for e in hidden if e != 0 and not is_zero(e, test=_QUICK).holds]


def _constant_rank(slope: sp.MatrixBase, generic: int, manifold: _Manifold) -> Verdict:
    claim = "the decoupling matrix has constant rank around the point"
    local = rank_at(slope, manifold.point, seconds=0.3)
    if not local.verdict.holds:
        return Verdict.undecided(claim, **local.verdict.evidence)
    if local.value < generic:
        return Verdict.refuted(claim, generic=generic, at_point=local.value, matrix=slope)
    return Verdict.proved(claim, rank=generic)


def _inputs(view: ControlAffine, tangency: _Tangency, manifold: _Manifold) -> dict[sp.Symbol, sp.Expr]:
    """u* with offset + slope u* = 0, if it is unique."""
    rank = generic_rank(tangency.slope, seconds=0.3)
    if rank.value < len(view.u):
        reason = "outputs at rest do not determine the inputs: several input histories keep them there"
        raise _StoppedError(Verdict.refuted(_CLAIM, reason=reason, rank=rank.value, inputs=len(view.u)))
    rows = list(rank.rows)
    found = solve_linear(tangency.slope.extract(rows, list(range(len(view.u)))), -tangency.offset.extract(rows, [0]))
    if found.solution is None:
        raise _StoppedError(Verdict.undecided(_CLAIM, reason="the inputs could not be solved for in time"))
    return {u: _short(e, manifold) for u, e in zip(view.u, found.solution, strict=True)}


def _short(expression: sp.Expr, manifold: _Manifold) -> sp.Expr:
    """Tidy, roots and moduli as they are near the point."""
    return on_branch(tidy(on_branch(expression, manifold.point)), manifold.point)


def _found(
    view: ControlAffine, held: tuple[sp.Expr, ...], manifold: _Manifold, inputs: Mapping[sp.Symbol, sp.Expr]
) -> ZeroDynamics:
    plant = view.system
    kept = [(s, x) for s, x in zip(plant.states, view.x, strict=True) if x not in manifold.solved]
    closed = view.f + view.g * sp.Matrix([inputs[u] for u in view.u])
    place = {x: k for k, x in enumerate(view.x)}
    rates = tuple(_short(closed[place[x]].xreplace(manifold.solved), manifold) for _, x in kept)
    if any(e.has(sp.nan, sp.zoo, sp.oo, sp.I) for e in (*rates, *inputs.values(), *manifold.solved.values())):
        reason = "the manifold or the rates on it are not real and finite"
        raise _StoppedError(Verdict.undecided(_CLAIM, reason=reason))
    system = System(
        name=f"zero dynamics of {plant.name}",
        text="the plant while its outputs are held",
        states=tuple(s for s, _ in kept),
        rates=rates,
        outputs=plant.inputs,
        readouts=tuple(inputs[u] for u in view.u),
        parameters=plant.parameters,
        operating_point=tuple((s.name, manifold.point[x]) for s, x in kept),
    )
    regular = all_of("the zero dynamics algorithm is regular at the point", manifold.regular)
    verdict = Verdict.proved(_CLAIM, manifold=dict(manifold.solved), inputs=dict(inputs), regular=regular)
    return ZeroDynamics(
        plant=plant,
        set_point=held,
        manifold=dict(manifold.solved),
        inputs=dict(inputs),
        coordinates={x: x for _, x in kept},
        system=system,
        point=dict(manifold.point),
        regular=regular,
        verdict=verdict,
    )


def _none(system: System, held: Sequence[sp.Expr], manifold: _Manifold, verdict: Verdict) -> ZeroDynamics:
    return ZeroDynamics(
        plant=system,
        set_point=tuple(held),
        manifold=dict(manifold.solved),
        inputs={},
        coordinates={},
        system=None,
        point=dict(manifold.point),
        regular=all_of("the zero dynamics algorithm is regular at the point", manifold.regular),
        verdict=verdict,
    )
