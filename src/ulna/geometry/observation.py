"""Observability: what the outputs and their derivatives along the flow tell about the state (paper eq. 43-44).

Rows are differentials of functions L_f^k h_i: the drift alone gives Kalman's matrix of a linear plant and the one the
observer form is built from. What *some* input shows besides: `observation_space`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from sympy import Expr, ImmutableDenseMatrix, Symbol

from ulna.base import Status, Verdict
from ulna.geometry.lie import lie_derivative
from ulna.geometry.observation_at_point import rank_of_all_rows
from ulna.geometry.smoothness import require_smooth
from ulna.symbolic.exact import Rank, attempt, generic_rank, minor_determinant, rank_at
from ulna.system import ControlAffine, System, control_affine, equilibrium

_SECONDS = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Observability:
    """The observability matrix of a plant's drift, and its ranks.

    Attributes:
        view: the control-affine view the rows belong to.
        functions: L_f^k h_i, those of output 1 first; (n) of them for a single output, else the independent ones.
        matrix: their differentials as rows, (len(functions), n).
        indices: (p,) how many derivatives of each output count, level by level (observability indices).
        rank: generic rank; at_point: the rank at the operating point, of all rows with k < n.
        point: the operating point's states.
        determinant: of the matrix where it is square and regular, in factors; zero on the singular set. None else.
        observable: on "the drift's outputs determine the state near almost every point".
        observable_at_point: the same at the operating point.
    """

    view: ControlAffine
    functions: tuple[Expr, ...]
    matrix: ImmutableDenseMatrix
    indices: tuple[int, ...]
    rank: Rank
    at_point: Rank
    point: Mapping[Symbol, Expr]
    determinant: Expr | None
    observable: Verdict
    observable_at_point: Verdict

    @property
    def system(self) -> System:
        """The plant."""
        return self.view.system

    def _repr_latex_(self) -> str:
        from ulna.symbolic.formulas import expression_latex

        return f"$${expression_latex(self.matrix)}$$"


@lru_cache(maxsize=64)
def observability(system: System) -> Observability:
    """Observability matrix, indices and ranks of the drift; a plant without output is refuted, not an error.

    The indices follow Krener and Respondek: at level k the differential of L_f^k h_i counts if it is independent of
    all lower levels and of the earlier outputs' at this level. A single output always gets its n rows.

    Raises:
        UlnaError: for terms without derivatives (abs, sign, …); NotAffineError if the inputs do not enter linearly.

    Examples:
        >>> seen = ulna.observability(ulna.model("duffing"))
        >>> seen.indices, seen.observable.holds
        ((2,), True)
    """
    view = control_affine(system)
    require_smooth([*view.f, *view.h], f"observability of '{system.name}'")
    here = equilibrium(system)
    chains = _chains(view)
    functions = tuple(h for chain in chains for h in chain)
    indices = tuple(len(chain) for chain in chains)
    matrix = differentials(functions, view.x)
    rank = generic_rank(matrix)
    if len(chains) == 1:
        indices = (rank.value,)
    local = _rank_at(view, matrix, here.where, rank)
    determinant = None
    if rank.value == matrix.rows == len(view.x):
        determinant = attempt(_SECONDS, "determinant", minor_determinant, matrix, rank).value
    return Observability(
        view=view,
        functions=functions,
        matrix=matrix,
        indices=indices,
        rank=rank,
        at_point=local,
        point=here.states,
        determinant=determinant,
        observable=full_rank(rank, view, "almost everywhere", rows=matrix.rows),
        observable_at_point=full_rank(local, view, here.phrase, rows=matrix.rows),
    )


def differentials(functions: tuple[Expr, ...], coordinates: tuple[Symbol, ...]) -> ImmutableDenseMatrix:
    """dF as rows, (number of functions, n)."""
    entries = [h.diff(x) for h in functions for x in coordinates]
    return ImmutableDenseMatrix(len(functions), len(coordinates), entries)


def _chains(view: ControlAffine) -> list[list[Expr]]:
    """For every output the functions h, L_f h, …: n of them for a single output, else the independent ones."""
    if view.h.rows == 1:
        chain = [view.h[0]]
        while len(chain) < len(view.x):
            chain.append(lie_derivative(chain[-1], view.f, view.x))
        return [chain]
    chains: list[list[Expr]] = [[] for _ in view.h]
    newest: dict[int, Expr] = dict(enumerate(view.h))
    kept: list[Expr] = []
    while newest and len(kept) < len(view.x):
        for i, function in list(newest.items()):
            if len(kept) < len(view.x) and extends(kept, function, view.x):
                kept.append(function)
                chains[i].append(function)
                newest[i] = lie_derivative(function, view.f, view.x)
            else:
                del newest[i]
    return chains


def extends(kept: list[Expr], function: Expr, coordinates: tuple[Symbol, ...]) -> bool:
    """Whether the differential of a function is independent of those of the functions kept."""
    if not function.free_symbols & set(coordinates):
        return False
    return generic_rank(differentials((*kept, function), coordinates), seconds=0).value > len(kept)


def _rank_at(view: ControlAffine, matrix: ImmutableDenseMatrix, point: Mapping[Symbol, Expr], rank: Rank) -> Rank:
    """The rank there of all rows with k < n; the higher ones are looked at only where the chosen ones do not suffice.

    Nowhere is it larger than the generic one.
    """
    local = rank_at(matrix, point)
    if len(view.h) < 2 or local.value >= rank.value:
        return local
    found = attempt(_SECONDS, "rank", rank_of_all_rows, view, point).value
    return local if found is None or not found.verdict.holds else found


def full_rank(rank: Rank, view: ControlAffine, where: str, **more: object) -> Verdict:
    """Whether the plant is observable there, from the rank of what its outputs show; with further evidence."""
    n = len(view.x)
    claim = f"'{view.system.name}' is observable {where} (rank {n})"
    if not len(view.h):
        return Verdict.refuted(claim, reason="the plant has no output", rank=0)
    if rank.verdict.status is Status.UNDECIDED:
        return Verdict.undecided(claim, **rank.verdict.evidence)
    evidence = {"rank": rank.value, "point": rank.point, **more}
    if rank.value == n:
        return Verdict.proved(claim, **evidence)
    # The rank found is certain from below; that it is no larger is as sure as its verdict.
    if rank.verdict.status is Status.PROVED:
        return Verdict.refuted(claim, **evidence)
    return Verdict.refuted(claim, certainty="no larger rank at random points", **evidence)
