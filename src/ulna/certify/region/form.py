"""`Form`: a limited loop in the coordinates in which it is most nearly linear: ζ' = g(ζ) + β(ζ) (s − k(ζ))."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from ulna.certify.errors import CertifyError
from ulna.certify.region.limited import Limited
from ulna.loop import Loop
from ulna.program import to_numpy
from ulna.symbolic.compiling import kernel
from ulna.symbolic.exact import tidy
from ulna.system import given_point

_SECONDS = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Form:
    """A limited loop in coordinates ζ = T(x).

    Attributes:
        limited: the loop in its own states x. symbols: ζ. forward: T in x. inverse: T⁻¹ in ζ.
        closed: g, the rates where no limit is met. gains: (n, m) β. commands: k in ζ.
        outer: how many coordinates come before those of a linear part e' = A e that depends on itself alone, the error
            of an exact observer; all of them where there is none.
    """

    limited: Limited
    symbols: tuple[sp.Symbol, ...]
    forward: tuple[sp.Expr, ...]
    inverse: tuple[sp.Expr, ...]
    closed: tuple[sp.Expr, ...]
    gains: sp.ImmutableDenseMatrix
    commands: tuple[sp.Expr, ...]
    outer: int


def form_of(loop: Loop, limited: Limited) -> Form:
    """The loop in the coordinates of its design where these are known, else in its own states.

    An exact law on the whole state makes the chain z = T(x) linear, an exact observer the error of its own coordinates.

    Raises:
        CertifyError: a limited signal that enters otherwise than linearly.
    """
    found = _design_coordinates(loop, limited)
    made = None if found is None else _in_coordinates(limited, *found)
    return in_states(limited) if made is None else made


def in_states(limited: Limited) -> Form:
    """The loop in its own states.

    Raises:
        CertifyError: a limited signal that enters otherwise than linearly.
    """
    own = list(limited.symbols)
    made = _in_coordinates(limited, own, own, own)
    if made is None:
        raise CertifyError(
            f"a proof for '{limited.name}'", "a limited signal does not enter linearly.", "Use another input for it."
        )
    return made


def _in_coordinates(
    limited: Limited, symbols: Sequence[sp.Symbol], forward: Sequence[sp.Expr], inverse: Sequence[sp.Expr]
) -> Form | None:
    """None where a limited signal enters otherwise than linearly."""
    back = dict(zip(limited.symbols, inverse, strict=True))
    slope = sp.Matrix(list(forward)).jacobian(list(limited.symbols))
    moved = slope * sp.Matrix(limited.rates)
    s = list(limited.limited)
    gains = moved.jacobian(s) if s else sp.zeros(len(moved), 0)
    gains = gains.xreplace(back).applyfunc(_short)
    if any(e.has(*s) for e in gains) if s else False:
        return None
    commands = tuple(_short(e.xreplace(back)) for e in limited.commands)
    whole = moved.xreplace(dict(zip(s, limited.commands, strict=True))).xreplace(back)
    closed = tuple(_short(e) for e in whole)
    return Form(
        limited=limited,
        symbols=tuple(symbols),
        forward=tuple(forward),
        inverse=tuple(inverse),
        closed=closed,
        gains=sp.ImmutableDenseMatrix(gains),
        commands=commands,
        outer=_outer(symbols, closed, gains),
    )


def start_of(loop: Loop, form: Form) -> np.ndarray:
    """Where the equilibrium is looked for: the operating point of the plant's file, estimates equal to it."""
    known = {name: float(value) for name, value in given_point(loop.plant).numbers.items()}
    given = getattr(loop.controller, "initial", None)
    known |= {name: float(value) for name, value in given.items()} if isinstance(given, Mapping) else {}
    states = form.limited.states
    point = [known.get(s.name, known.get(s.name.removesuffix("_hat"), 0.0)) for s in states]
    return moved(form, np.array(point)[:, None])[:, 0]


def moved(form: Form, points: np.ndarray, *, back: bool = False) -> np.ndarray:
    """(n, N) points x as ζ, or back."""
    given, taken = (form.symbols, form.inverse) if back else (form.limited.symbols, form.forward)
    evaluate = to_numpy(kernel("map", list(given), {f"m{k}": e for k, e in enumerate(taken)}))
    return np.array([np.broadcast_to(row, points.shape[1:]) for row in evaluate(*points)], dtype=float)


