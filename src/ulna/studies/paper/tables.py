"""The results as one mapping for `results.json`: exact values as text, others to six digits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import sympy as sp

from ulna.design import error_matrix, gains_in_form
from ulna.plants import SmallOscillations
from ulna.report import plain
from ulna.studies.paper.compare import Comparison
from ulna.studies.paper.convergence import Convergence
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.judge import JudgedClaim, count, notes
from ulna.studies.paper.passive import Passive, rest_angle
from ulna.studies.paper.printed import Paper
from ulna.studies.paper.runs import Cause, Loop
from ulna.studies.paper.verdict import Judged
from ulna.symbolic.formulas import formula
from ulna.system import Equilibria, linearise

_DIGITS = 6
_ZERO = 1e-9


def results(
    paper: Paper,
    exact: Exact,
    judged: Sequence[Judged],
    claims: Sequence[JudgedClaim],
    loops: Sequence[Loop],
    convergence: Convergence,
    causes: Sequence[Cause],
    rests: Equilibria,
    passive: Passive,
) -> dict[str, Any]:
    """Return everything the study found, as plain data."""
    found = {
        "paper": {"title": paper.title, "citation": paper.citation},
        "counts": {finding.value: number for finding, number in count(judged).items()},
        "equations": [_passage(entry) for entry in judged],
        "claims": [{"key": c.claim.key, "text": c.claim.text, "holds": c.holds, "meaning": c.meaning} for c in claims],
        "design": _design(exact),
        "loops": [_loop(loop) for loop in loops],
        "convergence": _convergence(convergence),
        "causes": [_cause(cause) for cause in causes],
        "uncontrolled_equilibria": _rests(rests),
        "passive_forearm": _passive(passive),
    }
    return plain(_rounded(found))


def _passage(judged: Judged) -> dict[str, Any]:
    passage = judged.passage
    return {
        "label": passage.label,
        "number": passage.number,
        "key": passage.key,
        "title": passage.title,
        "verdict": judged.finding,
        "meaning": notes()["passage"].get(passage.key, ""),
        "exact": {shown.name or "value": shown.value for shown in judged.shown},
        "comparisons": [_comparison(c) for c in judged.comparisons],
    }


def _comparison(comparison: Comparison) -> dict[str, Any]:
    return {
        "place": comparison.place,
        "printed": comparison.printed,
        "exact": comparison.exact,
        "verdict": comparison.finding,
        "meaning": comparison.meaning,
        "copied": comparison.copied,
    }


def _design(exact: Exact) -> dict[str, Any]:
    s = sp.Symbol("s")
    error = error_matrix(exact.observer)
    gains = gains_in_form(exact.observer)
    return {
        "law": exact.named(exact.law.expressions)[0],
        "feedback_gains": list(exact.law.gains),
        "controller_poles": list(exact.choices.controller_poles),
        "transformation": exact.named(exact.form.map.forward),
        "observer_gains_in_z": list(gains),
        "observer_gains_in_x": list(_correction(exact)),
        "observer_gains_in_x_without_injection": list(exact.observer_form.jacobian * gains),
        "error_poles": sorted(sp.roots(error.charpoly(s).as_expr(), s), reverse=True),
    }


def _correction(exact: Exact) -> sp.MatrixBase:
    """L of ŷ − y in the plant's coordinates: minus the slope of the estimator's rates in the estimated output."""
    states = exact.observer.system.states
    rates = sp.Matrix(exact.observer.system.rates)
    return -rates.diff(states[0].symbol).applyfunc(sp.expand)


def _loop(loop: Loop) -> dict[str, Any]:
    return {
        "key": loop.key,
        "title": loop.title,
        "as_printed": loop.printed,
        "poles": list(loop.poles),
        "steady_error_degrees": loop.steady_error_degrees,
        "holding_voltage": loop.holding_voltage,
        "holding_power": loop.holding_power,
        "runs": [
            {
                "initial_angle": run.angle,
                "comes_to_rest": run.arrives,
                "final_error_degrees": math.degrees(run.output.steady_error),
                "overshoot": run.output.overshoot,
                "peak_voltage": run.peak_voltage,
            }
            for run in loop.runs
        ],
    }


def _convergence(found: Convergence) -> dict[str, Any]:
    evidence = found.proof.evidence
    return {
        "every_run_converges": found.proof.status.value,
        "checked_by_the_second_program": found.checked.status.value,
        "theorem": evidence["certificate"].theorem,
        "decay_rates": list(evidence["decay_rates"]),
        "growth": dict(evidence["growth"]),
        "exponential_near_the_horizontal": found.near,
        "exponential_from_everywhere": "not proved",
    }


def _cause(cause: Cause) -> dict[str, Any]:
    deviation = cause.deviation
    return {
        "place": deviation.place,
        "printed": formula(deviation.printed),
        "exact": formula(deviation.exact),
        "steady_error_alone_degrees": cause.alone,
        "steady_error_without_it_degrees": cause.repaired,
        "stable_alone": cause.stable,
    }


def _rests(rests: Equilibria) -> dict[str, Any]:
    return {
        "complete": rests.complete.status.value,
        "points": [
            {"states": p.numbers, "eigenvalues": list(near.eigenvalues), "stable": near.stable}
            for p, near in ((p, linearise(p)) for p in rests)
        ],
    }


def _passive(passive: Passive) -> dict[str, Any]:
    return {
        "parameters": {
            p.name: {"value": p.value, "unit": p.unit, "source": p.source} for p in passive.forearm.parameters
        },
        "rests": _oscillations(passive.rests),
        "biceps_weaker_by": passive.weaker_by,
        "rests_with_weaker_biceps": _oscillations(passive.weaker),
        "releases": [
            {"displacement_degrees": r.degrees, "largest_difference_degrees": r.largest_difference}
            for r in passive.releases
        ],
    }


def _oscillations(found: SmallOscillations) -> dict[str, Any]:
    return {
        "complete": found.complete.status.value,
        "points": [
            {
                "angle": rest_angle(point),
                "swings": point.swings,
                "natural_frequency": float(point.natural_frequency) if point.swings else None,
                "damping_ratio": float(point.damping_ratio) if point.swings else None,
            }
            for point in found.points
        ],
    }


def _rounded(value: Any) -> Any:
    """Floats to six digits, what is zero but for rounding as zero: the same text on every machine."""
    if isinstance(value, complex):
        return complex(_rounded(value.real), _rounded(value.imag))
    if isinstance(value, float):
        return 0.0 if abs(value) < _ZERO else float(f"{value:.{_DIGITS}g}")
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return value
