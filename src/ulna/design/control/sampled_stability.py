"""Whether a controller designed in continuous time can work at a sampling period, before any simulation.

Source: K. J. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd ed., sections 2.3 (sampling with delay), 3.2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ulna.base import DesignError, Verdict
from ulna.design.control.grid import LoopGrid, loop_grid
from ulna.design.control.law import Law
from ulna.design.control.output_feedback import Compensator, close_loop
from ulna.symbolic.compiling import batch_jacobian, batch_vector
from ulna.system import System

_ENOUGH = 50.0
"""1/0.02: a 2 % band."""
_WORTH = 0.5
"""Least share of the designed decay rate that sampling must leave."""
_RADIUS, _TERMS = 0.5, 14
"""Norm up to which the Taylor series of the exponential is summed, and its terms: 0.5¹⁵/15! is below 1e-16."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Matrices:
    """(P, ·, ·) Jacobians of plant, observer and law at rest; the observer has no states for a law alone."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    Ao: np.ndarray
    Bo: np.ndarray
    Co: np.ndarray
    K: np.ndarray


def sampled_grid(
    plant: System,
    controller: Law | Compensator,
    over: Mapping[str, Sequence[float] | np.ndarray],
    *,
    period: float,
    delay: float | None = None,
    guess: Mapping[str, str | float] | None = None,
) -> LoopGrid:
    """The loop of `loop_grid`, closed by a processor: eigenvalues ln(z)/period of its linearisation at rest.

    At each sample the observer advances (measured outputs on a straight line between samples, input as held), the
    law computes the command, and the plant's input takes it `delay` later and holds it. The real part of ln(z)/period
    is the decay rate of the samples; it is positive where the sampled loop is unstable.

    Args:
        plant: the true plant; over, guess: as in `loop_grid` of the continuous loop.
        controller: a law on measured states, or a compensator; without integral action.
        period: in s; delay: in s from 0 to the period; left out, a whole period.

    Raises:
        DesignError: for a delay outside 0 … period, or a law with states of its own.
    """
    late = period if delay is None else delay
    if not (0 < period < math.inf and 0 <= late <= period):
        raise DesignError(f"period {period} s, delay {late} s", "the delay must lie between 0 and the period.")
    law = controller if isinstance(controller, Law) else controller.law
    if law.system.states:
        raise DesignError(f"sampled loop of '{plant.name}'", "its law has integrators.", "Leave them out here.")
    grid = loop_grid(close_loop(plant, controller).system, over, guess=guess)
    steps = _step(_matrices(plant, controller, grid), period, late)
    found = np.isfinite(steps).all(axis=(1, 2))
    multipliers = np.full(steps.shape[:2], np.nan, dtype=complex)
    if found.any():
        multipliers[found] = np.linalg.eigvals(steps[found])
    smallest = np.where(np.abs(multipliers) < 1e-300, 1e-300, multipliers)  # dead beat: ln 0
    return replace(grid, eigenvalues=np.log(smallest) / period)


def sampling_advice(
    plant: System,
    controller: Law | Compensator,
    *,
    period: float,
    delay: float | None = None,
    at: Mapping[str, float] | None = None,
    limits: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
) -> Verdict:
    """Whether the controller can work on the plant at this period; said before simulating, from linear analysis.

    Refuted where the sampled loop is unstable at rest or keeps less than half the decay rate designed. The evidence
    holds the largest multiplier |z|, its frequency in Hz (half the sampling frequency: the command alternates from
    sample to sample), the plant's shortest time constant over the period, the settling time ln 50/decay, the decay
    without sampling, and for each limited input the law's command at the start over its limit.

    Args:
        at: SI values of references and parameters at which the loop rests; also where Newton's method starts for
            states of these names.
        limits: largest |input| by name, in SI; start: the plant's state at the start by name, else 0.
    """
    points = {name: [value] for name, value in (at or {}).items()}
    names = {s.name for s in plant.states}
    known = {n: v for n, v in points.items() if n not in names}
    guess = {n: v[0] for n, v in points.items() if n in names}
    loop = close_loop(plant, controller).system
    grid = sampled_grid(plant, controller, known, period=period, delay=delay, guess=guess)
    continuous = loop_grid(loop, known, guess=guess)
    row = grid.eigenvalues[0]
    worst = row[int(np.argmax(row.real))]
    fastest = _fastest(plant, continuous)
    evidence: dict[str, object] = {
        "largest_multiplier": float(np.exp(worst.real * period)),
        "frequency": float(abs(worst.imag) / (2 * math.pi)),
        "decay_without_sampling": -continuous.worst,
        "shortest_time_constant_over_period": 1.0 / (fastest * period) if fastest else math.inf,
        "settling_time": math.log(_ENOUGH) / -float(worst.real) if worst.real < 0 else math.inf,
    }
    evidence |= {
        f"command_over_limit_of_{name}": ratio
        for name, ratio in _over_limits(controller, at or {}, limits or {}, start or {}).items()
    }
    claim = f"the controller of '{plant.name}' works at a period of {period:g} s"
    works = worst.real < 0 and -worst.real >= _WORTH * -continuous.worst
    return (Verdict.supported if works else Verdict.refuted)(claim, **evidence)


def _matrices(plant: System, controller: Law | Compensator, grid: LoopGrid) -> _Matrices:
    at = _values(plant, controller, grid)
    symbols = [*plant.state_symbols, *plant.input_symbols, *plant.parameter_symbols]
    rates, readouts = plant.inline(plant.rates), plant.inline(plant.readouts)
    law = controller if isinstance(controller, Law) else controller.law
    size = grid.rest.shape[0]
    wanted = list(law.form.system.state_symbols)
    inputs = [*law.system.input_symbols, *law.system.parameter_symbols]
    command = law.system.inline(law.system.readouts)
    known = [s for s in plant.state_symbols if s in wanted]
    if isinstance(controller, Law):
        Ao, Bo, Co = np.zeros((size, 0, 0)), np.zeros((size, 0, 0)), np.zeros((size, 0, 0))
        K = batch_jacobian("law", command, list(plant.state_symbols), [*dict.fromkeys([*inputs, *known])])
        gains = K(at)
        measured = batch_jacobian("states", plant.state_symbols, plant.state_symbols, symbols)(at)
    else:
        seen = {f"{s.name}_hat": s.name for s in law.form.system.states}
        estimates = {n: at[h] for h, n in seen.items()}
        gains = batch_jacobian("law", command, wanted, inputs)({**at, **estimates})
        observer = controller.observer.system
        every = [*observer.state_symbols, *observer.input_symbols, *observer.parameter_symbols]
        slopes = observer.inline(observer.rates)
        Ao = batch_jacobian("observer", slopes, observer.state_symbols, every)(at)
        driven = [s.symbol for s in law.form.system.inputs]
        outputs = [s for s in observer.input_symbols if s not in driven]
        Bo = batch_jacobian("observer inputs", slopes, [*driven, *outputs], every)(at)
        shown = observer.inline(observer.readouts)
        Co = batch_jacobian("estimates", shown, observer.state_symbols, every)(at)
        kept = [k for k, o in enumerate(plant.outputs) if o.symbol in outputs]
        measured = batch_jacobian("outputs", [readouts[k] for k in kept], plant.state_symbols, symbols)(at)
    return _Matrices(
        A=batch_jacobian("plant", rates, plant.state_symbols, symbols)(at),
        B=batch_jacobian("plant input", rates, [s.symbol for s in law.form.system.inputs], symbols)(at),
        C=measured,
        Ao=Ao,
        Bo=Bo,
        Co=Co,
        K=gains,
    )


def _values(plant: System, controller: Law | Compensator, grid: LoopGrid) -> dict[str, np.ndarray]:
    """(P,) values at rest of everything that plant, observer and law contain."""
    loop, size = grid.system, grid.rest.shape[0]
    held = {s.name: np.zeros(size) for s in loop.inputs}
    for system in (plant, controller.system):
        held |= {p.name: np.full(size, float(p.si_value)) for p in system.parameters if p.si_value is not None}
    states = {s.name: grid.rest[:, k] for k, s in enumerate(loop.states)}
    outputs = {o.name: grid.outputs[:, k] for k, o in enumerate(loop.outputs)}
    return {**held, **outputs, **states, **grid.points}


def _step(m: _Matrices, period: float, delay: float) -> np.ndarray:
    """(P, N, N) one sample of (plant, observer, command that is on its way)."""
    n, o, r, p = m.A.shape[1], m.Ao.shape[1], m.B.shape[2], m.C.shape[1]
    late, soon = _held(m.A, m.B, period, delay)
    phi = _exponential(m.A, period)
    step = np.zeros((m.A.shape[0], n + o + r, n + o + r))
    gains = np.concatenate([m.K, np.zeros((len(m.K), r, o))], axis=2) if o == 0 else m.K @ m.Co
    command = np.zeros((m.A.shape[0], r, n + o + r))
    command[:, :, (0 if o == 0 else n) : (n if o == 0 else n + o)] = gains
    step[:, :n, :n] = phi
    step[:, :n, n + o :] = late
    step[:, :n, :] += soon @ command
    step[:, n + o :, :] = command
    if o:
        late_o, soon_o = _held(m.Ao, m.Bo[:, :, :r], period, delay)
        older, newer = _ramped(m.Ao, m.Bo[:, :, r : r + p], period)
        step[:, n : n + o, n : n + o] += _exponential(m.Ao, period)
        step[:, n : n + o, n + o :] += late_o
        step[:, n : n + o, :] += soon_o @ command + newer @ m.C @ step[:, :n, :]
        step[:, n : n + o, :n] += older @ m.C
    return step


def _exponential(A: np.ndarray, time: float) -> np.ndarray:
    """(P, n, n) e^{At} of every matrix: Taylor series of the scaled matrix, squared back; SciPy loops over matrices."""
    found = np.asarray(np.isfinite(A).all(axis=(1, 2)))
    scaled = np.where(found[:, None, None], A, 0.0) * time
    largest = float(np.abs(scaled).sum(axis=1).max(initial=0.0))
    squarings = max(0, math.ceil(math.log2(largest / _RADIUS))) if largest > 0 else 0
    scaled = scaled / 2.0**squarings
    term = np.broadcast_to(np.eye(A.shape[1]), A.shape)
    result = term.copy()
    for k in range(1, _TERMS + 1):
        term = term @ scaled / k
        result += term
    for _ in range(squarings):
        result = result @ result
    return np.where(found[:, None, None], result, np.nan)


def _held(A: np.ndarray, B: np.ndarray, period: float, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """Effect over a period of the command held until `delay`, and of the one held after it."""
    before, after = _integral(A, B, delay), _integral(A, B, period - delay)
    return _exponential(A, period - delay) @ before, after


def _integral(A: np.ndarray, B: np.ndarray, time: float) -> np.ndarray:
    """∫₀ᵗ e^{As} ds B as a block of one exponential."""
    n, r = B.shape[1:]
    block = np.zeros((len(A), n + r, n + r))
    block[:, :n, :n], block[:, :n, n:] = A, B
    return _exponential(block, time)[:, :n, n:]


def _ramped(A: np.ndarray, B: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Effect over a period of the older and the newer value of an input on the straight line between them."""
    n, r = B.shape[1:]
    block = np.zeros((len(A), n + 2 * r, n + 2 * r))
    block[:, :n, :n], block[:, :n, n : n + r] = A, B
    block[:, n : n + r, n + r :] = np.eye(r)
    whole = _exponential(block, period)
    held, ramp = whole[:, :n, n : n + r], whole[:, :n, n + r :] / period
    return held - ramp, ramp


