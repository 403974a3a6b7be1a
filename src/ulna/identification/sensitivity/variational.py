"""The variational equations of a system, integrated beside its motion."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ulna.program import Assembly, Hoisted, Kernel, Operation, hoist, slopes_along, to_python, with_modes

MOST_STEPS = 20_000
"""Steps between two changes of the input; a motion that needs more is given up."""

KINKED = 4
"""Steps at least between two samples where the right-hand side has kinks: a series knows one side only."""

COMPACT_ABOVE = 60
"""Differential equations above which straight code takes longer to compile than it is worth."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """What is integrated: a kernel of rates, or in discrete time of the next states, and what its inputs are.

    Attributes:
        kernel: inputs states, inputs, parameters; outputs the rates (discrete: the next states) in order.
        states, inputs, parameters: names. along: names of states (their first values) and parameters.
        ramps: (m,) whether an input is a straight line between two edges; else it is constant there.
        sizes: (n,) powers of two that states are divided by inside.
    """

    kernel: Kernel
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    along: tuple[str, ...]
    ramps: tuple[bool, ...]
    sizes: tuple[float, ...]

    @property
    def columns(self) -> int:
        """Numbers of a row: the states, then for each name in `along` the slope of every state."""
        return len(self.states) * (1 + len(self.along))

    @property
    def scales(self) -> tuple[str, ...]:
        """Names of what slopes along parameters are multiplied by, so that all of them are of like sizes."""
        return tuple(f"scale of {name}" for name in self.along if name not in self.states)


@runtime_checkable
class Stepper(Protocol):
    """What carries a row of states and slopes along the edges."""

    def run(
        self, row: np.ndarray, times: np.ndarray, edges: np.ndarray, values: np.ndarray, held: Sequence[float]
    ) -> np.ndarray:
        """(N, columns) rows at the times, NaN from where the motion ends.

        Args:
            row: at the first time. times: (N,) s. edges: (E + 1,) s, from the first time to the last.
            values: (E, w) of the inputs between edges: constants, (a, b) of a + b t for ramps.
            held: parameters, then scales.
        """
        ...


def variational(motion: Motion) -> Kernel:
    """The kernel of rates of states and of slopes, in sizes of 1: forward mode, one sweep for each column."""
    scaled = _scaled(motion)
    whole = Assembly(f"variational equations of {motion.kernel.name}")
    results = dict(whole.call(scaled))
    rates = tuple(results)
    for k, name in enumerate(motion.along):
        speeds = {state: f"slope {k} {state}" for state in motion.states}
        if name not in motion.states:
            speeds[name] = f"scale of {name}"
        column = whole.call(slopes_along(scaled, speeds, piecewise=True))
        results |= {f"{rate} {k}": column[rate] for rate in rates}
    return whole.finished(results, [*_carried(motion), *motion.inputs, *motion.parameters, *motion.scales])


def stepper(motion: Motion, *, discrete: bool, tolerance: float) -> Stepper:
    """What integrates a motion in continuous time, or steps it in discrete time."""
    split = hoist(variational(motion), (*motion.parameters, *motion.scales))
    return DifferenceSteps(motion, split) if discrete else TaylorSteps(motion, split, tolerance)


def jumps(kernel: Kernel) -> bool:
    """Whether it has signs, which jump: slopes of a motion across them need more than variational equations."""
    return Operation.SIGN in kernel.operations


class TaylorSteps:
    """heyoka's Taylor integrator of the variational equations."""

    def __init__(self, motion: Motion, split: Hoisted, tolerance: float) -> None:
        import heyoka as hy  # 0.4 s: only when something is integrated

        from ulna.program.lowering.heyoka import to_heyoka

        self._reached = hy.taylor_outcome.time_limit
        self._clocked = any(motion.ramps)
        self._before = to_python(split.before)
        self._names, self._needed = (*motion.parameters, *motion.scales), split.before.inputs
        self._kinked = bool(with_modes(motion.kernel).guards)
        self._lock = threading.Lock()
        names = _carried(motion)
        variables = [hy.expression(f"s{k}") for k in range(len(names))]
        sources: dict[str, Any] = dict(zip(names, variables, strict=True))
        place = 0
        for name, ramp in zip(motion.inputs, motion.ramps, strict=True):
            sources[name] = hy.par[place] + hy.par[place + 1] * hy.time if ramp else hy.par[place]
            place += 1 + ramp
        self._width = place
        sources |= {name: hy.par[place + k] for k, name in enumerate(split.before.outputs)}
        self._values = place + len(split.before.outputs)
        rates = list(to_heyoka(split.main, sources).values())
        self._integrator = hy.taylor_adaptive(
            list(zip(variables, rates, strict=True)),
            [0.0] * len(names),
            pars=[0.0] * self._values,
            tol=tolerance,
            compact_mode=len(names) > COMPACT_ABOVE,
        )

    def run(
        self, row: np.ndarray, times: np.ndarray, edges: np.ndarray, values: np.ndarray, held: Sequence[float]
    ) -> np.ndarray:
        """See `Stepper`."""
        known = dict(zip(self._names, held, strict=True))
        with self._lock:
            integrator = self._integrator
            integrator.time = float(times[0])
            integrator.state[:] = row
            integrator.pars[self._width :] = self._before(*(known[name] for name in self._needed))
            rows = np.full((len(times), len(row)), np.nan)
            rows[0] = row
            with np.errstate(all="ignore"):
                self._propagated(rows, times, *_merged(edges, values, keep=self._kinked))
        return rows

    def _propagated(self, rows: np.ndarray, times: np.ndarray, edges: np.ndarray, values: np.ndarray) -> None:
        integrator, width = self._integrator, self._width
        state, pars = integrator.state, integrator.pars
        first = np.searchsorted(times, edges[:-1], side="right").tolist()
        last = np.searchsorted(times, edges[1:], side="left").tolist()
        asked = (times[np.minimum(last, len(times) - 1)] == edges[1:]).tolist()
        longest = float(np.diff(times).min()) / KINKED if self._kinked else np.inf
        begun, lengths, drive = edges.tolist(), np.diff(edges).tolist(), values.tolist()
        step, places, clocked = integrator.step, range(width), self._clocked
        for k, length in enumerate(lengths):
            for place in places:
                pars[place] = drive[k][place]
            if clocked or first[k] < last[k]:
                integrator.time = begun[k]
            if first[k] < last[k]:
                grid = np.concatenate(([begun[k]], times[first[k] : last[k]], [begun[k + 1]]))
                code, *_, found = integrator.propagate_grid(grid, max_steps=MOST_STEPS, max_delta_t=longest)
                if code != self._reached:
                    ahead = found[1 : 1 + last[k] - first[k]]  # none where the first step failed
                    rows[first[k] : first[k] + len(ahead)] = ahead
                    return
                rows[first[k] : last[k]] = found[1:-1]
            else:
                # One step mostly: asked for by itself it costs half of what a propagation to the end does.
                done = step(length)[1] if length <= longest else 0.0
                if done != length and not self._gone_on(length - done, longest):
                    return
            if asked[k]:
                rows[last[k]] = state

    def _gone_on(self, left: float, longest: float) -> bool:
        """Whether further steps lead over the rest of a stretch; the rest is NaN after a step without value."""
        if not left > 0.0:
            return False
        going = self._integrator.propagate_for(left, max_steps=MOST_STEPS, max_delta_t=longest)
        return going[0] == self._reached


