"""Answers held against each other before they are shown: what contradicts a theorem is not printed.

A contradiction is a fault of ours. Where one side is proved the other follows from it; where neither is, or both claim
to be, all that takes part is undecided and says so. What a theorem adds to an open question is answered by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from ulna.base import Status, Verdict
from ulna.design.analysis.answer import Answer, not_applicable
from ulna.symbolic.solving import limit_at
from ulna.system import System

Answers = dict[str, Answer]

_STATES = ("controllability_rank", "observability_rank")
_IN_PART = ("rest_points",)
_SURE = {Status.UNDECIDED: 0, Status.SUPPORTED: 1, Status.REFUTED: 2, Status.PROVED: 2}


def consistent(
    system: System, answers: Mapping[str, Answer], where: Mapping[sp.Symbol, sp.Expr] | None = None
) -> Answers:
    """The answers without contradictions: proved ones stand, what contradicts them follows them or is undecided.

    The theorems (A. Isidori, Nonlinear Control Systems, 3rd ed., chapters 4 and 5): relative degrees that add up to n
    make ranks full and the state linearisable, with zero dynamics that are a point; so does a law without internal
    dynamics; a rank at the point is at most the generic one; a proved relative degree has a regular decoupling matrix
    where it is asked for. An undecided answer has no value, but for rest points: those that were found.

    Args:
        system: the plant.
        answers: by key, as found.
        where: a number for every state and parameter at the operating point; left out, nothing is asked about it.
    """
    found = {key: answer if key in _IN_PART else _undecided_without_value(answer) for key, answer in answers.items()}
    if where is not None:
        _defined(found, system, where)
    n = len(system.states)
    for key in _STATES:
        _ordered(found, f"{key}_at_point", key)
    total = _total(found, n)
    if total is not None:
        because = {"because": f"relative degrees add up to the {n} states", "theorem": "Isidori 1995, 4.2 and 5.2"}
        for key, value in _FULL.items():
            _implied(found, key, n if value is _DIMENSION else value, total, because)
        _implied(found, "distribution_dims", _dimensions(found, n), total, because)
        if _adds_up(_value(found, "relative_degree"), n) and _value(found, "linearizing_outputs") is None:
            _implied(found, "linearizing_outputs", list(system.inline(system.readouts)), total, because)
        _no_zero_dynamics(found, total)
        if _value(found, "relative_degree_at_point") is True:
            here = min(total, _status(found, "relative_degree_at_point"), key=_SURE.__getitem__)
            for key in _STATES:
                _implied(found, f"{key}_at_point", n, here, because)
            _implied(found, "linearizable_at_point", True, here, because)
    _regular(found)
    if _value(found, "full_state_linearizable") is True:
        because = {"because": "the whole state is linearisable"}
        _implied(found, "controllability_rank", n, _status(found, "full_state_linearizable"), because)
        _implied(found, "involutive", True, _status(found, "full_state_linearizable"), because)
    if _value(found, "linearizable_at_point") is True:
        because = {"because": "the state is linearisable around the point"}
        _implied(found, "controllability_rank_at_point", n, _status(found, "linearizable_at_point"), because)
        _implied(found, "full_state_linearizable", True, _status(found, "linearizable_at_point"), because)
    return found


_DIMENSION = object()
_FULL: Mapping[str, Any] = {
    "controllability_rank": _DIMENSION,
    "observability_rank": _DIMENSION,
    "full_state_linearizable": True,
    "involutive": True,
}
"""What relative degrees that add up to n imply, generically."""


def _defined(found: Answers, system: System, where: Mapping[sp.Symbol, sp.Expr]) -> None:
    """Nothing is said about a point where the plant has no value; a T proved around the point has one there."""
    values = [limit_at(e, where) for e in system.inline((*system.rates, *system.readouts))]
    names = [f"{s.name}'" for s in system.states] + [s.name for s in system.outputs]
    missing = [name for name, value in zip(names, values, strict=True) if _is_missing(value)]
    if missing:
        reason = f"{', '.join(missing)} has no real value at the operating point"
        for key in [key for key in found if key.endswith("at_point")]:
            found[key] = not_applicable(key, reason)
    full = (("T", "linearizable_at_point", True), ("observer_T", "observability_rank_at_point", len(system.states)))
    for key, at_point, wanted in full:
        value = _value(found, key)
        regular = _value(found, at_point) == wanted and found[at_point].verdict.holds
        if value and regular and not missing and any(_is_missing(limit_at(e, where)) for e in value):
            found[key] = _open(found[key], "its formula has no value at the operating point")


def _is_missing(value: sp.Expr) -> bool:
    return value.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.AccumBounds) or value.is_extended_real is False


def _total(found: Answers, n: int) -> Status | None:
    """How sure it is that a linearising law leaves no internal dynamics; None if it does or that is open."""
    degrees, regular = found.get("relative_degree"), found.get("decoupling_matrix")
    sure = []
    if degrees is not None and degrees.verdict.holds and _adds_up(degrees.value, n):
        single = len(degrees.value) == 1
        if single:
            sure.append(degrees.verdict.status)
        elif regular is not None and regular.verdict.holds:
            sure.append(min(degrees.verdict.status, regular.verdict.status, key=_SURE.__getitem__))
    law = found.get("control")
    if law is not None and law.verdict.holds and law.verdict.evidence.get("internal_dimension") == 0:
        sure.append(law.verdict.status)
    return max(sure, key=_SURE.__getitem__) if sure else None


def _dimensions(found: Answers, n: int) -> list[int] | None:
    """dim G_k = Σ min(k + 1, r_i) where the relative degrees add up to n."""
    degrees = _value(found, "relative_degree")
    return [sum(min(k + 1, r) for r in degrees) for k in range(n)] if _adds_up(degrees, n) else None


def _adds_up(value: Any, n: int) -> bool:
    return isinstance(value, list) and bool(value) and None not in value and sum(value) == n


def _no_zero_dynamics(found: Answers, sure: Status) -> None:
    """Where the relative degrees add up to n nothing moves behind zero outputs."""
    value = _value(found, "zero_dynamics")
    if not value or not value.get("coords"):
        return
    contradiction = "zero dynamics that move although the relative degrees add up to the number of states"
    if _SURE[sure] <= _SURE[_status(found, "zero_dynamics")]:
        found["relative_degree"] = _open(found["relative_degree"], contradiction)
    if _SURE[sure] >= _SURE[_status(found, "zero_dynamics")]:
        for key in ("zero_dynamics", "minimum_phase"):
            found[key] = _open(found[key], contradiction)


def _regular(found: Answers) -> None:
    """A single output's relative degree says that its decoupling matrix, one number, is not zero."""
    degrees, matrix = found.get("relative_degree"), found.get("decoupling_matrix")
    if degrees is None or matrix is None or not degrees.verdict.holds or not matrix.verdict.fails:
        return
    if len(degrees.value) == 1 and degrees.value[0] is not None:
        _settled(found, "relative_degree", "decoupling_matrix", "the relative degree of a zero decoupling matrix")


