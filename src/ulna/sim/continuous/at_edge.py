"""The name of the edge at which a run came to its end, if it was one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ulna.program import Edges, to_numpy
from ulna.sim.inputs import TIME, Input, input_values

CLOSE = 1e-9
"""A value below this part of its largest one along the run is at zero."""

ROWS = 64
"""Rows of a run that are looked at, about."""


def edge_met(
    edges: Edges,
    times: np.ndarray,
    states: Mapping[str, np.ndarray],
    inputs: Mapping[str, Input],
    held: Mapping[str, float],
) -> str | None:
    """What happened at the end of a run, "the denominator x reaches 0"; None where it met no edge.

    Args:
        edges: of the right-hand side. times: (N,) s. states: (N,) by name. inputs: what drove the run.
        held: parameters, and inputs that were left out.
    """
    if not edges.names:
        return None
    rows = np.unique(np.append(np.arange(0, len(times), len(times) // ROWS + 1), len(times) - 1))
    known: dict[str, np.ndarray | float] = {name: values[rows] for name, values in states.items()}
    known |= {TIME.name: times[rows], **held}
    known |= {name: input_values(given, times[rows], held) for name, given in inputs.items()}
    # Whatever says at which limit an input stands: no limit.
    arguments = [known.get(name, 0.0) for name in edges.kernel.inputs]
    with np.errstate(all="ignore"):
        found = np.stack([np.broadcast_to(row, rows.shape) for row in to_numpy(edges.kernel)(*arguments)])
        sizes = np.nanmax(np.abs(found), axis=1, initial=0.0)
        parts = np.where(sizes > 0.0, np.abs(found[:, -1]) / sizes, 0.0)
    closest = int(np.nanargmin(parts)) if np.isfinite(parts).any() else 0
    return edges.names[closest] if parts[closest] <= CLOSE else None