def without_errors(form: Form) -> Form:
    """The coordinates before the errors, the errors at 0; their terms cancel in the formulas, not in balls."""
    k = form.outer
    gone = dict.fromkeys(form.symbols[k:], sp.Integer(0))
    return replace(
        form,
        symbols=form.symbols[:k],
        inverse=tuple(e.xreplace(gone) for e in form.inverse),
        closed=tuple(_short(e.xreplace(gone)) for e in form.closed[:k]),
        gains=sp.ImmutableDenseMatrix(form.gains[:k, :].xreplace(gone).applyfunc(_short)),
        commands=tuple(_short(e.xreplace(gone)) for e in form.commands),
    )


def _outer(symbols: Sequence[sp.Symbol], closed: Sequence[sp.Expr], gains: sp.MatrixBase) -> int:
    """Where the linear part that depends on itself alone begins."""
    n = len(symbols)
    for start in range(1, n):
        inner = set(symbols[start:])
        linear = all(e.free_symbols <= inner and sp.diff(e, s).is_Rational for e in closed[start:] for s in inner)
        if (
            linear
            and not any(gains[start:, :])
            and not any(e.xreplace(dict.fromkeys(inner, 0)) for e in closed[start:])
        ):
            return start
    return n


def _short(expression: sp.Expr) -> sp.Expr:
    return tidy(sp.expand(expression), seconds=_SECONDS)


def _design_coordinates(loop: Loop, limited: Limited) -> tuple[list[sp.Symbol], list[sp.Expr], list[sp.Expr]] | None:
    """ζ, T and T⁻¹ of an exact design; None where there is none, or no inverse."""
    law = getattr(loop.controller, "law", loop.controller)
    form, observer = getattr(law, "form", None), getattr(loop.controller, "observer", None)
    n, x = len(loop.plant.states), list(limited.symbols)
    chain = _values(getattr(form, "chain", ()), loop)
    if form is None or len(chain) != n or form.map.inverse is None:
        return None
    z = [sp.Symbol(f"z{k + 1}", real=True) for k in range(n)]
    old = dict(zip(form.map.old, x[:n], strict=True))
    forward = [e.xreplace(old) for e in chain]
    inverse = [e.xreplace(dict(zip(form.map.new, z, strict=True))) for e in _values(form.map.inverse, loop)]
    rest = x[n:]
    symbols = list(z)
    if observer is not None and getattr(observer, "form", None) is not None:
        more = _error_coordinates(observer, loop, x, z, inverse)
        if more is not None:
            e, ahead, back = more
            symbols, forward, inverse = [*symbols, *e], [*forward, *ahead], [*inverse, *back]
            rest = rest[len(e) :]
    taken = {s.name for s in symbols}
    kept = [sp.Symbol(s.name if s.name not in taken else f"{s.name}_own", real=True) for s in rest]
    return [*symbols, *kept], [*forward, *rest], [*inverse, *kept]


def _error_coordinates(
    observer: Any, loop: Loop, x: list[sp.Symbol], z: list[sp.Symbol], inverse: list[sp.Expr]
) -> tuple[list[sp.Symbol], list[sp.Expr], list[sp.Expr]] | None:
    """The error in the observer's coordinates: its symbols, how it follows from x, and the states from it."""
    n, inner = len(z), observer.form.map
    own = x[n : 2 * n]
    if inner.inverse is None or len(own) != n or len(observer.system.states) != n:
        return None
    seen = [t.xreplace(dict(zip(inner.old, x[:n], strict=True))) for t in _values(inner.forward, loop)]
    e = [sp.Symbol(f"e{k + 1}", real=True) for k in range(n)]
    plant = dict(zip(x[:n], inverse, strict=True))
    whole = [a + t.xreplace(plant) for a, t in zip(e, seen, strict=True)]
    if observer.sampled is not None:
        # Its states are the coordinates themselves.
        return e, [o - t for o, t in zip(own, seen, strict=True)], whole
    estimated = [t.xreplace(dict(zip(inner.old, own, strict=True))) for t in _values(inner.forward, loop)]
    back = [t.xreplace(dict(zip(inner.new, whole, strict=True))) for t in _values(inner.inverse, loop)]
    return e, [a - b for a, b in zip(estimated, seen, strict=True)], back


def _values(expressions: Any, loop: Loop) -> list[sp.Expr]:
    return [e.xreplace(dict(loop.plant.values)) for e in expressions]
