"""Inverts a map given by expressions, on the branch through a base point."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice

import sympy as sp

from ulna.base import Verdict
from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.ball import leaves_of
from ulna.symbolic.exact.embed import attempt_exactly
from ulna.symbolic.exact.linear import solve_linear
from ulna.symbolic.exact.rank import generic_rank
from ulna.symbolic.exact.sample import SEED, random_points
from ulna.symbolic.exact.simplify import shortened, tidy
from ulna.symbolic.exact.zero import SampledZero
from ulna.symbolic.solving.algebraic import algebraic
from ulna.symbolic.solving.branch import on_branch, real_odd_roots
from ulna.symbolic.solving.inverse_check import InversionTask, comes_back, verified
from ulna.symbolic.solving.isolate import Base, Isolated, harmonic, linear_in, number_at, peeled, solved_branches

_SAMPLED = SampledZero(points=2, seconds=0)

_WIDTH = 3
"""Ways followed at each step of the elimination."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Inversion:
    """The inverse of a map on one branch.

    Attributes:
        expressions: the old coordinates in terms of the new ones, or None.
        verdict: on "the map is inverted on the branch through the base point"; if it does not hold, what was tried.
        nonzero: expressions in the new coordinates that must not vanish.
        positive: expressions in the new coordinates that must be positive.
    """

    expressions: tuple[sp.Expr, ...] | None
    verdict: Verdict
    nonzero: tuple[sp.Expr, ...] = ()
    positive: tuple[sp.Expr, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _State:
    """An elimination under way: `steps` hold in their order, each free of the unknowns of the earlier ones."""

    equations: tuple[sp.Expr, ...]
    unknowns: tuple[sp.Symbol, ...]
    steps: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    nonzero: tuple[sp.Expr, ...] = ()
    positive: tuple[sp.Expr, ...] = ()


def invert_map(
    forward: Sequence[sp.Expr],
    old: Sequence[sp.Symbol],
    new: Sequence[sp.Symbol],
    *,
    near: Mapping[sp.Symbol, sp.Expr],
    seconds: float = 3.0,
) -> Inversion:
    """x = S(z) with z = T(x), on the branch with S(T(x)) = x near the base point.

    Equations are solved one after the other: for an unknown that is alone or enters linearly, then through
    functions of one argument, then by SymPy's `solve`; the rest is substituted. Where the Jacobian is singular at
    the base point, a regular point beside it is taken and named in the evidence.

    Args:
        forward: (n,) T(x), may contain parameters.
        old: (n,) x.
        new: (n,) z.
        near: a value for each of `old`; for parameters too where the branch may depend on them.
        seconds: s, for everything.
    """
    claim = "the map is inverted on the branch through the base point"
    expressions = tuple(sp.sympify(one) for one in forward)
    start, moved = _regular_base(expressions, tuple(old), near)
    if start is None:
        return Inversion(expressions=None, verdict=Verdict.undecided(claim, tried="no regular point near the base"))
    parameters = [leaf for leaf in leaves_of(expressions) if leaf not in old]
    # Where no values are given, positive numbers of middling size; they only tell the branches apart.
    values = next(islice(random_points(parameters, seed=SEED), 1, None))
    values |= {leaf: sp.sympify(near[leaf]) for leaf in parameters if leaf in near}
    base: dict[sp.Basic, sp.Expr] = {**values, **{x: start[x].xreplace(values) for x in old}}
    base |= {z: one.xreplace(base) for z, one in zip(new, expressions, strict=True)}
    task = InversionTask(forward=expressions, old=tuple(old), new=tuple(new), base=base, seconds=seconds)
    evidence: dict[str, object] = {"base": start} if moved else {}
    rejected: list[str] = []
    given = {x: sp.sympify(near.get(x, 0)) for x in old}
    answer = attempt_exactly(seconds, "invert the map", _first_verified, task, start, given, claim, evidence, rejected)
    if answer.value is not None:
        return answer.value
    tried = answer.reason or "elimination one unknown at a time, SymPy's solve for the whole"
    return Inversion(expressions=None, verdict=Verdict.undecided(claim, tried=tried, rejected=tuple(rejected)))


def _regular_base(
    forward: tuple[sp.Expr, ...], old: tuple[sp.Symbol, ...], near: Mapping[sp.Symbol, sp.Expr]
) -> tuple[dict[sp.Symbol, sp.Expr] | None, bool]:
    """The base point, or a point beside it where the Jacobian is regular; and whether it was moved."""
    jacobian = sp.Matrix(forward).jacobian(list(old))
    given = {x: sp.sympify(near.get(x, 0)) for x in old}
    values = {leaf: value for leaf, value in near.items() if leaf not in old}
    for shift in (0, sp.Rational(1, 8), sp.Rational(1, 3), 1):
        point = {x: value + shift * (1 + sp.Rational(k, 7)) for k, (x, value) in enumerate(given.items())}
        local = [entry.xreplace(point) for entry in (*jacobian, *forward)]
        if any(entry.has(sp.nan, sp.zoo, sp.oo) for entry in local):
            continue
        slopes = [entry.xreplace(values) for entry in local[: len(jacobian)]]
        rank = generic_rank(sp.Matrix(*jacobian.shape, slopes), seconds=0)
        if rank.point is not None and rank.value == len(old):
            return point, shift != 0
    return None, False


def _first_verified(
    task: InversionTask,
    start: dict[sp.Symbol, sp.Expr],
    given: dict[sp.Symbol, sp.Expr],
    claim: str,
    evidence: dict[str, object],
    rejected: list[str],
) -> Inversion | None:
    first = _State(equations=tuple(one - z for one, z in zip(task.forward, task.new, strict=True)), unknowns=task.old)
    for state in chain(_eliminated(first, task), _solved_as_a_whole(first, task)):
        solution = _back_substituted(state, task.base)
        plain = tuple(solution[x] for x in task.old)
        quick = comes_back(task, start, plain)
        if quick.fails:
            rejected.append(f"{plain}: {quick}")
            continue
        expressions = tuple(tidy(solution[x], seconds=0.3) for x in task.old)
        verdict = verified(task, start, expressions, claim, evidence)
        if verdict.holds:
            if evidence:
                expressions = _on_both_sides(task, given, expressions)
            nonzero, positive = _conditions(state, solution)
            return Inversion(expressions=expressions, verdict=verdict, nonzero=nonzero, positive=positive)
        rejected.append(f"{expressions}: {verdict}")
    return None


def _on_both_sides(
    task: InversionTask, given: dict[sp.Symbol, sp.Expr], expressions: tuple[sp.Expr, ...]
) -> tuple[sp.Expr, ...]:
    """Odd roots as real numbers on both sides of zero, where that is the inverse all around the given point too."""
    both = tuple(real_odd_roots(one) for one in expressions)
    return both if both != expressions and comes_back(task, given, both).holds else expressions


def _eliminated(state: _State, task: InversionTask) -> Iterator[_State]:
    """Every way found to reduce the equations to none, the most promising first."""
    if not state.unknowns:
        yield state
        return
    smaller = _linear_block(state, task)
    if smaller is not None:
        yield from _eliminated(smaller, task)
        return
    state = _with_fewer_unknowns(state, task)
    for unknown, place, isolated in islice(_moves(state, task), _WIDTH):
        rest = [one for k, one in enumerate(state.equations) if k != place]
        substituted = [one.xreplace({unknown: isolated.expression}) for one in rest]
        if not isolated.expression.is_Symbol:
            substituted = [shortened(on_branch(one, task.base)) for one in substituted]
        yield from _eliminated(
            _State(
                equations=tuple(substituted),
                unknowns=tuple(x for x in state.unknowns if x != unknown),
                steps=(*state.steps, (unknown, isolated.expression)),
                nonzero=state.nonzero + isolated.nonzero,
                positive=state.positive + isolated.positive,
            ),
            task,
        )


def _with_fewer_unknowns(state: _State, task: InversionTask) -> _State:
    """The state with equations replaced by a ratio or sum of squares of two that has fewer unknowns.

    This finds the angles and radii of polar and spherical coordinates: r cos(a) = v and r sin(a) = w give
    tan(a) = w / v.
    """
    equations = list(state.equations)
    if any(linear_in(one, x) for one in equations for x in state.unknowns if len(_unknowns(state, one)) == 1):
        return state
    for combine in (_ratio, _sum_of_squares):
        for place, one in enumerate(equations):
            for other in state.equations:
                if one == other or len(_unknowns(state, one)) < 2 or _unknowns(state, one) != _unknowns(state, other):
                    continue
                derived = _fewer(state, one, other, combine, task.base)
                if derived is not None:
                    equations[place] = derived
                    below = (other.as_independent(*state.unknowns, as_Add=True)[0],) if combine is _ratio else ()
                    return replace(state, equations=tuple(equations), nonzero=state.nonzero + below)
    return state


def _fewer(
    state: _State, one: sp.Expr, other: sp.Expr, combine: Callable[[sp.Expr, sp.Expr], sp.Expr], base: Base
) -> sp.Expr | None:
    right, left = one.as_independent(*state.unknowns, as_Add=True)
    right_other, left_other = other.as_independent(*state.unknowns, as_Add=True)
    if right == 0 or right_other == 0:
        return None
    combined = combine(left, left_other)
    if not any(_SAMPLED(combined.diff(x)).holds for x in _unknowns(state, combined)):
        return None
    short = tidy(combined, seconds=0.3)
    if not short.has(*state.unknowns) or len(_unknowns(state, short)) >= len(_unknowns(state, one)):
        return None
    derived = short - combine(-right, -right_other)
    return derived if math.isfinite(number_at(derived, base)) else None


def _ratio(one: sp.Expr, other: sp.Expr) -> sp.Expr:
    return one / other


def _sum_of_squares(one: sp.Expr, other: sp.Expr) -> sp.Expr:
    return one**2 + other**2


def _unknowns(state: _State, expression: sp.Expr) -> frozenset[sp.Symbol]:
    return frozenset(x for x in state.unknowns if expression.has(x))


def _linear_block(state: _State, task: InversionTask) -> _State | None:
    """The state with a block of unknowns solved for: as many equations as unknowns, linear in them, without others.

    The smallest block is taken. An equation that holds a single unknown is better solved by itself: the exact field in
    which several are solved together would write cos(3θ) as a polynomial in cos(θ).
    """
    own = [_unknowns(state, one) for one in state.equations]
    for block in sorted({u for u in own if len(u) > 1}, key=lambda u: (len(u), sorted(map(str, u)))):
        places = [k for k, unknowns in enumerate(own) if unknowns <= block]
        unknowns = [x for x in state.unknowns if x in block]
        if len(places) != len(unknowns) or any(len(own[k]) < 2 for k in places):
            continue
        equations = sp.Matrix([state.equations[k] for k in places])
        matrix = equations.jacobian(unknowns)
        if matrix.has(*unknowns):
            continue
        found = solve_linear(matrix, -equations.xreplace(dict.fromkeys(unknowns, sp.S.Zero)))
        if found.solution is None:
            continue
        solved = dict(zip(unknowns, found.solution, strict=True))
        rest = [one for k, one in enumerate(state.equations) if k not in places]
        return _State(
            equations=tuple(shortened(on_branch(one.xreplace(solved), task.base)) for one in rest),
            unknowns=tuple(x for x in state.unknowns if x not in block),
            steps=(*state.steps, *solved.items()),
            nonzero=state.nonzero + (() if found.determinant.is_number else (found.determinant,)),
            positive=state.positive,
        )
    return None


def _moves(state: _State, task: InversionTask) -> Iterator[tuple[sp.Symbol, int, Isolated]]:
    """Unknown, equation and solution; equations with few unknowns and linear ones first."""
    for place, equation in enumerate(state.equations):
        for unknown in _unknowns(state, equation) if len(_unknowns(state, equation)) == 1 else ():
            alone = linear_in(equation, unknown)
            if alone is not None:
                yield unknown, place, alone
                return
    pairs = [
        (place, unknown)
        for place, equation in enumerate(state.equations)
        for unknown in state.unknowns
        if equation.has(unknown)
    ]
    others = {pair: _others(state, *pair) for pair in pairs}
    linear = {pair: linear_in(state.equations[pair[0]], pair[1]) for pair in pairs}

    def cost(pair: tuple[int, sp.Symbol]) -> tuple[int, int, int]:
        found = linear[pair]
        if found is None:
            return (2, others[pair], sp.count_ops(state.equations[pair[0]]))
        clean = not any(one.has(*state.unknowns) for one in found.nonzero)
        return (0 if clean else 1 if others[pair] else 0, others[pair], sp.count_ops(found.expression))

    later: list[tuple[int, sp.Symbol]] = []
    for pair in sorted(pairs, key=cost):
        place, unknown = pair
        isolated = linear[pair] or peeled(state.equations[place], unknown, task.base)
        if isolated is None:
            later.append(pair)
        else:
            yield unknown, place, isolated
    later.sort(key=lambda pair: others[pair])
    hard: list[tuple[int, sp.Symbol]] = []
    for place, unknown in later:
        equation = state.equations[place]
        isolated = algebraic(equation, unknown, task.base) or harmonic(equation, unknown, task.base)
        if isolated is None:
            hard.append((place, unknown))
        else:
            yield unknown, place, isolated
    for place, unknown in hard:
        for isolated in solved_branches(state.equations[place], unknown, task.base, seconds=task.seconds / 4):
            yield unknown, place, isolated


def _others(state: _State, place: int, unknown: sp.Symbol) -> int:
    return len(_unknowns(state, state.equations[place]) - {unknown})


def _solved_as_a_whole(state: _State, task: InversionTask) -> Iterator[_State]:
    """SymPy's solutions of all equations together; the verification picks the branch."""
    found = attempt(task.seconds / 2, "solve", sp.solve, state.equations, state.unknowns, dict=True)
    for solution in found.value or []:
        if set(solution) == set(state.unknowns) and not any(one.has(sp.I) for one in solution.values()):
            yield replace(state, equations=(), unknowns=(), steps=tuple(solution.items()))


def _back_substituted(state: _State, base: Base) -> dict[sp.Symbol, sp.Expr]:
    solution: dict[sp.Symbol, sp.Expr] = {}
    for unknown, expression in reversed(state.steps):
        solution[unknown] = on_branch(expression.xreplace(solution), base)
    return solution


def _conditions(state: _State, solution: dict[sp.Symbol, sp.Expr]) -> tuple[tuple[sp.Expr, ...], tuple[sp.Expr, ...]]:
    nonzero = [shortened(one.xreplace(solution)) for one in state.nonzero]
    positive = [shortened(one.xreplace(solution)) for one in state.positive]
    return (
        tuple(dict.fromkeys(one for one in nonzero if not one.is_nonzero)),
        tuple(dict.fromkeys(one for one in positive if not one.is_positive)),
    )
