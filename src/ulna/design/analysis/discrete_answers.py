"""What is answered about a plant in discrete time: its rest point and its linearisation there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import sympy as sp

from ulna.base import UlnaError, Verdict
from ulna.design.analysis.answer import Answer, decided, not_applicable
from ulna.symbolic.exact import rank_of_numbers
from ulna.system import Equilibrium, Linearisation, System, linearise, measured_part

_KEYS = ("linearisation", "eigenvalues", "stable", "reachability_rank", "observability_rank")
_MARGIN = 1e-9
"""Distance of an eigenvalue from the unit circle below which rounding may decide."""


def discrete_answers(system: System, point: Equilibrium) -> Mapping[str, Answer]:
    """The answers by key: docs/analysis.md."""
    answers = {"equilibrium": decided(point.verdict)}
    if not point.verdict.holds:
        return answers | {key: not_applicable(key, "no rest point was found") for key in _KEYS}
    try:
        found = linearise(system, point)
        matrices = {name: getattr(found, name) for name in "ABCD"}
        answers["linearisation"] = Answer(verdict=point.verdict.restated("linearisation at the point"), value=matrices)
        return answers | _in_numbers(system, point, found)
    except UlnaError as error:
        return answers | {key: not_applicable(key, str(error)) for key in _KEYS if key not in answers}


def _in_numbers(system: System, point: Equilibrium, found: Linearisation) -> dict[str, Answer]:
    values = {**system.values, **point.parameters}
    missing = sorted({s.name for M in (found.A, found.B, found.C) for s in M.xreplace(values).free_symbols})
    if missing:
        reason = f"no value is given for {', '.join(missing)}"
        return {key: not_applicable(key, reason) for key in _KEYS if key != "linearisation"}
    seen = {s.name for s in measured_part(system).outputs}
    rows = [k for k, s in enumerate(system.outputs) if s.name in seen]
    A, B, C = (_numbers(M.xreplace(values)) for M in (found.A, found.B, found.C[rows, :]))
    eigenvalues = found.eigenvalues
    n, tolerance = len(A), {"tolerance": _MARGIN}
    return {
        "eigenvalues": Answer(
            verdict=Verdict.supported("eigenvalues in numbers", **tolerance), value=list(eigenvalues)
        ),
        "stable": _stable(max(map(abs, eigenvalues), default=0.0)),
        "reachability_rank": _rank("rank of (B, AB, …) at the point", A, B, n),
        "observability_rank": _rank("rank of (C, CA, …) at the point", A.T, C.T, n),
    }


def _stable(largest: float) -> Answer:
    claim, evidence = "small deviations from the rest point die out", {"largest": largest, "tolerance": _MARGIN}
    if abs(largest - 1.0) <= _MARGIN:
        reason = "an eigenvalue lies on the unit circle: the linearisation does not decide"
        return decided(Verdict.undecided(claim, reason=reason, **evidence))
    return decided(Verdict.supported(claim, **evidence) if largest < 1.0 else Verdict.refuted(claim, **evidence))


def _numbers(matrix: sp.ImmutableDenseMatrix) -> np.ndarray:
    return np.array(matrix.evalf(), dtype=float).reshape(matrix.shape)


def _rank(claim: str, A: np.ndarray, B: np.ndarray, n: int) -> Answer:
    blocks, block = [np.zeros((n, 0))], B
    for _ in range(n):
        # The scale of a block changes no rank and keeps high powers from drowning the others.
        blocks.append(block / (np.abs(block).max(initial=0.0) or 1.0))
        block = A @ blocks[-1]
    return Answer(verdict=Verdict.supported(claim, states=n), value=rank_of_numbers(np.hstack(blocks)))
