"""Whether a box of states about the equilibrium lies inside a level set of V."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp
from flint import arb

from ulna.base import Status
from ulna.certify.region.balls import ball
from ulna.certify.region.form import Form
from ulna.certify.region.rest import Rest
from ulna.program import to_balls
from ulna.symbolic.compiling import kernel
from ulna.symbolic.exact import is_zero

_DEEPEST = 14
"""How often a box is halved."""


def comes_back(form: Form) -> bool:
    """Whether T⁻¹(T(x)) = x as a formula: only then a box of x says what a set of ζ is."""
    ahead = dict(zip(form.symbols, form.forward, strict=True))
    off = [e.xreplace(ahead) - x for e, x in zip(form.inverse, form.limited.symbols, strict=True)]
    return all(sp.expand(e) == 0 or is_zero(e).status is Status.PROVED for e in off)


def inside(form: Form, found: Rest, P: sp.Matrix, level: sp.Rational, sides: Mapping[str, sp.Rational]) -> bool:
    """Whether V ≤ level wherever each named state is so near its place at the equilibrium and the others are there.

    Args:
        form: the loop. found: its equilibrium. P, level: of V. sides: half-widths by state.
    """
    x, n = list(form.limited.symbols), len(form.symbols)
    forward = to_balls(kernel("forward", x, {f"z{k}": e for k, e in enumerate(form.forward)}))
    back = to_balls(kernel("inverse", list(form.symbols), {f"x{k}": e for k, e in enumerate(form.inverse)}))
    rest, matrix, top = back(*found.balls), [[ball(v) for v in P.row(i)] for i in range(n)], ball(level)
    places = {[s.name for s in x].index(name): size for name, size in sides.items()}
    stack = [({k: (sp.Integer(0), size) for k, size in places.items()}, 0)]
    while stack:
        part, depth = stack.pop()
        point = list(rest)
        for k, (middle, half) in part.items():
            point[k] = rest[k] + ball(middle) + arb(0, 1) * ball(half)
        d = [v - c for v, c in zip(forward(*point), found.balls, strict=True)]
        total = arb(0)
        for i in range(n):
            for j in range(n):
                total += matrix[i][j] * d[i] * d[j]
        if total <= top:
            continue
        if depth >= _DEEPEST:
            return False
        axis = max(part, key=lambda k: part[k][1] / places[k] if places[k] else 0)
        middle, half = part[axis]
        stack += [({**part, axis: (middle + sign * half / 2, half / 2)}, depth + 1) for sign in (1, -1)]
    return True
