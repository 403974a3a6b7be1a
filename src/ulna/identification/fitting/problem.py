"""The least-squares problem of a fit: what is free, residuals in units of the noise, and their exact slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ulna.identification.fitting.prior import Prior
from ulna.identification.records import Experiment
from ulna.identification.sensitivity import Response, Sensitivities, response_of
from ulna.system import System

BOND = 1e5
"""Weight of what ties a segment of a run to the next, beside noise of one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Free:
    """A parameter that is looked for.

    Attributes:
        name: of it. followers: names of others that are equal to it. start, lower, upper: SI.
        prior: what was known of it. unit: SI unit, for tables.
    """

    name: str
    followers: tuple[str, ...] = ()
    start: float
    lower: float = -math.inf
    upper: float = math.inf
    prior: Prior | None = None
    unit: str = ""

    @property
    def scale(self) -> float:
        """Its size."""
        spread = self.upper - self.lower
        return abs(self.start) or (self.prior.std if self.prior else 0.0) or (spread if spread < math.inf else 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A stretch of an experiment that is simulated from initial states of its own.

    Attributes:
        experiment: its number. begin, end: samples begin ≤ k < end. states: names of its initial states that are free.
        first: place of these among the unknowns. fixed: values of the others. bond: whether it ties to the next one.
    """

    experiment: int
    begin: int
    end: int
    states: tuple[str, ...]
    first: int
    fixed: Mapping[str, float]
    bond: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Residuals at a point, SI and weighed.

    Attributes:
        residual: (R,) in units of the noise; measured rows first, then bonds, then priors. slopes: (R, Q).
        measured: how many are measured rows. plain: by experiment (N, p) model − measured in SI, NaN where lost.
    """

    residual: np.ndarray
    slopes: np.ndarray
    measured: int
    plain: tuple[np.ndarray, ...]

    @property
    def finite(self) -> bool:
        """Whether the model has values everywhere."""
        return bool(np.isfinite(self.residual).all())


class Problem:
    """Residuals and slopes by the unknowns: parameters in their sizes, then initial states of each piece."""

    def __init__(
        self,
        system: System,
        runs: Sequence[Experiment],
        free: Sequence[Free],
        *,
        noise: Sequence[float],
        initial: Mapping[str, float],
        state_priors: Mapping[str, Prior],
        segments: int = 1,
        response: Response | None = None,
    ) -> None:
        self.system, self.runs, self.free = system, tuple(runs), tuple(free)
        self.noise = np.asarray(noise, dtype=float)
        self.initial, self.state_priors = dict(initial), dict(state_priors)
        names = tuple(s.name for s in system.states)
        loose = tuple(n for n in names if n not in self.initial or segments > 1)
        followed = tuple(name for each in self.free for name in (each.name, *each.followers))
        self.response = response or response_of(system, (*followed, *loose))
        self.pieces = self._pieces(names, segments)
        last = self.pieces[-1]
        self.size = last.first + len(last.states)
        self._kept: tuple[bytes, Rows] | None = None

    @property
    def scales(self) -> np.ndarray:
        """(Q,) SI values of one unit of each unknown."""
        return np.array([each.scale for each in self.free] + [1.0] * (self.size - len(self.free)))

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """(lower, upper) of the unknowns."""
        rest = [math.inf] * (self.size - len(self.free))
        lower = [each.lower / each.scale for each in self.free] + [-each for each in rest]
        return np.array(lower), np.array([each.upper / each.scale for each in self.free] + rest)

    def parameters(self, unknowns: np.ndarray) -> dict[str, float]:
        """SI values of the free parameters and their followers."""
        found = {}
        for each, value in zip(self.free, unknowns, strict=False):
            found |= dict.fromkeys((each.name, *each.followers), float(value * each.scale))
        return found

    def states(self, piece: Piece, unknowns: np.ndarray) -> dict[str, float]:
        """SI values of the initial states of a piece."""
        values = unknowns[piece.first : piece.first + len(piece.states)].tolist()
        return {**piece.fixed, **dict(zip(piece.states, values, strict=True))}

    def run(self, piece: Piece, unknowns: np.ndarray) -> Sensitivities:
        """The motion of a piece, the first sample of the next one included where it ties to it."""
        run = self.runs[piece.experiment]
        times = run.times[piece.begin : piece.end + piece.bond]
        return self.response(self.states(piece, unknowns), times, run.inputs, self.parameters(unknowns))

    def rows(self, unknowns: np.ndarray) -> Rows:
        """Residuals and slopes at a point; those of the last point are remembered."""
        key = unknowns.tobytes()
        if self._kept is None or self._kept[0] != key:
            self._kept = (key, self._rows(unknowns))
        return self._kept[1]

    def _pieces(self, names: tuple[str, ...], segments: int) -> tuple[Piece, ...]:
        found, first = [], len(self.free)
        for number, run in enumerate(self.runs):
            edges = np.unique(np.linspace(0, len(run.times), min(segments, len(run.times) // 2) + 1).astype(int))
            for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
                states = tuple(n for n in names if begin or n not in self.initial)
                fixed = {} if begin else {n: v for n, v in self.initial.items() if n in names}
                piece = Piece(
                    experiment=number,
                    begin=begin,
                    end=end,
                    states=states,
                    first=first,
                    fixed=fixed,
                    bond=end < len(run.times),
                )
                found.append(piece)
                first += len(states)
        return tuple(found)

    def _columns(self, piece: Piece, slopes: np.ndarray) -> np.ndarray:
        """(…, Q) slopes by the unknowns from slopes (…, q) along the names of the response."""
        along = self.response.along
        found = np.zeros((*slopes.shape[:-1], self.size))
        for k, each in enumerate(self.free):
            for name in (each.name, *each.followers):
                found[..., k] += slopes[..., along.index(name)] * each.scale
        for k, name in enumerate(piece.states):
            found[..., piece.first + k] = slopes[..., along.index(name)]
        return found

    def _rows(self, unknowns: np.ndarray) -> Rows:
        residuals, slopes, bonds, ties = [], [], [], []
        plain = [np.full(run.measured.shape, np.nan) for run in self.runs]
        for number, piece in enumerate(self.pieces):
            found = self.run(piece, unknowns)
            count, run = piece.end - piece.begin, self.runs[piece.experiment]
            error = found.outputs[:count] - run.measured[piece.begin : piece.end]
            plain[piece.experiment][piece.begin : piece.end] = error
            if not found.finished:
                return Rows(
                    residual=np.full(1, np.inf), slopes=np.zeros((1, self.size)), measured=1, plain=tuple(plain)
                )
            known = np.isfinite(run.measured[piece.begin : piece.end])
            columns = self._columns(piece, found.output_slopes[:count])
            residuals.append((error / self.noise)[known])
            slopes.append((columns / self.noise[:, None])[known])
            if piece.bond:
                after = self.pieces[number + 1]
                size = np.maximum(np.abs(found.states).max(axis=0), 1e-12)
                begun = self.states(after, unknowns)
                defect = found.states[-1] - np.array([begun[s.name] for s in self.system.states])
                bonds.append(defect / size * BOND)
                tie = self._columns(piece, found.state_slopes[-1])
                for k, name in enumerate(s.name for s in self.system.states):
                    tie[k, after.first + after.states.index(name)] -= 1.0
                ties.append(tie / size[:, None] * BOND)
        measured = sum(len(each) for each in residuals)
        prior, known = self._priors(unknowns)
        return Rows(
            residual=np.concatenate([*residuals, *bonds, prior]),
            slopes=np.concatenate([*slopes, *ties, known]),
            measured=measured,
            plain=tuple(plain),
        )

    def _priors(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows: list[tuple[float, int, float]] = []
        for k, each in enumerate(self.free):
            if each.prior is not None:
                rows.append(
                    ((unknowns[k] * each.scale - each.prior.mean) / each.prior.std, k, each.scale / each.prior.std)
                )
        for piece in self.pieces:
            for k, name in enumerate(piece.states):
                if not piece.begin and (prior := self.state_priors.get(name)) is not None:
                    place = piece.first + k
                    rows.append(((unknowns[place] - prior.mean) / prior.std, place, 1.0 / prior.std))
        slopes = np.zeros((len(rows), self.size))
        for row, (_, place, slope) in enumerate(rows):
            slopes[row, place] = slope
        return np.array([value for value, _, _ in rows]), slopes
