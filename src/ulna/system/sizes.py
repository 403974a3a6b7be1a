"""How long formulas become once their definitions are put in: told before they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp

from ulna.base import PlantError
from ulna.system.signal import Definition

_LONGEST = 300_000
"""Nodes of a formula with every definition put in: more takes minutes and gigabytes wherever it is used."""


def check_size(where: str, definitions: Sequence[Definition], formulas: Mapping[str, sp.Expr]) -> None:
    """Refuse definitions that grow too long where they are put into each other and into the formulas, by name.

    Raises:
        PlantError: naming the first formula that does.
    """
    if not definitions:
        return
    sizes: dict[sp.Symbol, int] = {}
    rows = [(f"definition '{d.name}'", d.symbol, d.expression) for d in definitions if not d.implicit]
    rows += [(f"formula of '{name}'", None, expression) for name, expression in formulas.items()]
    for what, symbol, expression in rows:
        size = sum(sizes.get(node, 1) for node in sp.preorder_traversal(expression))
        if size > _LONGEST:
            raise PlantError(
                f"{what} in '{where}'",
                f"with the definitions that it uses put in, it has some {float(size):.2g} terms (limit {_LONGEST}).",
                "Let definitions use each other less often, or make some of them states.",
            )
        if symbol is not None:
            sizes[symbol] = size
