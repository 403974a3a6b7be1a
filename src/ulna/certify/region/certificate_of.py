"""`certificate_of`: the certificate of a loop in its coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from ulna.certify.certificate import Certificate, Piece
from ulna.certify.region.balls import Slopes
from ulna.certify.region.rest import Rest
from ulna.loop import Loop, fingerprint


def certificate_of(
    loop: Loop,
    slopes: Slopes,
    found: Rest | None,
    *,
    theorem: str,
    P: sp.Matrix | None = None,
    level: str = "",
    tree: str = "",
    box: Mapping[str, str] | None = None,
    rates: Sequence[sp.Rational] = (),
    bounds: Mapping[str, tuple[sp.Rational, sp.Rational]] | None = None,
    splits: str = "",
    pieces: Sequence[Rest] = (),
) -> Certificate:
    """What a second program needs to check a theorem about a loop; the parts are those of `Certificate`."""
    form, limited = slopes.form, slopes.form.limited
    still = None if slopes.still is None else slopes.still.form
    return Certificate(
        name=limited.name,
        design=fingerprint(loop),
        theorem=theorem,
        states=tuple(s.name for s in limited.states),
        wires=tuple((symbol.name, str(formula)) for symbol, formula in limited.wires),
        rates=_texts(limited.raw),
        limited=tuple(s.name for s in limited.limited),
        lower=_texts(limited.lower),
        upper=_texts(limited.upper),
        coordinates=tuple(s.name for s in form.symbols),
        forward=_texts(form.forward),
        inverse=_texts(form.inverse),
        closed=_texts(form.closed),
        gains=_table(form.gains),
        moved_commands=_texts(form.commands),
        outer=form.outer,
        still_closed=() if still is None else _texts(still.closed),
        still_gains=() if still is None else _table(still.gains),
        still_commands=() if still is None else _texts(still.commands),
        center=_texts(found.center) if found else (),
        radii=_texts(found.radii) if found else (),
        P=_table(P) if P is not None else (),
        level=level,
        tree=tree,
        box=dict(box or {}),
        decay=_texts(rates),
        parameters=tuple((name, str(low), str(high)) for name, (low, high) in (bounds or {}).items()),
        splits=splits,
        pieces=tuple(Piece(center=_texts(each.center), radii=_texts(each.radii)) for each in pieces),
    )


def _texts(expressions: Any) -> tuple[str, ...]:
    return tuple(str(e) for e in expressions)


def _table(matrix: sp.MatrixBase) -> tuple[tuple[str, ...], ...]:
    return tuple(_texts(matrix.row(i)) for i in range(matrix.shape[0]))
