"""Extended Kalman filter, in continuous time and what it is made of for a processor.

In continuous time (Kalman and Bucy; Gelb, Applied Optimal Estimation, 1974, section 6.1)
x̂' = f(x̂) + g(x̂) u + P Hᵀ R⁻¹ (y − h(x̂)), P' = F P + P Fᵀ + Q − P Hᵀ R⁻¹ H P with F = ∂(f + g u)/∂x and H = ∂h/∂x at x̂.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import DesignError, PlantError, Verdict
from ulna.design.observers.observer import Observer, controlled_rates, estimate_symbols, estimator_system
from ulna.design.observers.output_functions import output_symbols
from ulna.geometry import observability
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.formulas import exact
from ulna.system import KalmanFilter, Signal, System, control_affine


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanNoise:
    """The noise densities that a Kalman filter assumes.

    Densities are those of white noise in continuous time, in SI² s: samples of standard deviation σ every T seconds
    have σ² T, an encoder of step q has q² T/12. On a processor a sample's variance is density / T again.

    Attributes:
        process: (n,) spectral densities of the rates, the diagonal of Q, by position or by state name.
        measurement: (p,) spectral densities of the outputs, the diagonal of R, by position or by output name.
        covariance: (n,) the diagonal of P at the start, by position or by state name.

    What is left out is 1.

    Examples:
        >>> ulna.KalmanNoise(process={"x1": 1e-6, "x2": 1e-2}, measurement={"y": 1e-4}).measurement
        {'y': 0.0001}
    """

    process: Sequence[Any] | Mapping[str, Any] | None = None
    measurement: Sequence[Any] | Mapping[str, Any] | None = None
    covariance: Sequence[Any] | Mapping[str, Any] | None = None


def extended_kalman_filter(system: PlantLike, noise: KalmanNoise | None = None) -> Observer:
    """The filter as a system with n estimates and the n(n+1)/2 entries `cov_<state>_<state>` of P.

    In a loop with a processor it is the filter in discrete time: predict with the plant's own step over the period,
    update in Joseph form at each sample, the first one included.

    It converges locally where the plant is observable along the motion; nothing is promised from afar.

    Args:
        system: a plant with at least one output.
        noise: what it is tuned to; all densities 1 if left out.

    Raises:
        PlantError: for a plant without output.
        DesignError: for densities that are not numbers, of the wrong sign or number, or under unknown names.

    Examples:
        >>> filtered = ulna.extended_kalman_filter("duffing", ulna.KalmanNoise(measurement=[1e-4]))
        >>> [state.name for state in filtered.system.states]
        ['x1_hat', 'x2_hat', 'cov_x1_x1', 'cov_x1_x2', 'cov_x2_x2']
    """
    system, noise = as_plant(system), noise or KalmanNoise()
    view = control_affine(system)
    if not len(view.h):
        raise PlantError(f"extended Kalman filter of '{system.name}'", "the plant has no output.", "Add [outputs].")
    Q, R = densities(system, noise)
    start = _diagonal(noise.covariance, [s.name for s in system.states], "initial covariance", positive=False)
    hats = estimate_symbols(system)
    onto = dict(zip(view.x, hats, strict=True))
    P, entries = _covariance(system)
    drift = controlled_rates(view)
    F = drift.jacobian(list(view.x)).xreplace(onto)
    H = sp.Matrix(view.h.jacobian(list(view.x))).xreplace(onto)
    gain = P * H.T * R.inv()
    innovation = sp.Matrix(list(output_symbols(view.system))) - sp.Matrix(view.h).xreplace(onto)
    riccati = F * P + P * F.T + Q - gain * H * P
    further = {Signal(name=name, text=f"covariance of {a} and {b}"): riccati[i, j] for name, a, b, i, j in entries}
    moved = drift.xreplace(onto)
    whole = estimator_system(view.system, list(moved + gain * innovation), "extended Kalman filter", further=further)
    return Observer(
        plant=system,
        system=whole,
        polynomials=(),
        verdict=_locally(system),
        initial={name: start[i, i] if i == j else sp.Integer(0) for name, _, _, i, j in entries},
        sampled=KalmanFilter(
            system=whole,
            rates=tuple(moved),
            innovations=tuple(innovation),
            process=tuple(Q.diagonal()),
            measurement=tuple(R.diagonal()),
        ),
    )


def densities(system: System, noise: KalmanNoise) -> tuple[sp.Matrix, sp.Matrix]:
    """Q (n, n) and R (p, p), diagonal.

    Raises:
        DesignError: for densities that are not numbers, of the wrong sign or number, or under unknown names.
    """
    Q = _diagonal(noise.process, [s.name for s in system.states], "process noise", positive=False)
    R = _diagonal(noise.measurement, [s.name for s in system.outputs], "measurement noise", positive=True)
    return Q, R


def _covariance(system: System) -> tuple[sp.Matrix, list[tuple[str, str, str, int, int]]]:
    """P with symbols, and (name, state, state, row, column) of its upper triangle row by row."""
    names = [s.name for s in system.states]
    n = len(names)
    entries = [(f"cov_{names[i]}_{names[j]}", names[i], names[j], i, j) for i in range(n) for j in range(i, n)]
    P = sp.zeros(n, n)
    for name, _, _, i, j in entries:
        P[i, j] = P[j, i] = sp.Symbol(name, real=True)
    return P, entries


def _diagonal(
    values: Sequence[Any] | Mapping[str, Any] | None, names: Sequence[str], what: str, *, positive: bool
) -> sp.Matrix:
    if isinstance(values, Mapping):
        unknown = sorted(set(values) - set(names))
        if unknown:
            raise DesignError(what, f"'{unknown[0]}' is not among {', '.join(names)}.", "Name states or outputs.")
        row = [values.get(name, 1) for name in names]
    else:
        row = list(values) if values is not None else [1] * len(names)
    if len(row) != len(names):
        raise DesignError(what, f"{len(row)} numbers given, {len(names)} needed ({', '.join(names)}).")
    numbers = []
    for name, value in zip(names, row, strict=True):
        try:
            number = exact(value)
        except (ValueError, TypeError):
            raise DesignError(f"{what} of '{name}'", f"{value!r} is not a finite number.") from None
        if number < 0 or (positive and number == 0):
            sign = "positive" if positive else "zero or more"
            raise DesignError(f"{what} of '{name}'", f"{value} is not {sign}.", "Give a spectral density.")
        numbers.append(number)
    return sp.diag(*numbers)


def _locally(system: System) -> Verdict:
    """Local convergence rests on observability at the operating point; it is not proved here."""
    seen = observability(system)
    claim = f"the filter of '{system.name}' converges from small errors near the operating point"
    if seen.observable_at_point.fails:
        return Verdict.undecided(claim, rank=seen.at_point.value, reason="not observable there by its drift")
    return Verdict.undecided(claim, reason="observable there; convergence depends on noise, motion and first error")
