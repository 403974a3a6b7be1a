"""Local observers: a copy of the plant, corrected by a constant gain from the linearisation where it rests."""

from __future__ import annotations

import numpy as np
import sympy as sp

from ulna.base import DesignError, PlantError, Verdict
from ulna.design.gains import Gains, characteristic, gain_rule
from ulna.design.linear import LinearPlant, as_numbers, least_cost, linear_plant, split
from ulna.design.observers.extended_kalman import KalmanNoise, densities
from ulna.design.observers.observer import Observer, estimate_symbols, estimator_system
from ulna.design.observers.output_functions import output_symbols
from ulna.plants import PlantLike, as_plant
from ulna.system import PointLike


def local_observer(plant: PlantLike, gains: Gains | KalmanNoise, *, at: PointLike | None = None) -> Observer:
    """The observer x̂' = F(x̂, u) + L (y − h(x̂, u)) with L constant, from the linearisation at a point of rest.

    From small errors near the point the estimates converge exponentially, with the poles of A − L C; nothing is
    promised from afar. With noise L is the gain at which a Kalman filter there comes to rest (`lqe` of other tools).

    Args:
        plant: its parameters are put at their values; it need not be affine in its inputs.
        gains: poles, one for each mode that the outputs show, `Bandwidth(omega)`, or `KalmanNoise(...)`.
        at: the point; left out, the operating point.

    Raises:
        PlantError: for a plant without output.
        DesignError: where the plant does not rest, a mode grows or stays that no output shows, or gains do not fit.

    Examples:
        >>> observer = ulna.local_observer("cart_pole", [-4, -5, -6, -7])
        >>> [state.name for state in observer.system.states]
        ['p_hat', 's_hat', 'th_hat', 'om_hat']
    """
    system = as_plant(plant)
    if not system.outputs:
        raise PlantError(f"local observer of '{system.name}'", "the plant has no output.", "Add [outputs].")
    linear = linear_plant(system, at)
    system, asked = linear.system, f"a local observer of '{linear.system.name}'"
    _require_detectable(linear, asked)
    A, C = sp.ImmutableDenseMatrix(linear.A.T), sp.ImmutableDenseMatrix(linear.C.T)
    if isinstance(gains, KalmanNoise):
        q, r = (np.array([float(e) for e in m.diagonal()]) for m in densities(system, gains))
        L = least_cost(A, C, (q, r), linear.names, asked).T
    else:
        L = gain_rule(gains).feedback(A, C, linear.names, asked).T
    onto = dict(zip(system.state_symbols, estimate_symbols(system), strict=True))
    seen = sp.Matrix([e.xreplace(onto) for e in system.inline(system.readouts)])
    copy = sp.Matrix([e.xreplace(onto) for e in system.inline(system.rates)])
    rates = copy + L * (sp.Matrix(list(output_symbols(system))) - seen)
    claim = f"the estimates of '{system.name}' converge from small errors near {linear.where}"
    polynomial = characteristic(linear.A - L * linear.C)
    return Observer(
        plant=system,
        system=estimator_system(system, list(rates), "local observer"),
        polynomials=(polynomial,),
        verdict=Verdict.supported(claim, reason="the error of the linearisation is stable, in numbers"),
    )


def _require_detectable(linear: LinearPlant, asked: str) -> None:
    found = split(as_numbers(linear.A).T, as_numbers(linear.C).T, linear.names)
    hidden = [mode for mode in found.fixed if not mode.stable]
    if hidden:
        raise DesignError(
            asked,
            f"no output shows the mode{'s' * (len(hidden) > 1)} {'; '.join(map(str, hidden))}.",
            f"Measure {hidden[0].states[0]} too.",
        )
