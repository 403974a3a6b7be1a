"""`sensitivities`: states and outputs along a run, and their exact slopes by parameters and initial states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ulna.identification.errors import IdentificationError
from ulna.identification.sensitivity.variational import Motion, Stepper, jumps, stepper
from ulna.program import tangents, to_numpy
from ulna.sim import Constant, Held, Input, Interpolated, as_input, input_values
from ulna.symbolic.compiling import kernel, rounded
from ulna.system import System, SystemLike, as_system

TOLERANCE = 1e-12
"""Of one step, relative to the largest of the states and slopes that are integrated, each in its size."""

UNEVEN = 1024.0
"""States that differ by less are of one size."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sensitivities:
    """States and outputs along a run with their slopes, in SI; NaN from where the motion has no value any more.

    Attributes:
        times: (N,) s. states: (N, n). outputs: (N, p).
        along: (q,) names of parameters, and of states for their initial values.
        state_slopes: (N, n, q) ∂x/∂. output_slopes: (N, p, q) ∂y/∂.
    """

    times: np.ndarray
    along: tuple[str, ...]
    states: np.ndarray
    outputs: np.ndarray
    state_slopes: np.ndarray
    output_slopes: np.ndarray

    @property
    def finished(self) -> bool:
        """Whether the motion reached the last time."""
        return bool(np.isfinite(self.outputs).all() and np.isfinite(self.output_slopes).all())