def _fastest(plant: System, grid: LoopGrid) -> float:
    at = {s.name: grid.rest[:, k] for k, s in enumerate(grid.system.states)}
    at |= {o.name: grid.outputs[:, k] for k, o in enumerate(grid.system.outputs)} | dict(grid.points)
    held = {p.name: np.full(1, float(p.si_value)) for p in plant.parameters if p.si_value is not None}
    symbols = [*plant.state_symbols, *plant.input_symbols, *plant.parameter_symbols]
    A = batch_jacobian("plant", plant.inline(plant.rates), plant.state_symbols, symbols)({**held, **at})
    return float(np.abs(np.linalg.eigvals(A[0]).real).max())


def _over_limits(
    controller: Law | Compensator, at: Mapping[str, float], limits: Mapping[str, float], start: Mapping[str, float]
) -> dict[str, float]:
    law = controller if isinstance(controller, Law) else controller.law
    symbols = [*law.system.input_symbols, *law.system.parameter_symbols]
    values = {s.name: np.zeros(1) for s in symbols}
    values |= {p.name: np.full(1, float(p.si_value)) for p in law.system.parameters if p.si_value is not None}
    values |= {n: np.full(1, float(v)) for n, v in {**at, **start}.items()}
    commands = batch_vector("law", law.system.inline(law.system.readouts), symbols)(values)[0]
    return {
        o.name: abs(float(c)) / limits[o.name]
        for o, c in zip(law.system.outputs, commands, strict=True)
        if o.name in limits
    }
