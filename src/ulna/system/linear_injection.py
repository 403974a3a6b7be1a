"""`LinearInjection`: an observer whose state is linear up to a function of what is measured and applied."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearInjection:
    """An observer ẑ' = F ẑ + w(y, u), x̂ = R(ẑ, y), which can be discretised exactly between samples.

    It stands below design, which builds it, and simulation, which runs it: the two do not know each other.

    Attributes:
        system: the observer as it stands in continuous time: states ẑ, inputs u and y, outputs the estimates.
        matrix: (n, n) F, exact; A − L C of an observer form.
        injection: (n,) w(y, u); γ(y, u) + L ψ(y) of an observer form.
        start: (n,) ẑ as functions of the estimates' symbols, z = T(x); tells where ẑ starts for given estimates.

    Raises:
        PlantError: shapes that differ, or an injection that depends on ẑ.
    """

    system: System
    matrix: sp.ImmutableDenseMatrix
    injection: tuple[sp.Expr, ...]
    start: tuple[sp.Expr, ...]

    def __post_init__(self) -> None:
        n = len(self.system.states)
        if self.matrix.shape != (n, n) or len(self.injection) != n or len(self.start) != n:
            raise PlantError(
                f"linear injection of '{self.system.name}'",
                f"matrix {self.matrix.shape}, {len(self.injection)} injections and {len(self.start)} starting values "
                f"for {n} states.",
            )
        states = set(self.system.state_symbols)
        mixed = [e for e in (*self.injection, *self.matrix) if e.free_symbols & states]
        if mixed:
            raise PlantError(
                f"linear injection of '{self.system.name}'",
                f"{mixed[0]} depends on the observer's own state.",
                "Only functions of y and u may be injected.",
            )
