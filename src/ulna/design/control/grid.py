"""A loop on a fine grid of parameters and set points: where it rests, and its worst eigenvalue."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ulna.base import DesignError, Verdict
from ulna.symbolic.compiling import batch_jacobian, batch_vector
from ulna.system import System, SystemLike, as_system, newton


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoopGrid:
    """Equilibria and eigenvalues of a loop over a grid of P points.

    Attributes:
        system: the closed loop.
        points: (P,) values by name of what was varied.
        rest: (P, n) equilibrium, NaN where none was found; outputs: (P, p) outputs there.
        eigenvalues: (P, n) of the linearisation there, NaN where there is no equilibrium.
    """

    system: System
    points: Mapping[str, np.ndarray]
    rest: np.ndarray
    outputs: np.ndarray
    eigenvalues: np.ndarray

    @property
    def abscissa(self) -> np.ndarray:
        """(P,) largest real part in 1/s; infinite where no equilibrium was found."""
        worst = np.real(self.eigenvalues).max(axis=1)
        return np.where(np.isfinite(worst), worst, np.inf)

    @property
    def worst(self) -> float:
        """Largest real part on the whole grid, in 1/s."""
        return float(self.abscissa.max())

    @property
    def where(self) -> dict[str, float]:
        """The point of the worst eigenvalue."""
        index = int(self.abscissa.argmax())
        return {name: float(values[index]) for name, values in self.points.items()}

    def rest_of(self, name: str) -> np.ndarray:
        """(P,) values at rest of a state or output."""
        for signals, values in ((self.system.states, self.rest), (self.system.outputs, self.outputs)):
            for column, signal in enumerate(signals):
                if signal.name == name:
                    return values[:, column]
        raise DesignError(f"'{name}' of '{self.system.name}'", "it is neither a state nor an output.")

    def left_of(self, bound: float) -> Verdict:
        """Whether every eigenvalue lies left of `bound` in 1/s: supported at the grid's points, or refuted with one."""
        claim = f"every eigenvalue of '{self.system.name}' lies left of {bound:g} 1/s on the grid"
        evidence = {"points": len(self.abscissa), "worst": self.worst, "where": self.where}
        return (Verdict.supported if self.worst < bound else Verdict.refuted)(claim, **evidence)


def loop_grid(
    loop: SystemLike,
    over: Mapping[str, Sequence[float] | np.ndarray],
    *,
    guess: Mapping[str, str | float] | None = None,
) -> LoopGrid:
    """The loop at every combination of the values in `over`: equilibrium by Newton's method, then eigenvalues.

    Args:
        loop: a closed loop; inputs not varied are 0, parameters not varied keep their values.
        over: SI values by name of a parameter or an input.
        guess: where Newton's method starts, by state: a number or the name of something varied; else 0.

    Raises:
        DesignError: for an unknown name or a parameter without value.
    """
    loop = as_system(loop)
    values = grid_values(loop, over)
    size = math.prod(np.size(v) for v in over.values())
    states = [s.name for s in loop.states]
    start = np.zeros((size, len(states)))
    for name, given in (guess or {}).items():
        start[:, states.index(name)] = values[given] if isinstance(given, str) else given
    symbols = [*loop.state_symbols, *loop.input_symbols, *loop.parameter_symbols]
    rates = loop.inline(loop.rates)
    field = batch_vector(f"rates of {loop.name}", rates, symbols)
    slope = batch_jacobian(f"slope of {loop.name}", rates, loop.state_symbols, symbols)

    def at_points(x: np.ndarray) -> dict[str, np.ndarray]:
        return {**values, **{n: x[:, k] for k, n in enumerate(states)}}

    rest = newton(lambda x: field(at_points(x)), lambda x: slope(at_points(x)), start).points
    at = at_points(rest)
    found = np.isfinite(rest).all(axis=1)
    eigenvalues = np.full(rest.shape, np.nan, dtype=complex)
    if found.any():
        eigenvalues[found] = np.linalg.eigvals(slope(at)[found])
    outputs = batch_vector(f"outputs of {loop.name}", loop.inline(loop.readouts), symbols)(at)
    points = {name: values[name] for name in over}
    return LoopGrid(system=loop, points=points, rest=rest, outputs=outputs, eigenvalues=eigenvalues)


def grid_values(system: System, over: Mapping[str, Sequence[float] | np.ndarray]) -> dict[str, np.ndarray]:
    """(P,) arrays for every input and parameter of a system: all combinations of `over`, the rest held.

    Raises:
        DesignError: for an unknown name or a parameter without value.
    """
    known = {s.name for s in system.inputs} | {p.name for p in system.parameters}
    unknown = [name for name in over if name not in known]
    unset = [p.name for p in system.parameters if p.si_value is None and p.name not in over]
    if unknown or unset:
        raise DesignError(
            f"grid over '{system.name}'",
            f"no parameter or input {', '.join(unknown)}." if unknown else f"no value for {', '.join(unset)}.",
            f"Known: {', '.join(sorted(known))}.",
        )
    mesh = np.meshgrid(*(np.atleast_1d(np.asarray(v, dtype=float)) for v in over.values()), indexing="ij")
    points = {name: axis.ravel() for name, axis in zip(over, mesh, strict=True)}
    size = mesh[0].size if mesh else 1
    held = {s.name: 0.0 for s in system.inputs} | {
        p.name: float(p.si_value) for p in system.parameters if p.si_value is not None
    }
    return {name: np.full(size, value) for name, value in held.items()} | points
