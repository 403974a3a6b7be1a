"""The structure of a large plant in numbers: brackets by graph differentiation (CasADi), ranks at random points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ulna.base import OptionalDependencyError, Verdict
from ulna.symbolic.exact import rank_of_numbers
from ulna.system import SystemKernel

SEED = 5039
POINTS = 3
TOLERANCE = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
class NumericStructure:
    """Ranks of a plant at random points; every answer is supported, none is proved.

    Attributes:
        dimensions: (n,) dimensions of G_0 ⊂ … ⊂ G_{n−1}.
        rank: the last of them; rank_at_point: the same at the given point.
        involutive: whether all G_k, k ≤ n − 2, are; a refutation tells the level and the ranks.
        observability_rank: rank of dh, dL_f h, …; None without functions.
        observability_rank_at_point: the same at the given point.
    """

    dimensions: tuple[int, ...]
    rank: int
    rank_at_point: int
    involutive: Verdict
    observability_rank: int | None
    observability_rank_at_point: int | None


def numeric_structure(field: SystemKernel, point: np.ndarray) -> NumericStructure:
    """Controllability, involutivity and observability of a plant in numbers.

    Args:
        field: the plant's kernel.
        point: (n,) the operating point.

    Raises:
        OptionalDependencyError: without CasADi, the extra [large].
    """
    graph = _Graph(field)
    generator = np.random.default_rng(SEED)
    places = [generator.uniform(0.2, 1.2, len(field.states)) for _ in range(POINTS)]
    dimensions, at_point = _dimensions(graph, places, point)
    seen, seen_here = _observability(graph, places, point)
    return NumericStructure(
        dimensions=dimensions,
        rank=dimensions[-1] if dimensions else 0,
        rank_at_point=at_point,
        involutive=_involutive(graph, places),
        observability_rank=seen,
        observability_rank_at_point=seen_here,
    )


class _Graph:
    """Drift, input fields, their brackets and outputs as CasADi expressions in the state."""

    def __init__(self, field: SystemKernel) -> None:
        try:
            import casadi as ca
        except ImportError:
            raise OptionalDependencyError("the numeric road for large plants", "large") from None
        from ulna.program.lowering.casadi import to_casadi

        self.ca = ca
        self.n, self.m = len(field.states), len(field.inputs)
        self.x = ca.SX.sym("x", self.n)
        u = ca.SX.sym("u", self.m)
        outputs = to_casadi(field.kernel)(ca.vertcat(self.x, u))
        rates = outputs[: self.n]
        self.f = ca.substitute(rates, u, ca.SX.zeros(self.m))
        self.h = outputs[self.n :]
        inputs = ca.jacobian(rates, u)
        self.levels: list[list[Any]] = [[ca.simplify(inputs[:, j]) for j in range(self.m)]]

    def level(self, k: int) -> list[Any]:
        """The fields ad_f^k g_j."""
        while len(self.levels) <= k:
            self.levels.append([self.bracket_with_drift(field) for field in self.levels[-1]])
        return self.levels[k]

    def bracket_with_drift(self, field: Any) -> Any:
        """[f, X] = (∂f/∂x) X − (∂X/∂x) f."""
        return self.ca.jtimes(self.f, self.x, field) - self.ca.jtimes(field, self.x, self.f)

    def values(self, expression: Any, place: np.ndarray) -> np.ndarray:
        """The expression at a point."""
        return np.array(self.ca.Function("v", [self.x], [expression])(place))


def _dimensions(graph: _Graph, places: list[np.ndarray], point: np.ndarray) -> tuple[tuple[int, ...], int]:
    if not graph.m:
        return (0,) * graph.n, 0
    dimensions: list[int] = []
    here = 0
    for k in range(graph.n):
        fields = graph.ca.horzcat(*(field for level in range(k + 1) for field in graph.level(level)))
        dimensions.append(max(rank_of_numbers(graph.values(fields, place)) for place in places))
        here = rank_of_numbers(graph.values(fields, point))
        if dimensions[-1] == graph.n or (k and dimensions[-1] == dimensions[-2]):
            break
    return tuple(dimensions + [dimensions[-1]] * (graph.n - len(dimensions))), here


def _involutive(graph: _Graph, places: list[np.ndarray]) -> Verdict:
    claim = "all G_k, k <= n - 2, are involutive"
    evidence = {"points": len(places), "seed": SEED, "tolerance": TOLERANCE}
    fields: list[Any] = []
    for k in range(min(len(graph.levels), max(graph.n - 1, 1))):
        fields += graph.level(k)
        stacked = graph.ca.vertcat(*fields)
        slopes = graph.ca.jacobian(stacked, graph.x)
        both = graph.ca.Function("both", [graph.x], [stacked, slopes])
        for place in places:
            values, jacobians = (np.array(part) for part in both(place))
            own = values.reshape(len(fields), graph.n)
            jacobian = jacobians.reshape(len(fields), graph.n, graph.n)
            products = np.einsum("aij,bj->abi", jacobian, own)
            brackets = (products - products.transpose(1, 0, 2)).reshape(-1, graph.n)
            before, after = rank_of_numbers(own.T), rank_of_numbers(np.vstack([own, brackets]).T)
            if after > before:
                return Verdict.refuted(claim, level=k, rank=before, rank_with_brackets=after, **evidence)
    return Verdict.supported(claim, **evidence)


def _observability(graph: _Graph, places: list[np.ndarray], point: np.ndarray) -> tuple[int | None, int | None]:
    if not graph.h.shape[0]:
        return None, None
    rows, last = [], graph.h
    best = here = 0
    for _ in range(graph.n):
        rows.append(graph.ca.jacobian(last, graph.x))
        matrix = graph.ca.vertcat(*rows)
        rank = max(rank_of_numbers(graph.values(matrix, place).T) for place in places)
        here = rank_of_numbers(graph.values(matrix, point).T)
        if rank in (best, graph.n):
            best = rank
            break
        best = rank
        last = graph.ca.jtimes(last, graph.x, graph.f)
    return best, here
