"""High-gain observer: for plants without an observer form whose outputs and their derivatives determine the state.

x̂' = f(x̂) + g(x̂) u + (∂Φ/∂x)⁻¹(x̂) diag(ε⁻¹, …, ε⁻ⁿ) K (y − h(x̂)) with Φ = (h, L_f h, …, L_f^{n−1} h) of each block.
Source: Gauthier, Hammouri and Othman, IEEE TAC 37 (1992).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from ulna.base import DesignError, NoFormError, Verdict, all_of
from ulna.design.gains import Gains, gain_matrix, gain_rule
from ulna.design.observers.observer import (
    Observer,
    controlled_rates,
    estimate_symbols,
    estimator_system,
)
from ulna.design.observers.output_functions import output_symbols
from ulna.geometry import Observability, differentials, lie_derivative, observability
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.exact import generic_rank, solve_linear
from ulna.symbolic.formulas import exact


@dataclass(frozen=True, slots=True, kw_only=True)
class HighGain:
    """The high-gain observer as a choice for `controller_for`: the arguments of `high_gain_observer`.

    Examples:
        >>> made = ulna.controller_for("duffing", law=[-1, -2], observer=ulna.HighGain(gains=[-1, -2], time_scale=0.05))
        >>> made.observer is not None
        True
    """

    gains: Gains
    time_scale: Any = 1


def high_gain_observer(system: PlantLike, gains: Gains, *, time_scale: Any = 1) -> Observer:
    """The high-gain observer of a plant; its error decays like exp(pole · t / ε) for ε small enough.

    Convergence needs Φ to be a diffeomorphism along the motion, f, g Lipschitz there, and the inputs to enter in a
    triangular way (`verdict` says whether they do); ε must be small enough for the plant's nonlinearity, which is not
    checked. The smaller ε, the larger the peak at the start and the more noise passes.

    Args:
        system: an observable plant.
        gains: poles of the scaled error, block after block in the order of the outputs.
        time_scale: ε > 0, exact; the poles divided by ε are those of the linear part of the error.

    Raises:
        NoFormError: if the drift's outputs do not determine the state; `value` is the `Observability`.
        DesignError: for ε ≤ 0 or gains that do not fit the blocks.

    Examples:
        >>> observer = ulna.high_gain_observer("duffing", [-1, -2], time_scale=0.05)
        >>> [state.name for state in observer.system.states]
        ['x1_hat', 'x2_hat']
    """
    system = as_plant(system)
    epsilon = _positive(time_scale)
    seen = observability(system)
    if not seen.observable.holds:
        raise NoFormError(
            f"high-gain observer of '{system.name}'",
            f"its outputs and their derivatives have rank {seen.rank.value} instead of {len(seen.view.x)}.",
            "Measure more, or use an extended Kalman filter if the rest of the state is stable.",
            value=seen,
        )
    polynomials = gain_rule(gains).polynomials(seen.indices)
    scaled = tuple(
        tuple(a / epsilon ** (len(polynomial) - k) for k, a in enumerate(polynomial)) for polynomial in polynomials
    )
    K = gain_matrix(seen.indices, [polynomial[::-1] for polynomial in scaled])  # a_{κ−k} on the k-th derivative
    found = solve_linear(sp.Matrix(seen.matrix), sp.Matrix(K))
    if found.solution is None:
        raise NoFormError(
            f"high-gain observer of '{system.name}'",
            "the Jacobian of the observability map could not be inverted in time.",
            "Use an extended Kalman filter.",
            value=found.verdict,
        )
    view = seen.view
    onto = dict(zip(view.x, estimate_symbols(system), strict=True))
    innovation = sp.Matrix(list(output_symbols(view.system))) - sp.Matrix(view.h).xreplace(onto)
    rates = controlled_rates(view).xreplace(onto) + found.solution.xreplace(onto) * innovation
    return Observer(
        plant=system,
        system=estimator_system(view.system, list(rates), "high-gain observer"),
        polynomials=scaled,
        verdict=triangular_inputs(seen),
    )


def triangular_inputs(seen: Observability) -> Verdict:
    """Whether inputs enter the derivatives of the outputs in a triangular way, so that no input spoils observability.

    L_g L_f^k h_i must be a function of the L_f^l h_j with l ≤ k. Refuted with the `function` and the `input`. With one
    output that is uniform observability itself (Gauthier and Bornard, IEEE TAC 26 (1981)); with several it suffices.
    """
    view = seen.view
    claim = f"the inputs of '{view.system.name}' enter the derivatives of its outputs in a triangular way"
    levels = [k for size in seen.indices for k in range(size)]
    parts = []
    for k in range(max(levels, default=0)):
        lower = tuple(h for h, level in zip(seen.functions, levels, strict=True) if level <= k)
        known = generic_rank(differentials(lower, view.x), seconds=0)
        for function, level in zip(seen.functions, levels, strict=True):
            if level != k:
                continue
            for signal, column in zip(view.system.inputs, view.input_fields, strict=True):
                slope = lie_derivative(function, column, view.x)
                with_it = generic_rank(differentials((*lower, slope), view.x))
                if with_it.value > known.value:
                    evidence = {"input": signal.name, "function": slope, "point": with_it.point}
                    return Verdict.refuted(claim, **evidence)
                parts.append(with_it.verdict)
    return all_of(claim, parts)


def _positive(value: Any) -> sp.Expr:
    try:
        number = exact(value)
    except (ValueError, TypeError):
        number = sp.Integer(0)
    if not number.is_positive:
        raise DesignError(
            "time scale of a high-gain observer", f"{value!r} is not a positive number.", "Give 0.1, say."
        )
    return number
