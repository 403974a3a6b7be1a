"""What slopes of outputs tell of parameters when noise of known size lies on the outputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ulna.identification.sensitivity import Sensitivities

TOLD = 1e-7
"""Share of a parameter's slopes that must be its own: below, other unknowns move the outputs as it does."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Precision:
    """How surely parameters come out of a motion whose start is unknown too.

    Attributes:
        information: log det of the Fisher information of the parameters, each in its own size; -inf where singular.
        deviations: (q,) standard errors, SI (Cramér and Rao: no unbiased fit has smaller ones).
        hidden: (q,) whether a parameter cannot be told from the others and the start.
    """

    information: float
    deviations: np.ndarray
    hidden: np.ndarray


def precision(motion: Sensitivities, count: int, noise: np.ndarray, sizes: np.ndarray) -> Precision:
    """What a motion tells of the first `count` names along it; the rest are unknown as well, but not asked for.

    Args:
        noise: (p,) standard deviations of independent noise on the outputs. sizes: (count,) of the parameters.

    Reference:
        V. V. Fedorov, Theory of Optimal Experiments, Academic Press 1972, chapter 2.
    """
    rows = (motion.output_slopes / noise[:, None]).reshape(-1, len(motion.along))
    asked = rows[:, :count] * sizes
    left = asked - _within(rows[:, count:], asked)
    lengths, whole = np.linalg.norm(left, axis=0), np.linalg.norm(asked, axis=0)
    hidden = ~(lengths > TOLD * np.maximum(whole, np.finfo(float).tiny))
    for k in np.flatnonzero(~hidden):
        others = np.delete(left, k, axis=1)
        own = np.linalg.norm(left[:, k] - _within(others, left[:, [k]])[:, 0])
        hidden[k] = own <= TOLD * lengths[k]
    if hidden.any():
        return Precision(information=-np.inf, deviations=np.where(hidden, np.inf, np.nan), hidden=hidden)
    triangle = np.linalg.qr(left, mode="r")
    deviations = sizes * np.linalg.norm(np.linalg.inv(triangle), axis=1)
    information = 2 * float(np.log(np.abs(np.diag(triangle))).sum())
    return Precision(information=information, deviations=deviations, hidden=hidden)


def _within(columns: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """The part of vectors that columns span; columns that vanish or repeat count for nothing."""
    lengths = np.linalg.norm(columns, axis=0)
    columns = columns[:, lengths > 0] / lengths[lengths > 0]
    if not columns.size:
        return np.zeros_like(vectors)
    basis, strengths, _ = np.linalg.svd(columns, full_matrices=False)
    basis = basis[:, strengths > 1e-10 * strengths[0]]
    return basis @ (basis.T @ vectors)
