"""What a law says at states given as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ulna.base import DesignError
from ulna.program import to_numpy
from ulna.symbolic.compiling import kernel
from ulna.system import System


def commands(plant: System, law: System, states: Any, given: Mapping[str, Any]) -> np.ndarray:
    """(m,) the plant's inputs, for (N, n) states (N, m), in SI.

    Args:
        plant: what the law is for.
        law: the law as a system, its inputs states of the plant and references.
        states: (n,) or (N, n) in the plant's order, or a mapping by name.
        given: by name references, states of the law (0 where left out) and parameters (their own value).

    Raises:
        DesignError: for another number of states, an unknown name, or a value that is missing.
    """
    asked = f"the law of '{plant.name}' at a state"
    values = dict(zip((s.name for s in plant.states), _columns(plant, states, asked), strict=True))
    values |= {p.name: float(p.si_value) for p in law.parameters if p.si_value is not None}
    values |= {s.name: 0.0 for s in law.states}
    known = [*(s.name for s in (*law.inputs, *law.states)), *(p.name for p in law.parameters)]
    unknown = [name for name in given if name not in known or name in {s.name for s in plant.states}]
    if unknown:
        free = ", ".join(name for name in known if name not in {s.name for s in plant.states}) or "none"
        raise DesignError(asked, f"it has no reference or parameter {', '.join(unknown)}.", f"Known: {free}.")
    values |= given
    missing = [name for name in known if name not in values]
    if missing:
        raise DesignError(asked, f"no value is given for {', '.join(missing)}.", f"Write law(x, {missing[0]}=...).")
    symbols = [*(s.symbol for s in (*law.inputs, *law.states)), *law.parameter_symbols]
    formulas = {s.name: e for s, e in zip(law.outputs, law.inline(law.readouts), strict=True)}
    found = to_numpy(kernel(law.name, symbols, formulas))(*(values[name] for name in known))
    rows = dict(zip(formulas, found, strict=True))
    return np.stack([np.asarray(rows[u.name], dtype=float) for u in plant.inputs], axis=-1)


def _columns(plant: System, states: Any, asked: str) -> Sequence[Any]:
    """A number, or (N,) numbers, for each state."""
    names = [s.name for s in plant.states]
    if isinstance(states, Mapping):
        if set(states) != set(names):
            raise DesignError(
                asked, f"values are given for {', '.join(map(str, states))}.", f"Give {', '.join(names)}."
            )
        return [np.asarray(states[name], dtype=float) for name in names]
    rows = np.asarray(states, dtype=float)
    if rows.ndim not in (1, 2) or rows.shape[-1] != len(names):
        hint = f"Give {len(names)} numbers ({', '.join(names)}), or rows of as many."
        raise DesignError(asked, f"its shape is {rows.shape}.", hint)
    return list(rows.T)
