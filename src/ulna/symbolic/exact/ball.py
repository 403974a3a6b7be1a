"""Numbers with rigorous error bounds for expressions: kernels in ball arithmetic, nothing rounded on the way there.

Ball arithmetic decides "not zero" with certainty: a ball that excludes 0 is a proof at that point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint
import sympy as sp
from flint import arb, fmpq
from sympy.core.function import AppliedUndef
from sympy.functions.elementary.piecewise import ExprCondPair

from ulna.program import Kernel, pruned, to_balls
from ulna.symbolic.compiling.sympy_reader import SympyReader, is_exact


class RootWhereReal(sp.Function):
    """√a on the part of a ball where a ≥ 0: encloses every real value that √a has in it."""


_NAN = arb("nan")
_OTHERS: dict[Any, Callable[..., arb]] = {
    sp.pi: arb.pi,
    sp.E: arb.const_e,
    sp.erf: arb.erf,
    RootWhereReal: lambda value: value.nonnegative_part().sqrt(),
    sp.LambertW: lambda value, *branch: value.lambertw() if not branch else _NAN,
}
"""Constants and functions that a kernel does not have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tape:
    """Expressions as a kernel: inputs are the leaves, then the values of what a kernel cannot express."""

    leaves: tuple[sp.Basic, ...]
    size: int
    rigorous: bool
    """Whether the values are enclosures for wide balls, too: no function goes through SymPy's floats."""
    _others: tuple[tuple[Callable[..., arb], Tape], ...]
    _balls: Callable[..., tuple[arb, ...]]

    def __call__(self, point: Mapping[sp.Basic, sp.Expr], digits: int = 40) -> list[arb]:
        """Balls that contain the exact values; a value that does not exist as a real number is a NaN ball."""
        with flint.ctx.workprec(math.ceil(digits * 3.33) + 16):
            return self.at({leaf: exact_ball(point[leaf]) for leaf in self.leaves})

    def at(self, balls: Mapping[sp.Basic, arb]) -> list[arb]:
        """The same from balls of the leaves, in the working precision of the moment."""
        others = [function(*arguments.at(balls)) for function, arguments in self._others]
        return list(self._balls(*(balls[leaf] for leaf in self.leaves), *others))


def is_leaf(expression: sp.Basic) -> bool:
    """True for what gets a value of its own: symbols, undefined functions and their derivatives."""
    return isinstance(expression, sp.Symbol | AppliedUndef | sp.Derivative | sp.Integral | sp.Subs)


def leaves_of(expressions: Sequence[sp.Basic]) -> tuple[sp.Basic, ...]:
    """Everything in the expressions that needs a value, in a fixed order."""
    found: set[sp.Basic] = set()
    seen: set[sp.Basic] = set()
    waiting = list(expressions)
    while waiting:
        one = waiting.pop()
        if one in seen:
            continue
        seen.add(one)
        if is_leaf(one):
            found.add(one)
        else:
            waiting.extend(one.args)
    return tuple(sorted(found, key=lambda leaf: (str(leaf), leaf.sort_key())))


def tape(expressions: Sequence[sp.Basic]) -> Tape:
    """The kernel of the expressions, ready for balls; equal subexpressions are evaluated once."""
    leaves = leaves_of(expressions)
    others = _others_in(expressions)
    inputs = (*leaves, *others)
    reader = SympyReader("balls", inputs, exact=True)
    read = [reader.index_of(expression) for expression in expressions]
    instructions, results = pruned(len(inputs), reader.listing.instructions, read)
    kernel = Kernel(
        name="balls",
        inputs=tuple(map(str, range(len(inputs)))),
        outputs=tuple(map(str, range(len(results)))),
        instructions=instructions,
        results=results,
    )
    functions = tuple((_function(node), tape(node.args)) for node in others)
    return Tape(
        leaves=leaves,
        size=len(instructions),
        rigorous=all(map(_encloses, others)) and all(inner.rigorous for _, inner in functions),
        _others=functions,
        _balls=to_balls(kernel),
    )


def exact_ball(value: sp.Basic | float) -> arb:
    """The ball of a rational number (radius: rounding only) or of another real constant."""
    number = sp.sympify(value)
    if isinstance(number, sp.Float):
        number = sp.Rational(number)
    if isinstance(number, sp.Rational):
        return arb(fmpq(int(number.p), int(number.q)))
    constant = tape([number])
    return _NAN if constant.leaves else constant.at({})[0]


def _others_in(expressions: Sequence[sp.Basic]) -> tuple[sp.Basic, ...]:
    """The outermost nodes that a kernel cannot express."""
    found: dict[sp.Basic, None] = {}
    seen: set[sp.Basic] = set()
    waiting = list(expressions)
    while waiting:
        one = waiting.pop()
        if one in seen or is_leaf(one):
            continue
        seen.add(one)
        if is_exact(one) or isinstance(one, ExprCondPair):
            waiting.extend(one.args)
        else:
            found[one] = None
    return tuple(found)


def _function(node: sp.Basic) -> Callable[..., arb]:
    """What to call for a node that a kernel cannot express, on the balls of its arguments."""
    known = _OTHERS.get(node, _OTHERS.get(node.func))
    if known is not None:
        return known
    if isinstance(node, sp.Rational | sp.Float) and node.is_finite:
        return lambda: exact_ball(node)
    if isinstance(node, sp.NumberSymbol):
        return lambda: _from_evalf(node)
    return _by_evalf(node.func) if isinstance(node, sp.Function) else lambda *_: _NAN


def _encloses(node: sp.Basic) -> bool:
    """Whether what `_function` gives for a node encloses all values on the balls of its arguments."""
    return node in _OTHERS or node.func in _OTHERS or not isinstance(node, sp.Function)


def _by_evalf(function: Callable[..., Any]) -> Callable[..., arb]:
    def value(*arguments: arb) -> arb:
        digits = flint.ctx.dps
        floats = [sp.Float(argument.mid().str(digits + 5, radius=False), digits + 5) for argument in arguments]
        return _from_evalf(function(*floats)) if all(argument.is_finite() for argument in arguments) else _NAN

    return value


def _from_evalf(expression: sp.Expr) -> arb:
    # SymPy gives no error bound: the ball claims ten digits less than were asked for.
    digits = flint.ctx.dps
    value = expression.evalf(digits)
    if not isinstance(value, sp.Float):
        return _NAN
    middle = arb(str(value))
    return middle + arb(0, (abs(middle) + 1).mid() * arb(10) ** (10 - digits))
