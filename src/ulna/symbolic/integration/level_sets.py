"""Level sets F(x) = c solved for one coordinate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sympy import Dummy, Expr, Symbol, solve

from ulna.symbolic.exact.attempts import attempt
from ulna.symbolic.exact.zero import vanishes

_SECONDS = 1.0


def constant_of(function: Expr, point: Mapping[Symbol, Expr]) -> Symbol:
    """A new symbol for the value of the function near the point; a known sign spares case distinctions."""
    value = function.subs(list(point.items()))
    return Dummy("c", positive=True) if value.is_positive else Dummy("c", real=True)


def solved_for_a_coordinate(
    function: Expr, constant: Symbol, coordinates: Sequence[Symbol]
) -> tuple[Symbol, Expr] | None:
    """A coordinate x and its value on the level set function = constant, by the easiest equation.

    Of several branches the one is taken that gives x back for positive values of the roots in it.
    """

    def ease(x: Symbol) -> tuple[bool, bool, int]:
        slope = function.diff(x)
        return (bool(slope.free_symbols & set(coordinates)), x in slope.free_symbols, slope.count_ops())

    for x in sorted(coordinates, key=ease):
        found = attempt(_SECONDS, f"solve for {x}", solve, function - constant, x)
        for branch in found.value or []:
            if vanishes(branch.subs(constant, function) - x):
                return x, branch
    return None
