"""`KalmanFilter`: an extended Kalman filter as a processor runs it, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class KalmanFilter:
    """What a filter is made of, apart from its equations in continuous time.

    It stands below design, which builds it, and the loop, which runs it: the two do not know each other.

    Attributes:
        system: the filter as it stands in continuous time: states the n estimates, then the upper triangle of the
            covariance row by row; inputs u and y; outputs the estimates.
        rates: (n,) of the plant at the estimates. innovations: (p,) y − h at the estimates.
        process, measurement: (n,) and (p,) spectral densities, the diagonals of Q and R.

    Raises:
        PlantError: numbers of states, rates and densities that do not fit each other.
    """

    system: System
    rates: tuple[sp.Expr, ...]
    innovations: tuple[sp.Expr, ...]
    process: tuple[sp.Expr, ...]
    measurement: tuple[sp.Expr, ...]

    def __post_init__(self) -> None:
        n, states = len(self.rates), len(self.system.states)
        if states != n + n * (n + 1) // 2 or len(self.process) != n or len(self.innovations) != len(self.measurement):
            raise PlantError(
                f"Kalman filter '{self.system.name}'",
                f"{states} states, {n} rates, {len(self.innovations)} innovations, densities of {len(self.process)} "
                f"states and {len(self.measurement)} outputs.",
            )