class DifferenceSteps:
    """The steps of a system in discrete time; edges are its multiples of the period."""

    def __init__(self, motion: Motion, split: Hoisted) -> None:
        self._before, self._step = to_python(split.before), to_python(split.main)
        self._names, self._needed = (*motion.parameters, *motion.scales), split.before.inputs

    def run(
        self, row: np.ndarray, times: np.ndarray, edges: np.ndarray, values: np.ndarray, held: Sequence[float]
    ) -> np.ndarray:
        """See `Stepper`."""
        known = dict(zip(self._names, held, strict=True))
        constants = self._before(*(known[name] for name in self._needed))
        whole = np.full((len(edges), len(row)), np.nan)
        whole[0] = row
        carried = row.tolist()
        for k, inputs in enumerate(values.tolist()):
            try:
                carried = self._step(*carried, *inputs, *constants)
            except (ArithmeticError, ValueError):
                break
            whole[k + 1] = carried
        return whole[np.searchsorted(edges, times)]


def _carried(motion: Motion) -> list[str]:
    columns = [f"slope {k} {state}" for k in range(len(motion.along)) for state in motion.states]
    return [*motion.states, *columns]


def _scaled(motion: Motion) -> Kernel:
    """The kernel of x/d for states divided by their sizes d."""
    if all(size == 1.0 for size in motion.sizes):
        return motion.kernel
    whole = Assembly(motion.kernel.name)
    sizes = dict(zip(motion.states, motion.sizes, strict=True))
    rates = whole.call(motion.kernel, {name: whole.input(name) * size for name, size in sizes.items()})
    divided = {name: rate * (1.0 / d) for (name, rate), d in zip(rates.items(), motion.sizes, strict=True)}
    return whole.finished(divided, motion.kernel.inputs)


def _merged(edges: np.ndarray, values: np.ndarray, *, keep: bool) -> tuple[np.ndarray, np.ndarray]:
    """Edges at which some value changes; all where they are kept."""
    if keep or len(values) < 2:
        return edges, values
    change = (values[1:] != values[:-1]).any(axis=1)
    return edges[np.concatenate(([True], change, [True]))], values[np.concatenate(([True], change))]
