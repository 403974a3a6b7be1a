"""The extended Kalman filter of a processor: predict with the plant's own step, update in Joseph form."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.base import SimulationError
from ulna.loop.discretisation import RungeKutta4
from ulna.loop.fitted import Fitted
from ulna.loop.rows import Pair, roles, row_of
from ulna.loop.runge_kutta import combined, moved
from ulna.program import Assembly, Kernel, Scalar, tangents

Matrix = list[list[Scalar]]


def filtered(
    loop: Fitted,
    w: Assembly,
    z: Sequence[Scalar],
    samples: Pair,
    references: Pair,
    outputs: dict[str, Scalar],
) -> list[Scalar]:
    """Estimates and the upper triangle of the covariance at this sample, measured values included.

    x⁻ = Step(x̂, u), P⁻ = Φ (P + Q T/2) Φᵀ + Q T/2 with Φ = ∂Step/∂x̂: the plant's explicit step over the period T as
    `Hardware(discretisation=...)` says, its own derivative, and the trapezoidal rule for the noise of the rates. Then
    one measured value after the other, each with the slopes of h at x⁻ and the variance R/T:

    s = H P Hᵀ + R/T, K = P Hᵀ/s, x̂ = x̂ + K e, P = (I − K H) P (I − K H)ᵀ + K (R/T) Kᵀ, which stays symmetric and
    positive whatever is rounded. At the first sample nothing is predicted: x⁻ and P⁻ are where the memory begins.

    Args:
        loop: whose estimator is a filter. w: of the step. z: memory.
        samples, references: measured values and references at the older and at this sample.
        outputs: gets `innovation<k>`, what measured value k differs from its prediction.

    Reference:
        D. Simon, "Optimal State Estimation" (2006), sections 5.3, 6.1 and 13.2.
    """
    known = loop.wiring.filter
    if known is None:
        raise SimulationError("a Kalman filter", "the loop has none.", "Give a compensator with one.")
    n, main = len(known.rates), loop.wiring.controller.main
    u = w.inputs("believed", len(loop.wiring.driven))
    entries = [(i, j) for i in range(n) for j in range(i, n)]
    begun, x = w.input("begun"), list(z[:n])
    P = _symmetric(n, dict(zip(entries, z[n:], strict=False)))
    prior, slopes = _predicted(loop, w, roles(z=x, y=samples[0], u=u, r=references[0]))
    half = [w.constant(0.5 * loop.period * float(each)) for each in known.process]
    grown = _grown(w, slopes, P, half)
    x = [begun.where(a, b) for a, b in zip(prior, x, strict=True)]
    P = _symmetric(n, {(i, j): begun.where(grown[i][j], P[i][j]) for i, j in entries})
    shown = row_of(main, "v")
    given = roles(z=x, y=samples[1], u=u, r=references[1])
    innovations = list(w.call(loop.written(shown), given).values())
    found = w.call(loop.written(tangents(shown, [f"z{k}" for k in range(n)], piecewise=True)), given)
    outputs |= {f"innovation{k}": value for k, value in enumerate(innovations)}
    before, zero = list(x), w.constant(0.0)
    for k, innovation in enumerate(innovations):
        slope = [found.get(f"v{k}/z{i}", zero) for i in range(n)]
        row = {i: -each for i, each in enumerate(slope) if each.index != zero.index}
        error = innovation
        for i, each in row.items() if k else ():
            error = error - each * (x[i] - before[i])
        x, P = _updated(w, x, P, row, error, float(known.measurement[k]) / loop.period)
    return [*x, *(P[i][j] for i, j in entries)]


def _predicted(loop: Fitted, w: Assembly, given: dict[str, Scalar]) -> tuple[list[Scalar], Matrix]:
    """The plant's step from the estimates with its inputs held, and its slopes."""
    step = _step(loop)
    names = [f"z{k}" for k in range(len(step.outputs))]
    slopes = w.call(loop.written(tangents(step, names, piecewise=True)), given)
    rows = [[slopes[f"x{i}/{name}"] for name in names] for i in range(len(names))]
    return list(w.call(loop.written(step), given).values()), rows


def _step(loop: Fitted) -> Kernel:
    """The kernel of the explicit step over a period, in formulas that can be differentiated."""
    w, rule = Assembly("prediction"), loop.hardware.discretisation
    rates = row_of(loop.wiring.controller.main, "f")
    z = w.inputs("z", len(rates.outputs))
    count = getattr(rule, "substeps", 1)
    h = w.input("period") / float(count)
    for _ in range(count):
        k1 = _rates(w, rates, z)
        if not isinstance(rule, RungeKutta4):
            z = moved(z, h, k1)
            continue
        half = 0.5 * h
        k2 = _rates(w, rates, moved(z, half, k1))
        k3 = _rates(w, rates, moved(z, half, k2))
        z = combined(z, h / 6.0, (k1, k2, k3, _rates(w, rates, moved(z, h, k3))))
    return w.finished({f"x{k}": value for k, value in enumerate(z)})


def _rates(w: Assembly, rates: Kernel, z: Sequence[Scalar]) -> list[Scalar]:
    return list(w.call(rates, roles(z=z)).values())


def _grown(w: Assembly, slopes: Matrix, P: Matrix, half: Sequence[Scalar]) -> Matrix:
    """Φ (P + half) Φᵀ + half."""
    n = len(P)
    wider = [[P[i][j] + half[i] if i == j else P[i][j] for j in range(n)] for i in range(n)]
    left = [[_sum(w, slopes[i], [wider[k][j] for k in range(n)]) for j in range(n)] for i in range(n)]
    upper = {(i, j): _sum(w, left[i], slopes[j]) for i in range(n) for j in range(i, n)}
    return _symmetric(n, {(i, j): value + half[i] if i == j else value for (i, j), value in upper.items()})


def _updated(
    w: Assembly, x: list[Scalar], P: Matrix, row: dict[int, Scalar], error: Scalar, variance: float
) -> tuple[list[Scalar], Matrix]:
    """Estimates and covariance after one measured value; `row` holds the entries of H that are not 0."""
    n, r, slopes = len(x), w.constant(variance), list(row.values())
    seen = [_sum(w, slopes, [P[i][k] for k in row]) for i in range(n)]
    size = _sum(w, slopes, [seen[k] for k in row]) + r
    gain = [value / size for value in seen]
    left = [[P[i][j] - gain[i] * seen[j] for j in range(n)] for i in range(n)]
    back = [_sum(w, slopes, [left[i][k] for k in row]) for i in range(n)]
    upper = {(i, j): left[i][j] - back[i] * gain[j] + r * (gain[i] * gain[j]) for i in range(n) for j in range(i, n)}
    return [k.fused(error, value) for k, value in zip(gain, x, strict=True)], _symmetric(n, upper)


def _sum(w: Assembly, one: Sequence[Scalar], other: Sequence[Scalar]) -> Scalar:
    """Σ one · other; what is zero costs nothing."""
    total, zero = None, w.constant(0.0)
    for a, b in zip(one, other, strict=True):
        if zero.index in (a.index, b.index):
            continue
        total = a * b if total is None else a.fused(b, total)
    return zero if total is None else total


def _symmetric(n: int, upper: dict[tuple[int, int], Scalar]) -> Matrix:
    return [[upper[min(i, j), max(i, j)] for j in range(n)] for i in range(n)]
