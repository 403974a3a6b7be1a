"""Whether the fixed steps of a sampled run met a jump of the plant at which the motion would stick or slide."""

from __future__ import annotations

import numpy as np
import sympy as sp

from ulna.program import GUARD, restricted, surfaces_of, tangents, to_numpy, with_modes
from ulna.sim.trajectory import Trajectory
from ulna.symbolic.compiling import kernel

MANY = 3
"""Samples in a row that are held before it is said."""


def chatter(run: Trajectory, period: float) -> str:
    """One line about where fixed steps chatter about a jump that would hold the motion; empty where they do not.

    Args:
        run: at its samples. period: s, between two of them.
    """
    system = run.system
    if len(run.times) < MANY or not any(rate.has(sp.sign, sp.Piecewise, sp.Heaviside) for rate in system.rates):
        return ""
    symbols = [*system.state_symbols, *system.input_symbols, *system.parameter_symbols]
    names = {f"{s.name}'": rate for s, rate in zip(system.states, system.inline(system.rates), strict=True)}
    still = tuple(s.name for s in (*system.inputs, *system.parameters))
    whole = kernel(system.name, symbols, names)
    moded, surfaces = with_modes(whole), surfaces_of(whole, still)
    if len(surfaces) != moded.guards:
        return ""
    evaluate = to_numpy(moded.kernel)
    guards = [f"{GUARD}{k}" for k in range(moded.guards)]
    states = [s.name for s in system.states]
    normals = to_numpy(tangents(restricted(moded.kernel, guards), states, piecewise=True))
    given = [*run.states.T, *run.inputs.T, *(run.parameters[p.name] for p in system.parameters)]
    count, shape = len(states), run.times.shape
    with np.errstate(all="ignore"):
        values = np.stack([np.broadcast_to(v, shape) for v in evaluate(*given, *[0.0] * moded.guards)])[count:]
        modes = list(np.sign(values))
        slopes = np.stack([np.broadcast_to(v, shape) for v in normals(*given, *modes)]).reshape(count, -1, *shape)
        for k, surface in enumerate(surfaces):
            above, below = (
                sum(s * r for s, r in zip(slopes[:, k], evaluate(*given, *_with(modes, k, side))[:count], strict=True))
                for side in (1.0, -1.0)
            )
            held = (above < 0.0) & (below > 0.0) & (np.abs(values[k]) <= period * np.maximum(-above, below))
            rows = np.flatnonzero(np.convolve(held, np.ones(MANY), "valid") >= MANY)
            if len(rows):
                return (
                    f"{surface} holds the plant from about t = {run.times[rows[0]]:.6g} s on; steps of a sampled loop"
                    " go to and fro about it, and what sticks may creep: shorten the period, or run the plant alone"
                )
    return ""


def _with(modes: list[np.ndarray], place: int, side: float) -> list[np.ndarray | float]:
    return [*modes[:place], side, *modes[place + 1 :]]
