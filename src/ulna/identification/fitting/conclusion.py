"""What a search found, as a `Fit`: estimates with intervals, what is not known and why, the plant with its values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
import sympy as sp

from ulna.identification.fitting.fit import Estimate, Fit
from ulna.identification.fitting.noise import Noise
from ulna.identification.fitting.problem import Problem
from ulna.identification.fitting.residual_tests import residual_test
from ulna.identification.fitting.solve import Robust, Solution
from ulna.identification.fitting.uncertainty import NORMAL, Uncertainty, profile, uncertainty
from ulna.identification.records import factor_of
from ulna.sim import input_values
from ulna.symbolic.formulas import exact
from ulna.system import Parameter, System

DOUBTFUL = 0.2
"""Standard errors above this share of the value are looked at by the profile of the likelihood."""
USELESS = 10.0
"""An interval wider than this many times the value on one side says nothing."""


def conclusion(
    plant: System,
    problem: Problem,
    solution: Solution,
    levels: Sequence[Noise],
    own: Sequence[Noise],
    *,
    loss: Robust | None,
    source: str,
    hidden: Mapping[str, str],
) -> Fit:
    """The fit that a search ended in.

    Args:
        plant: with all of its outputs. problem, solution: the search. levels: noise that residuals were weighed by.
        own: noise that the channels have by themselves. loss: of the search. source: where the values come from.
        hidden: why parameters cannot be known from these outputs, as `hidden_parameters` says.
    """
    sure = uncertainty(problem, solution, told=all(level.told for level in levels))
    combinations = _combinations(problem, solution, sure)
    estimates = tuple(
        _estimate(problem, solution, sure, k, combinations, loss, hidden.get(each.name, ""))
        for k, each in enumerate(problem.free)
    )
    scales = problem.scales[: len(problem.free)]
    covariance = sure.covariance[: len(scales), : len(scales)] * np.outer(scales, scales)
    begun = [piece for piece in problem.pieces if not piece.begin]
    return Fit(
        system=fitted_system(plant, problem, estimates, covariance, source),
        estimates=estimates,
        covariance=covariance,
        initial=tuple(problem.states(piece, solution.unknowns) for piece in begun),
        experiments=problem.runs,
        outputs=tuple(s.name for s in problem.system.outputs),
        residuals=solution.rows.plain,
        tests=_tests(problem, solution, own),
        condition=sure.condition,
        aic=_aic(problem, solution, levels),
        converged=solution.converged,
        stopped=solution.stopped,
        evaluations=solution.evaluations,
        notes=_notes(problem, estimates, solution),
        source=source,
        combinations=combinations,
    )


def _estimate(
    problem: Problem,
    solution: Solution,
    sure: Uncertainty,
    k: int,
    combinations: Sequence[Mapping[str, float]],
    loss: Robust | None,
    hidden: str,
) -> Estimate:
    free = problem.free[k]
    value = float(solution.unknowns[k] * free.scale)
    std = math.sqrt(max(sure.covariance[k, k], 0.0)) * free.scale
    found = Estimate(
        name=free.name,
        unit=free.unit,
        value=value,
        std=std,
        low=value - NORMAL * std,
        high=value + NORMAL * std,
        start=free.start,
    )
    if hidden or not math.isfinite(std) or std == 0.0:
        partners = [c for c in combinations if free.name in c]
        reason = hidden or (_in_words(free.name, partners[0]) if partners else "it changes no measured output")
        return replace(found, std=math.inf, low=-math.inf, high=math.inf, known=False, reason=reason)
    size = max(abs(value), abs(free.start))
    if solution.held[k]:
        return replace(found, low=free.lower, high=free.upper, std=math.inf, known=False, reason=_at_bound(value))
    if std <= DOUBTFUL * size:
        return found
    if NORMAL * std > USELESS * size:
        reason = f"the records do not determine it: its standard error would be {100 * std / size:.3g} % of the value"
        return replace(found, std=math.inf, low=-math.inf, high=math.inf, known=False, reason=reason)
    ends = profile(problem, solution, k, std / free.scale, max(float(sure.inflation[k]), 1e-3), loss)
    low, high = (end * free.scale for end in ends)
    if not (math.isfinite(low) and math.isfinite(high)) or max(value - low, high - value) > USELESS * size:
        ends = f"from {low:.3g} to {high:.3g}"
        reason = f"values {ends} fit as well, or nearly: the records do not determine it"
        return replace(found, low=low, high=high, std=math.inf, known=False, reason=reason)
    return replace(found, low=low, high=high, reason=f"known to {100 * std / size:.0f} % only; interval by profile")


def _at_bound(value: float) -> str:
    return f"the fit ends at its bound {value:.6g}: widen it, or the model is incomplete"


def _combinations(problem: Problem, solution: Solution, sure: Uncertainty) -> tuple[Mapping[str, float], ...]:
    """For each direction that changes nothing, the share by which each parameter moves in it, the largest by one."""
    found = []
    here = solution.unknowns[: len(problem.free)]
    for direction in sure.blind:
        part = direction[: len(problem.free)] / np.where(here == 0.0, 1.0, here)
        largest = np.abs(part).max() if len(part) else 0.0
        if largest > 1e-3:
            moved = part / part[np.argmax(np.abs(part))]
            found.append({f.name: float(v) for f, v in zip(problem.free, moved, strict=True) if abs(v) > 1e-3})
    return tuple(found)


def _in_words(name: str, moves: Mapping[str, float]) -> str:
    others = [other for other in moves if other != name]
    if not others:
        return "it changes no measured output"
    if len(others) == 1 and abs(moves[name]) > 1e-6:
        ratio = Fraction(-moves[others[0]] / moves[name]).limit_denominator(6)
        if abs(float(ratio) + moves[others[0]] / moves[name]) < 0.01 and ratio:
            power = "" if abs(ratio) == 1 else f"^{abs(1 / ratio)}"
            # δ other / δ name = −1: their product stays.
            return f"only {name}{'*' if ratio > 0 else '/'}{others[0]}{power} is determined"
    return f"it can change together with {', '.join(others)} without any effect"


def _tests(problem: Problem, solution: Solution, levels: Sequence[Noise]) -> tuple:
    drive = {
        signal.name: [input_values(run.inputs[signal.name], run.times, {}) for run in problem.runs]
        for signal in problem.system.inputs
    }
    moving = {name: values for name, values in drive.items() if any(np.ptp(each) > 0.0 for each in values)}
    return tuple(
        residual_test(signal.name, signal.unit, [e[:, k] for e in solution.rows.plain], moving, level)
        for k, (signal, level) in enumerate(zip(problem.system.outputs, levels, strict=True))
    )


def _aic(problem: Problem, solution: Solution, levels: Sequence[Noise]) -> float:
    """−2 log L + 2 k of Gaussian residuals, the noise of each channel that was not told estimated."""
    total = 2.0 * problem.size
    for k, level in enumerate(levels):
        error = np.concatenate([each[:, k][np.isfinite(each[:, k])] for each in solution.rows.plain])
        square = float(np.mean(error**2))
        variance = level.std**2 if level.told else max(square, level.floor**2)
        total += len(error) * (math.log(2.0 * math.pi * variance) + square / variance) + 2.0 * (not level.told)
    return total


def _notes(problem: Problem, estimates: Sequence[Estimate], solution: Solution) -> tuple[str, ...]:
    notes = []
    still = [s.name for s in problem.system.inputs if all(s.name in run.still for run in problem.runs)]
    if still:
        lost = [each.name for each in estimates if not each.known]
        tail = f", which leaves {', '.join(lost)} unknown" if lost else ""
        notes.append(f"the input {', '.join(still)} never changes{tail}")
    if not solution.converged:
        notes.append(f"the search was stopped by {solution.stopped}: the estimates are those of its last step")
    said = dict.fromkeys(f"{run.record.name}: {each}" for run in problem.runs for each in run.record.said)
    return (*notes, *said)


def fitted_system(
    plant: System, problem: Problem, estimates: Sequence[Estimate], covariance: np.ndarray, source: str
) -> System:
    """The plant with the estimates, their standard errors and correlations; decimals as many as are worth telling."""
    found: dict[str, tuple[float, float, str]] = {}
    for each, free in zip(estimates, problem.free, strict=True):
        told = source if each.known else f"{source}; not determined by it: {each.reason}"
        for name in (free.name, *free.followers):
            # Of one that equals another: the same number, without a chance of its own.
            std = each.std if each.known and name == free.name else math.inf
            found[name] = (each.value, std, told if name == free.name else f"as {free.name}")
    parameters = tuple(_with_estimate(p, *found[p.name]) if p.name in found else p for p in plant.parameters)
    pairs = []
    for a, first in enumerate(estimates):
        for b, second in enumerate(estimates[:a]):
            if first.known and second.known:
                number = covariance[a, b] / math.sqrt(covariance[a, a] * covariance[b, b])
                pairs.append((second.name, first.name, exact(round(float(np.clip(number, -1, 1)), 6))))
    others = tuple(row for row in plant.correlations if not {row[0], row[1]} & found.keys())
    return replace(plant, parameters=parameters, correlations=(*others, *pairs))


def _with_estimate(parameter: Parameter, value: float, std: float, source: str) -> Parameter:
    factor = factor_of(parameter.unit)
    number, spread = value / factor, std / factor
    known = math.isfinite(spread) and spread > 0.0
    digits = 4 - math.floor(math.log10(spread)) if known else 9 - math.floor(math.log10(abs(number) or 1.0))
    told: sp.Expr | None = exact(float(f"{spread:.4g}")) if known else None
    shown = exact(round(number, max(0, digits)) if digits < 300 else number)
    low, high = parameter.lower, parameter.upper
    if (low is not None and shown < low) or (high is not None and shown > high):
        shown = low if low is not None and shown < low else high
    return replace(parameter, value=shown, std=told, source=source)
