"""A fit tried on records that it was not made from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ulna.identification.fitting.fit import HeldOut
from ulna.identification.fitting.noise import Noise
from ulna.identification.fitting.problem import Problem
from ulna.identification.fitting.solve import Solution, solved
from ulna.identification.fitting.start import first_unknowns
from ulna.identification.records import Experiment
from ulna.identification.sensitivity import Response
from ulna.system import System


def held_out_errors(
    problem: Problem, solution: Solution, runs: Sequence[Experiment], levels: Sequence[Noise]
) -> tuple[HeldOut, ...]:
    """The errors on each record, parameters as they were found, initial states fitted again."""
    values = problem.parameters(solution.unknowns)
    fixed: System = problem.system.with_parameters(values)
    names = tuple(s.name for s in fixed.states if s.name not in problem.initial)
    response = Response(fixed, names)
    found = []
    for run in runs:
        other = Problem(
            fixed,
            [run],
            [],
            noise=problem.noise.tolist(),
            initial=problem.initial,
            state_priors=problem.state_priors,
            response=response,
        )
        begun = first_unknowns(other)
        ended = solved(other, begun, most=30).rows.plain[0] if other.rows(begun).finite else other.rows(begun).plain[0]
        found.append(_errors(run, ended, fixed, levels))
    return tuple(found)


def _errors(run: Experiment, residual: np.ndarray, system: System, levels: Sequence[Noise]) -> HeldOut:
    errors, ratios, shares = {}, {}, {}
    for k, signal in enumerate(system.outputs):
        known = np.isfinite(run.measured[:, k])
        error = float(np.sqrt(np.mean(residual[known, k] ** 2)))
        spread = float(np.std(run.measured[known, k]))
        errors[signal.name] = error
        ratios[signal.name] = error / levels[k].std
        shares[signal.name] = 1.0 - (error / spread) ** 2 if spread > 0.0 else float("nan")
    return HeldOut(record=run.record.name, errors=errors, ratios=ratios, explained=shares)
