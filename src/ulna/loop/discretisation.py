"""How the controller's differential equations become the difference equations that a processor runs."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.base import SimulationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Euler:
    """ẑ_{k+1} = ẑ_k + h F(ẑ_k, y, u): first order.

    Args:
        substeps: steps of h = period / substeps.
        interpolate: take y on the straight line between the two samples instead of holding the older one.

    Examples:
        >>> ulna.Hardware(period=1e-3, discretisation=ulna.Euler(substeps=4)).discretisation
        Euler(substeps=4, interpolate=False)
    """

    substeps: int = 1
    interpolate: bool = False

    def __post_init__(self) -> None:
        _check_substeps("Euler", self.substeps)


@dataclass(frozen=True, slots=True, kw_only=True)
class RungeKutta4:
    """The classical Runge-Kutta steps: fourth order in what is held, second order where y is interpolated.

    Args:
        substeps: steps of h = period / substeps.
        interpolate: take y on the straight line between the two samples instead of holding the older one, which
            makes the whole controller first order.

    Examples:
        >>> ulna.Hardware(period=1e-3, discretisation=ulna.RungeKutta4(substeps=2)).discretisation
        RungeKutta4(substeps=2, interpolate=True)
    """

    substeps: int = 1
    interpolate: bool = True

    def __post_init__(self) -> None:
        _check_substeps("RungeKutta4", self.substeps)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExactHold:
    """ẑ_{k+1} = e^{Fh} ẑ_k + G₀ w(y_k, u_k) + G₁ w(y_{k+1}, u_k): exact where w is a straight line between samples.

    u is held, as the converter holds it. It needs a `LinearInjection` as estimator. States of the law (integrals of
    errors) advance by the trapezoidal rule.

    Args:
        interpolate: first-order hold of w; otherwise w keeps the value of the older sample, 150 times less exact at
            5 ms for the arm of the paper.

    Reference:
        G. F. Franklin, J. D. Powell, M. Workman, "Digital Control of Dynamic Systems", 3rd ed., section 6.3.2
        (triangle hold).

    Examples:
        >>> ulna.Hardware(period=1e-3, discretisation=ulna.ExactHold()).discretisation
        ExactHold(interpolate=True)
    """

    interpolate: bool = True


Discretisation = Euler | RungeKutta4 | ExactHold


def _check_substeps(name: str, substeps: int) -> None:
    if substeps < 1:
        raise SimulationError(f"{name}(substeps={substeps})", "expected at least one step a period.")