def sensitivities(
    system: SystemLike,
    initial: Sequence[float] | np.ndarray | Mapping[str, float],
    times: np.ndarray,
    *,
    along: Sequence[str],
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Sensitivities:
    """The motion of a system at the times, and what of it changes with each parameter and initial state in `along`.

    The variational equations are integrated with the motion, by Taylor series to 1e-12; nothing is a difference
    quotient. Of a right-hand side with kinks (Abs, Min, Max) the slope of the branch taken.

    Args:
        system: in continuous or discrete time, or static.
        initial: states in SI, (n,) in order or by name; those left out start at 0.
        times: (N,) s, increasing, the first where `initial` holds; in discrete time multiples of the period after it.
        along: names of parameters, and of states for their initial values.
        inputs: by name a number, `Held` or `Interpolated` samples; one that is left out is 0.
        parameters: SI values in place of the system's own.

    Raises:
        IdentificationError: unknown names, parameters without a value, a right-hand side that jumps (sign).
        UlnaError: an operation without a derivative.

    Reference:
        E. Hairer, S. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section I.14.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> found = ulna.sensitivities(spring, [1, 0], np.linspace(0, 1, 5), along=["p"])
        >>> found.output_slopes[0, 0]
        array([1.])
    """
    response = Response(as_system(system), tuple(along))
    at = np.asarray(times, dtype=float)
    given = {name: as_input(name, each, at) for name, each in (inputs or {}).items()}
    return response(initial, at, given, parameters or {})


@lru_cache(maxsize=16)
def response_of(system: System, along: tuple[str, ...]) -> Response:
    """The same for the same question: fits of many logs compile once."""
    return Response(system, along)


class Response:
    """A system made ready for many evaluations of `sensitivities` along the same names."""

    def __init__(self, system: System, along: tuple[str, ...], tolerance: float = TOLERANCE) -> None:
        self.system, self.along = system, along
        self._states = tuple(s.name for s in system.states)
        self._parameters = tuple(p.name for p in system.parameters)
        self._tolerance = tolerance
        known = (*self._parameters, *self._states)
        for name in along:
            if name not in known:
                found = f"'{system.name}' has no parameter and no state of this name."
                raise IdentificationError(f"sensitivities to '{name}'", found, f"Known: {', '.join(known)}.")
        self._own = {p.name: rounded(v, system.name) for p in system.parameters if (v := p.si_value) is not None}
        symbols = [*system.state_symbols, *system.input_symbols, *system.parameter_symbols]
        rates = {f"{s.name}'": e for s, e in zip(system.states, system.inline(system.rates), strict=True)}
        self._rates = kernel(system.name, symbols, rates, held=system.parameter_symbols)
        if jumps(self._rates) and not system.discrete:
            raise IdentificationError(
                f"sensitivities along the motion of '{system.name}'",
                "its right-hand side jumps (sign), and sensitivities jump where the motion crosses or sticks there.",
                "Write the smooth form: omega/sqrt(omega**2 + w**2) with a small w in place of sign(omega).",
            )
        readouts = {o.name: e for o, e in zip(system.outputs, system.inline(system.readouts), strict=True)}
        self._readouts = kernel(f"outputs of {system.name}", symbols, readouts)
        self._sizes = (1.0,) * len(self._states)
        self._steppers: dict[tuple[Any, ...], Stepper] = {}

    @cached_property
    def _evaluate(self) -> Any:
        return to_numpy(self._readouts)

    @cached_property
    def _slopes(self) -> Any:
        fixed = [name for name in self.along if name not in self._states]
        return to_numpy(tangents(self._readouts, [*self._states, *fixed], piecewise=True))

    def __call__(
        self,
        initial: Sequence[float] | np.ndarray | Mapping[str, float],
        times: np.ndarray,
        inputs: Mapping[str, Input],
        parameters: Mapping[str, float],
    ) -> Sensitivities:
        """See `sensitivities`."""
        values = self.values(parameters)
        states, slopes = self._moved(self._initial(initial), times, inputs, values)
        drive = [self._along(inputs.get(s.name), times, values) for s in self.system.inputs]
        arguments = (*states.T, *drive, *values.values())
        outputs = _stacked(self._evaluate(*arguments), times)
        fixed = [name for name in self.along if name not in self._states]
        partial = _stacked(self._slopes(*arguments), times)
        partial = partial.reshape(len(times), len(self._states) + len(fixed), len(self.system.outputs))
        output_slopes = np.einsum("tip,tiq->tpq", partial[:, : len(self._states)], slopes)
        for k, name in enumerate(fixed):
            output_slopes[:, :, self.along.index(name)] += partial[:, len(self._states) + k]
        return Sensitivities(
            times=times,
            along=self.along,
            states=states,
            outputs=outputs,
            state_slopes=slopes,
            output_slopes=output_slopes,
        )

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """The SI value of every parameter.

        Raises:
            IdentificationError: an unknown name, or a parameter without a value.
        """
        asked = f"parameters of '{self.system.name}'"
        for name in given:
            if name not in self._parameters:
                raise IdentificationError(asked, f"there is no '{name}'.", f"Known: {', '.join(self._parameters)}.")
        values = {name: float(given.get(name, self._own.get(name, np.nan))) for name in self._parameters}
        missing = [name for name, value in values.items() if not np.isfinite(value)]
        if missing:
            raise IdentificationError(asked, f"without a value: {', '.join(missing)}.", "Give them values to start at.")
        return values

    def _initial(self, given: Any) -> np.ndarray:
        row = [given.get(name, 0.0) for name in self._states] if isinstance(given, Mapping) else given
        state = np.array(row, dtype=float)
        if state.shape != (len(self._states),):
            found = f"{state.size} values for {len(self._states)} states."
            raise IdentificationError(f"initial states of '{self.system.name}'", found)
        return state

    def _along(self, given: Input | None, times: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        return np.zeros(len(times)) if given is None else input_values(given, times, values)

    def _moved(
        self, initial: np.ndarray, times: np.ndarray, inputs: Mapping[str, Input], values: Mapping[str, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """(states, their slopes)."""
        count, wide = len(self._states), len(self.along)
        if not count:
            return np.zeros((len(times), 0)), np.zeros((len(times), 0, wide))
        drive = self._drive(inputs, times)
        scales = np.array([1.0 if name in self._states else abs(values[name]) or 1.0 for name in self.along])
        sizes, rows = np.array(self._sizes), np.empty(0)
        for _ in range(4):
            sizes = np.array(self._sizes)
            row = np.zeros((1 + wide, count))
            row[0] = initial / sizes
            for k, name in enumerate(self.along):
                if name in self._states:
                    row[1 + k, self._states.index(name)] = 1.0 / sizes[self._states.index(name)]
            held = [*values.values(), *(s for s, n in zip(scales, self.along, strict=True) if n not in self._states)]
            carried = self._stepper(drive.ramps).run(row.ravel(), times, drive.edges, drive.values, held)
            rows = carried.reshape(len(times), 1 + wide, count)
            if self._fits(rows[:, 0]):
                break
        return rows[:, 0] * sizes, np.moveaxis(rows[:, 1:] * sizes, 1, 2) / scales

    def _fits(self, states: np.ndarray) -> bool:
        """Whether the states, in their sizes, are of like size; else other sizes are taken."""
        with np.errstate(all="ignore"):
            found = np.nanmax(np.abs(states), axis=0)
        moving = found[found > 0.0]
        if not len(moving) or max(1.0, moving.max()) <= UNEVEN * moving.min() or not np.isfinite(found).all():
            return True
        _, exponents = np.frexp(found * np.array(self._sizes))
        sizes = np.where(found > 0.0, np.ldexp(1.0, np.clip(exponents, -900, 900)), self._sizes)
        if tuple(sizes.tolist()) == self._sizes:
            return True
        self._sizes = tuple(sizes.tolist())
        return False

    def _stepper(self, ramps: tuple[bool, ...]) -> Stepper:
        key = (ramps, self._sizes)
        if key not in self._steppers:
            motion = Motion(
                kernel=self._rates,
                states=self._states,
                inputs=tuple(s.name for s in self.system.inputs),
                parameters=self._parameters,
                along=self.along,
                ramps=ramps,
                sizes=self._sizes,
            )
            self._steppers[key] = stepper(motion, discrete=self.system.discrete, tolerance=self._tolerance)
        return self._steppers[key]

    def _drive(self, inputs: Mapping[str, Input], times: np.ndarray) -> Drive:
        known = [s.name for s in self.system.inputs]
        for name, given in inputs.items():
            if name not in known:
                found = f"'{self.system.name}' has no such input."
                raise IdentificationError(f"input '{name}'", found, f"Known: {', '.join(known) or 'none'}.")
            if not isinstance(given, Constant | Held | Interpolated):
                raise IdentificationError(
                    f"input '{name}'", "it is a formula of time.", "Give Held or Interpolated samples."
                )
        chosen = [inputs.get(name) or Constant(value=0.0) for name in known]
        if self.system.period is not None:
            return _steps(chosen, times, float(self.system.period), self.system.name)
        return _stretches(chosen, times)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """The inputs between edges. edges: (E + 1,) s. values: (E, w), see `Stepper`. ramps: of each input."""

    edges: np.ndarray
    values: np.ndarray
    ramps: tuple[bool, ...] = field(default=())


def _stretches(inputs: Sequence[Input], times: np.ndarray) -> Drive:
    """What the inputs are between the times at which one of them, or its slope, jumps."""
    first, last = times[0], times[-1]
    found = [i.times[(i.times > first) & (i.times < last)] for i in inputs if isinstance(i, Held | Interpolated)]
    edges = np.unique(np.concatenate([[first, last], *found]))
    middles = 0.5 * (edges[1:] + edges[:-1])
    columns: list[np.ndarray] = []
    for each in inputs:
        if isinstance(each, Interpolated):
            place = np.clip(np.searchsorted(each.times, middles, side="right") - 1, 0, len(each.times) - 2)
            slope = (np.diff(each.values) / np.diff(each.times))[place]
            columns += [each.values[place] - slope * each.times[place], slope]
        else:
            columns.append(input_values(each, middles, {}))
    values = np.stack(columns, axis=1) if columns else np.zeros((len(middles), 0))
    return Drive(edges=edges, values=values, ramps=tuple(isinstance(each, Interpolated) for each in inputs))


def _steps(inputs: Sequence[Input], times: np.ndarray, period: float, name: str) -> Drive:
    """What the inputs are at the multiples of the period."""
    counts = (times - times[0]) / period
    whole = np.rint(counts)
    if np.abs(counts - whole).max() > 1e-6 * max(1.0, float(whole[-1])):
        found = f"they are not multiples of its period of {period:g} s."
        raise IdentificationError(f"times of '{name}' in discrete time", found, "Give samples at its period.")
    edges = np.union1d(times, times[0] + period * np.arange(int(whole[-1]) + 1))
    if len(edges) > whole[-1] + 1:  # rounding made twins
        edges = times[0] + period * np.arange(int(whole[-1]) + 1)
        edges[whole.astype(int)] = times
    columns = [input_values(each, edges[:-1], {}) for each in inputs]
    values = np.stack(columns, axis=1) if columns else np.zeros((len(edges) - 1, 0))
    return Drive(edges=edges, values=values, ramps=(False,) * len(inputs))


def _stacked(columns: Sequence[Any], times: np.ndarray) -> np.ndarray:
    if not columns:
        return np.zeros((len(times), 0))
    return np.stack(np.broadcast_arrays(times, *columns)[1:], axis=1)