def _ordered(found: Answers, lower: str, upper: str) -> None:
    """The rank at the point is at most the generic one."""
    small, large = _value(found, lower), _value(found, upper)
    if small is None or large is None or small <= large:
        return
    _settled(found, lower, upper, f"{lower} = {small} exceeds {upper} = {large}")


def _settled(found: Answers, one: str, other: str, contradiction: str) -> None:
    """Of two answers that contradict each other only the surer one is left."""
    if _SURE[_status(found, one)] == _SURE[_status(found, other)]:
        lost = (one, other)
    else:
        lost = (min((one, other), key=lambda key: _SURE[_status(found, key)]),)
    for key in lost:
        found[key] = _open(found[key], contradiction)


def _implied(found: Answers, key: str, value: Any, sure: Status, because: Mapping[str, Any]) -> None:
    """A theorem's answer: it fills what is open, agrees, or contradicts what was found less surely."""
    answer = found.get(key)
    if answer is None or value is None:
        return
    own = answer.verdict.status
    if answer.value == value and own is not Status.UNDECIDED and _SURE[own] >= _SURE[sure]:
        return
    if answer.value in (value, None) or _SURE[own] < _SURE[sure]:
        verdict = Verdict(claim=answer.verdict.claim, status=sure, evidence=because)
        found[key] = Answer(verdict=verdict, value=value)
        return
    found[key] = _open(answer, f"{key} = {answer.value} contradicts what follows: {value}; {because['because']}")


def _open(answer: Answer, contradiction: str) -> Answer:
    return Answer(verdict=Verdict.undecided(answer.verdict.claim, contradiction=contradiction), value=None)


def _undecided_without_value(answer: Answer) -> Answer:
    undecided = answer.verdict.status is Status.UNDECIDED
    return Answer(verdict=answer.verdict, value=None) if undecided and answer.value is not None else answer


def _value(found: Answers, key: str) -> Any:
    return found[key].value if key in found else None


def _status(found: Answers, key: str) -> Status:
    return found[key].verdict.status
