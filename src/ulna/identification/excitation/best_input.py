"""`excite`: the input, within limits, from which parameters come out most surely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from ulna.identification.errors import IdentificationError
from ulna.identification.excitation.candidate import Candidate, Shape, mixed, multisine, single_step, steps
from ulna.identification.excitation.precision import Precision, precision
from ulna.identification.sensitivity import Response, Sensitivities
from ulna.sim import Held
from ulna.symbolic.compiling import rounded
from ulna.system import System, SystemLike, as_system, measured_part, starting_point, to_si, with_uses

NOISE = 1e-3
"""Standard deviation of an output's noise where nothing is said, SI: a milliradian, a millimetre."""
TRIALS = 14
"""Motions at most until the size of an input fits the limits."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Excitation:
    """An input to log, and what a fit of that log will know.

    Attributes:
        inputs: by name, held samples, SI. shape: multisine, or steps.
        motion: states and outputs under it, with their slopes by the parameters, then by the starts.
        standard_errors: by parameter, SI, for the noise; no unbiased fit has smaller ones. relative_errors: the same
            over the parameter's value. step_errors: of the best single step within the limits, inf where it tells
            nothing.
        noise: by output, SI. reached: share of each limit that is used, by name; `limited_by`: the most used one.

    Examples:
        >>> spring = ulna.model("mass_spring_damper")
        >>> found = ulna.excite(spring, ["k"], limits={"u": 1}, duration=5.0, samples=50, tries=4)
        >>> found.csv().splitlines()[0]  # a table for the bench
        'time [s],u [N]'
    """

    plant: System
    inputs: Mapping[str, Held]
    shape: Shape
    motion: Sensitivities
    standard_errors: Mapping[str, float]
    relative_errors: Mapping[str, float]
    step_errors: Mapping[str, float]
    noise: Mapping[str, float]
    reached: Mapping[str, float]

    @property
    def limited_by(self) -> str:
        """The limit that is used most."""
        return max(self.reached, key=lambda name: self.reached[name])

    def csv(self) -> str:
        """The input as a table for the bench: time in s, then each input in its unit."""
        units = {s.name: s.unit for s in self.plant.inputs}
        titles = ["time [s]", *(f"{name} [{units[name]}]" if units[name] else name for name in self.inputs)]
        columns = [self.motion.times]
        for name, held in self.inputs.items():
            columns.append(held.values / float(to_si(sp.Integer(1), units[name] or "1")))
        rows = [",".join(f"{value:.9g}" for value in row) for row in np.column_stack(columns)]
        return "\n".join([",".join(titles), *rows, ""])


def excite(
    system: SystemLike,
    free: Sequence[str],
    *,
    limits: Mapping[str, Any],
    duration: float,
    samples: int = 1000,
    noise: Mapping[str, float] | None = None,
    initial: Mapping[str, float] | None = None,
    outputs: Sequence[str] | None = None,
    tries: int = 60,
    seed: int = 1972,
) -> Excitation:
    """The input within limits that tells the parameters apart best, as samples that are held.

    D-optimal: the determinant of the Fisher information of the parameters, from exact slopes, is the largest that
    a search over multisines, steps between random levels and mixtures of them finds. The start counts as unknown, as
    it does in a fit. Every input is scaled until the simulated motion obeys the limits at its samples, at the present
    values of the parameters: leave room for what these are wrong by.

    Args:
        system: in continuous time, with values of all parameters: the best guess.
        free: names of the parameters that are to be known.
        limits: SI, by name of inputs (all of them), states and outputs: the largest size, or (lower, upper).
        duration: s. samples: how often the input may change, and how often outputs are read.
        noise: standard deviation by output, SI; left out, 1e-3. Errors are proportional to it.
        initial: states in SI by name, the input there being 0; left out, the plant's starting point with its input.
        outputs: those that are recorded; left out, the measured ones.
        tries: inputs that are tried. seed: of the search; the same seed gives the same input.

    Raises:
        IdentificationError: unknown names, an input without a limit, a start outside the limits, a parameter that no
            input within the limits makes identifiable.

    Reference:
        G. C. Goodwin, R. L. Payne, Dynamic System Identification: Experiment Design and Data Analysis, Academic
        Press 1977, chapter 6.

    Examples:
        >>> spring = ulna.model("mass_spring_damper")
        >>> found = ulna.excite(spring, ["k"], limits={"u": 1}, duration=5.0, samples=50, tries=4)
        >>> found.standard_errors["k"] < 0.01
        True
    """
    whole = as_system(system)
    plant = measured_part(whole if outputs is None else with_uses(whole, measured=list(outputs)))
    task = _Task(plant, whole, tuple(free), limits, duration, samples, noise or {}, initial)
    random = np.random.default_rng(seed)
    inputs, fastest = len(plant.inputs), max(2.0, samples / 20)
    best_step = max((task.tried(single_step(inputs, samples, sign)) for sign in (1.0, -1.0)), key=_worth)
    found = [best_step]
    for k in range(tries):
        make = multisine if k % 2 else steps
        fresh = make(inputs, samples, 1.0, fastest, random)
        if k > tries // 2:  # the second half in the neighbourhood of the best
            fresh = mixed(found[0].candidate, fresh, random.uniform(0.1, 0.6))
        found = [max(found[0], task.tried(fresh), key=_worth)]
    return task.answer(found[0], best_step)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Trial:
    candidate: Candidate
    inputs: Mapping[str, Held]
    motion: Sensitivities
    precision: Precision


def _worth(trial: _Trial) -> tuple[int, float]:
    hidden = int(trial.precision.hidden.sum())
    return -hidden, trial.precision.information


class _Task:
    """What is asked for, checked once."""

    def __init__(
        self,
        plant: System,
        whole: System,
        free: tuple[str, ...],
        limits: Mapping[str, Any],
        duration: float,
        samples: int,
        noise: Mapping[str, float],
        initial: Mapping[str, float] | None,
    ) -> None:
        self.plant, self.free = plant, free
        self._asked = f"an input for '{plant.name}'"
        self._check(whole, noise, initial, duration, samples)
        self._bounds = {name: self._bound(name, given) for name, given in limits.items()}
        for s in plant.inputs:
            if s.name not in self._bounds:
                raise IdentificationError(self._asked, f"input '{s.name}' has no limit.", f'Give one: "{s.name}=1".')
        point = starting_point(plant)
        rest = {s.name: float(point[s.name]) for s in (*plant.states, *plant.inputs)}
        self._start = [float((rest if initial is None else initial).get(s.name, 0.0)) for s in plant.states]
        self._rest: dict[str, float] = {s.name: rest.get(s.name, 0.0) if initial is None else 0.0 for s in plant.inputs}
        self._times = np.linspace(0.0, duration, samples + 1)
        self._noise = {o.name: float(noise.get(o.name, NOISE)) for o in plant.outputs}
        values = {p.name: p.si_value for p in plant.parameters}
        self._values = np.array([rounded(v, plant.name) if (v := values[n]) is not None else np.nan for n in free])
        self._sizes = np.where(np.abs(self._values) > 0, np.abs(self._values), 1.0)

    def _check(self, whole: System, noise: Mapping[str, float], initial: Any, duration: float, samples: int) -> None:
        plant = self.plant
        if plant.discrete:
            raise IdentificationError(self._asked, "it is in discrete time.", "Give the continuous plant.")
        if not plant.inputs:
            raise IdentificationError(self._asked, "it has no input.", "Only its initial state can be chosen.")
        if not plant.outputs:
            raise IdentificationError(self._asked, "no output is measured.", "Name an output that is recorded.")
        if not self.free:
            raise IdentificationError(self._asked, "no parameter is named.", "Name those to be estimated.")
        if not (np.isfinite(duration) and duration > 0 and samples >= 10):
            found = f"{duration:g} s in {samples} samples."
            raise IdentificationError(self._asked, found, "Give a positive duration and 10 samples or more.")
        states = [s.name for s in plant.states]
        self._known("parameter", self.free, [p.name for p in whole.parameters])
        self._known("output with noise", noise, [s.name for s in plant.outputs])
        self._known("initial state", initial or (), states)
        twice = [name for name in self.free if self.free.count(name) > 1]
        if twice:
            raise IdentificationError(f"parameter '{twice[0]}'", "it is given twice.", "Name it once.")
        for name, size in noise.items():
            if not size > 0:
                raise IdentificationError(f"noise of '{name}'", f"{size:g} is not positive.", "Give its size in SI.")

    def _known(self, what: str, names: Any, known: Sequence[str]) -> None:
        for name in names:
            if name not in known:
                found = f"'{self.plant.name}' has none of this name."
                raise IdentificationError(f"{what} '{name}'", found, f"Known: {', '.join(known) or 'none'}.")

    def _bound(self, name: str, given: Any) -> tuple[float, float]:
        plant = self.plant
        self._known("limit of", [name], [s.name for s in (*plant.inputs, *plant.states, *plant.outputs)])
        lower, upper = (-float(given), float(given)) if np.ndim(given) == 0 else (float(given[0]), float(given[1]))
        if not lower < upper:
            found = f"{lower:g} to {upper:g} is empty."
            raise IdentificationError(f"limit of '{name}'", found, "Give a size, or the lower value first.")
        return lower, upper

    @cached_property
    def _response(self) -> Response:
        return Response(self.plant, (*self.free, *(s.name for s in self.plant.states)))

    def tried(self, candidate: Candidate) -> _Trial:
        """A candidate as large as the limits allow, and what it tells."""
        scale = 1.0
        for _ in range(TRIALS):
            inputs, motion = self._moved(candidate, scale)
            share = max(self._shares(inputs, motion).values()) if motion.finished else np.inf
            if share <= 1.0:
                break
            scale *= max(0.25, 0.97 / share)
        else:
            inputs, motion = self._moved(candidate, 0.0)
            self._require_rest(inputs, motion)
        noise = np.array(list(self._noise.values()))
        told = precision(motion, len(self.free), noise, self._sizes)
        return _Trial(candidate=candidate, inputs=inputs, motion=motion, precision=told)

    def _moved(self, candidate: Candidate, scale: float) -> tuple[dict[str, Held], Sensitivities]:
        inputs = {}
        for s, row in zip(self.plant.inputs, candidate.samples, strict=True):
            lower, upper = self._bounds[s.name]
            rest = self._rest[s.name]
            self._inside(s.name, rest)
            values = rest + scale * np.where(row > 0, row * (upper - rest), row * (rest - lower))
            inputs[s.name] = Held(times=self._times, values=np.append(values, values[-1]))
        return inputs, self._response(self._start, self._times, inputs, {})

    def _shares(self, inputs: Mapping[str, Held], motion: Sensitivities) -> dict[str, float]:
        """How much of the way from the start to each limit is used."""
        plant = self.plant
        rows = {o.name: motion.outputs[:, k] for k, o in enumerate(plant.outputs)}
        rows |= {s.name: motion.states[:, k] for k, s in enumerate(plant.states)}
        rows |= {name: held.values for name, held in inputs.items()}
        found = {}
        for name, (lower, upper) in self._bounds.items():
            start = self._rest[name] if name in self._rest else float(rows[name][0])
            self._inside(name, start)
            away = rows[name] - start
            ways = ((float(away.max()), upper - start), (-float(away.min()), start - lower))
            found[name] = max((used / room if room > 0 else np.inf) if used > 0 else 0.0 for used, room in ways)
        return found

    def _inside(self, name: str, start: float) -> None:
        lower, upper = self._bounds[name]
        if not lower <= start <= upper:
            found = f"the start, {start:g}, is not between {lower:g} and {upper:g}."
            raise IdentificationError(f"limit of '{name}'", found, "Start elsewhere, or widen the limit.")

    def _require_rest(self, inputs: Mapping[str, Held], motion: Sensitivities) -> None:
        shares = self._shares(inputs, motion) if motion.finished else {}
        broken = [name for name, share in shares.items() if share > 1]
        if broken or not motion.finished:
            found = (
                f"the plant leaves the limit of '{broken[0]}' by itself." if broken else "the motion ends by itself."
            )
            hint = "Begin at a stable equilibrium (initial), shorten the time, or stabilise the plant first."
            raise IdentificationError(self._asked, found, hint)

    def answer(self, best: _Trial, step: _Trial) -> Excitation:
        """The value to hand out."""
        if best.precision.hidden.any():
            names = [name for name, hidden in zip(self.free, best.precision.hidden, strict=True) if hidden]
            found = (
                f"no input within the limits distinguishes {', '.join(names)} from each other and the initial state."
            )
            hint = "Fix one of them, or record more outputs; `ulna.identifiability` says which combinations are known."
            raise IdentificationError(self._asked, found, hint)
        errors = best.precision.deviations
        steps_told = np.where(np.isnan(step.precision.deviations), np.inf, step.precision.deviations)
        return Excitation(
            plant=self.plant,
            inputs=best.inputs,
            shape=best.candidate.shape,
            motion=best.motion,
            standard_errors=self._named(errors),
            relative_errors=self._named(errors / self._sizes),
            step_errors=self._named(steps_told),
            noise=self._noise,
            reached=self._shares(best.inputs, best.motion),
        )

    def _named(self, values: np.ndarray) -> dict[str, float]:
        return dict(zip(self.free, values.tolist(), strict=True))
