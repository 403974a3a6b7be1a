"""What drives an input during a simulation: a constant, a formula of time, or samples held or joined by lines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Self

import numpy as np
import sympy as sp

from ulna.base import SimulationError
from ulna.loop import TIME
from ulna.program import to_numpy
from ulna.symbolic.compiling import kernel


@dataclass(frozen=True, slots=True, kw_only=True)
class Constant:
    """u(t) = value, in SI."""

    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """u(t) as an exact expression in `TIME` and the system's parameters, in SI."""

    expression: sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Values of u at some times: what `Held` and `Interpolated` have in common.

    Args:
        times: (N,) increasing, in s. values: (N,) in SI; (R, N) for R runs that each have their own.

    Raises:
        SimulationError: lengths that differ, times that do not increase, or a value that is not finite.
    """

    times: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        _freeze_samples(self)

    @classmethod
    def known(cls, *, times: np.ndarray, values: np.ndarray) -> Self:
        """Of arrays that are right by construction and that nobody will change; they are not copied."""
        samples = object.__new__(cls)
        object.__setattr__(samples, "times", times)
        object.__setattr__(samples, "values", values)
        return samples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Held(Samples):
    """u(t) = values[k] for times[k] ≤ t < times[k+1], and the last value from the last time on. See `Samples`.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> push = ulna.Held(times=np.array([0.0, 1.0]), values=np.array([0.0, 12.0]))  # 12 N from 1 s on
        >>> ulna.simulate(spring, [0, 0], np.linspace(0, 2, 5), inputs={"u": push}).x[0].round(2)
        array([0.  , 0.  , 0.  , 1.27, 3.67])
    """


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interpolated(Samples):
    """u(t) by straight lines between (times[k], values[k]); defined from the first time to the last. See `Samples`.

    Examples:
        >>> spring = ulna.model("mass_spring_damper").with_values()
        >>> ramp = ulna.Interpolated(times=np.array([0.0, 2.0]), values=np.array([0.0, 1.0]))
        >>> ulna.simulate(spring, [0, 0], np.linspace(0, 2, 5), inputs={"u": ramp}).u
        array([0.  , 0.25, 0.5 , 0.75, 1.  ])
    """

    @classmethod
    def of(cls, function: Callable[[float], float], times: Sequence[float] | np.ndarray) -> Interpolated:
        """Straight lines through a Python function of time, taken at the given times."""
        return cls(times=np.asarray(times, dtype=float), values=np.array([float(function(float(t))) for t in times]))


Input = Constant | Formula | Held | Interpolated


def as_input(name: str, given: Any, times: np.ndarray | None = None) -> Input:
    """The input that a number, a formula, a function of time or an input object stands for.

    A function that takes `TIME` as it takes a number is its formula; any other is taken at the times of the simulation,
    or 1001 of them where these are fewer, and joined by straight lines.

    Raises:
        SimulationError: for anything else, and for a constant that is not finite.
    """
    if isinstance(given, Formula | Held | Interpolated):
        return given
    if isinstance(given, sp.Expr) and not given.is_number:
        return Formula(expression=given)
    if callable(given) and times is not None:
        return _of_function(given, times)
    value: Any = given.value if isinstance(given, Constant) else given
    try:
        number = float(value)
    except (TypeError, ValueError):
        hint = "Give a number, a formula in ulna.TIME, a function of time, Held(...) or Interpolated(...)."
        raise SimulationError(f"input '{name}'", f"a {type(given).__name__} cannot drive it.", hint) from None
    if not np.isfinite(number):
        raise SimulationError(f"input '{name}'", f"its value is {number}.", "Give a finite number.")
    return Constant(value=number)


_FINE = 1001
"""Times at least at which a function that is no formula is taken."""


def _of_function(function: Callable[[Any], Any], times: np.ndarray) -> Input:
    try:
        formula: Any = function(TIME)
    except Exception:  # noqa: BLE001 - a function of numbers may fail on a symbol in any way
        formula = None
    if isinstance(formula, sp.Expr) and formula.free_symbols == {TIME}:
        return Formula(expression=formula)
    span = (float(times[0]), float(times[-1]))
    return Interpolated.of(function, times if len(times) > _FINE else np.linspace(*span, _FINE))


def input_values(given: Input, times: np.ndarray, parameters: Mapping[str, float]) -> np.ndarray:
    """(N,) values of an input at the given times, in SI; at a jump of held samples the later value."""
    match given:
        case Constant(value=value):
            return np.full(len(times), value)
        case Held(times=at, values=values):
            return values[np.maximum(np.searchsorted(at, times, side="right") - 1, 0)]
        case Interpolated(times=at, values=values):
            return np.interp(times, at, values)
        case Formula(expression=expression):
            return _lowered(expression, tuple(parameters))(times, *parameters.values())[0]


def of_run(given: Input, run: int) -> Input:
    """Samples of each run's own: those of this run."""
    if isinstance(given, Held | Interpolated) and given.values.ndim == 2:
        return type(given).known(times=given.times, values=given.values[run])
    return given


@lru_cache(maxsize=32)
def _lowered(expression: sp.Expr, parameters: tuple[str, ...]) -> Callable[..., tuple[np.ndarray, ...]]:
    symbols = [sp.Symbol(name, real=True) for name in parameters]
    return to_numpy(kernel("input", [TIME, *symbols], {"u": expression}))


def _freeze_samples(samples: Samples) -> None:
    times = np.array(samples.times, dtype=float)
    values = np.array(samples.values, dtype=float)
    asked = f"{type(samples).__name__} input"
    if times.ndim != 1 or values.ndim not in {1, 2} or values.shape[-1:] != times.shape or not len(times):
        raise SimulationError(asked, f"times have shape {times.shape} and values {values.shape}.", "Give one of each.")
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        raise SimulationError(asked, "a time or a value is not a finite number.")
    if not (np.diff(times) > 0).all():
        raise SimulationError(asked, "its times do not increase.", "Sort them and drop repeated ones.")
    for name, array in (("times", times), ("values", values)):
        array.flags.writeable = False
        object.__setattr__(samples, name, array)
