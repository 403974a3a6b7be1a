"""What an analysis comes to, in two sentences: what the plant is, and what stands in the way of a controller."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import sympy as sp

from ulna.design.analysis.answer import Answer
from ulna.symbolic.formulas import decimal_text, is_longer
from ulna.system import System

_PARTS = 60
"""Parts of a formula that a sentence may hold."""

_STABLE = {
    "exponential": "stable",
    "asymptotic": "stable, but slower than any exponential",
    "marginal": "neither stable nor unstable",
    "unstable": "unstable",
}


def what_it_is(system: System, answers: Mapping[str, Answer]) -> str:
    """A sentence: size, linearisability and by which output, observability, zero dynamics."""
    sizes = [(len(system.states), "state"), (len(system.inputs), "input"), (len(system.outputs), "output")]
    size = ", ".join(f"{count or 'no'} {word}{'' if count == 1 else 's'}" for count, word in sizes)
    if system.discrete:
        parts = [_discrete(answers)]
    else:
        parts = [_linearisable(system, answers), _observable(system, answers), _zero_dynamics(system, answers)]
    return f"{system.name} ({size}) {'; '.join(part for part in parts if part)}."


def what_stands_in_the_way(system: System, answers: Mapping[str, Answer], *, at_rest: bool) -> str:
    """A sentence on what a law or an observer has to live with, or that nothing is known to."""
    found = list(_obstacles(system, answers, at_rest))
    if not found:
        return "Nothing stands in the way of a law and an observer."
    text = "; ".join(found)
    return f"In the way: {text}."


def _value(answers: Mapping[str, Answer], key: str) -> Any:
    answer = answers.get(key)
    return None if answer is None or answer.value is None else answer.value


def _open(answers: Mapping[str, Answer], key: str) -> bool:
    return key not in answers or not (answers[key].verdict.holds or answers[key].verdict.fails)


def _surely(answers: Mapping[str, Answer], key: str) -> str:
    return "" if answers[key].verdict.status == "proved" else " (at random points, no proof)"


def _formulas(expressions: Any) -> str:
    """A few formulas in words; empty where they are long."""
    if not isinstance(expressions, list) or is_longer(expressions, _PARTS):
        return ""
    return ", ".join(decimal_text(e) for e in expressions)


def _linearisable(system: System, answers: Mapping[str, Answer]) -> str:
    if not system.inputs:
        return "has no input"
    if _open(answers, "full_state_linearizable"):
        return "may be linearisable by feedback: that is open"
    if _value(answers, "full_state_linearizable"):
        sure = _surely(answers, "full_state_linearizable")
        outputs = _value(answers, "linearizing_outputs")
        own = list(system.inline(system.readouts))
        if isinstance(outputs, list) and outputs and all(o in own for o in outputs):
            names = [system.outputs[own.index(o)].name for o in outputs]
            return f"is linearised as a whole by feedback through its output{_s(names)} {', '.join(names)}{sure}"
        by = _formulas(outputs)
        return f"can be linearised as a whole by feedback{sure}" + (f", with {by} in place of an output" if by else "")
    if _value(answers, "dynamic_extension"):
        return "is not linearised by static feedback, but by a law with integrators before its inputs (it is flat)"
    degrees = _value(answers, "relative_degree")
    if isinstance(degrees, list) and degrees and None not in degrees and not _open(answers, "control"):
        many = f"{sum(degrees)} of {len(system.states)} states"
        return f"cannot be linearised as a whole by static feedback; its outputs alone can ({many})"
    return "cannot be linearised as a whole by static feedback"


def _s(items: list[str]) -> str:
    return "" if len(items) == 1 else "s"


def _observable(system: System, answers: Mapping[str, Answer]) -> str:
    if not system.outputs or _open(answers, "observability_rank"):
        return "" if not system.outputs else "whether its outputs show every state is open"
    rank, n = _value(answers, "observability_rank"), len(system.states)
    if rank is None or rank < n:
        return f"its outputs show {rank or 0} of {n} states"
    if _value(answers, "observer_form"):
        how = "by an observer whose error is linear"
    elif _value(answers, "observer_form_output_transform"):
        how = "by an observer whose error is linear after a change of the output"
    elif answers["observability_rank"].verdict.evidence.get("observable_while") is not None:
        how = "while it is moved by its inputs"
    else:
        how = "but no observer has a linear error" if not _open(answers, "observer_form") else ""
    return f"its outputs show every state{', ' if how.startswith('but') else ' ' if how else ''}{how}"


def _zero_dynamics(system: System, answers: Mapping[str, Answer]) -> str:
    if not system.outputs or not system.inputs or _open(answers, "zero_dynamics"):
        return ""
    value, stability = _value(answers, "zero_dynamics"), _value(answers, "minimum_phase")
    if value is None:
        return ""
    if not value["coords"]:
        return "it has no zero dynamics"
    names = ", ".join(value["coords"])
    told = _STABLE.get(str(stability), "of unknown stability")
    return f"its zero dynamics ({names}) are {told}"


def _discrete(answers: Mapping[str, Answer]) -> str:
    stable = _value(answers, "stable")
    word = {True: "stable", False: "unstable", None: "of open stability"}[stable]
    return f"is in discrete time and {word} at its equilibrium"


def _obstacles(system: System, answers: Mapping[str, Answer], at_rest: bool) -> Iterator[str]:
    n = len(system.states)
    spent = [key for key, a in answers.items() if a.verdict.evidence.get("ran_out")]
    if not at_rest:
        yield "the operating point is not an equilibrium"
    if not system.inputs and not system.discrete:
        yield "there is no input"
    elif not system.discrete:
        yield from _law_obstacles(answers, n)
    if not system.outputs:
        yield "there is no output to observe"
    elif (_value(answers, "observability_rank") or n) < n:
        yield "part of the state is not observable from the outputs"
    if spent:
        more = f" and {len(spent) - 3} more" if len(spent) > 3 else ""
        yield f"the time ran out before {', '.join(spent[:3])}{more} could be answered"


def _law_obstacles(answers: Mapping[str, Answer], n: int) -> Iterator[str]:
    if (_value(answers, "accessibility_rank") or n) < n:
        yield f"the inputs move {_value(answers, 'accessibility_rank')} of {n} states only"
    elif not _open(answers, "involutive") and not _value(answers, "involutive"):
        bracket = answers["involutive"].verdict.evidence.get("bracket")
        yield "the input fields are not involutive" + (f" ({bracket} leaves their span)" if bracket else "")
    if _value(answers, "minimum_phase") == "unstable" and not _value(answers, "full_state_linearizable"):
        yield "a law that holds the outputs alone lets the rest diverge"
    if _value(answers, "full_state_linearizable") and _value(answers, "linearizable_at_point") is False:
        yield "the law is singular at the operating point"
    else:
        singular = _value(answers, "singular_set")
        if isinstance(singular, sp.Expr) and singular.free_symbols and not is_longer(singular, _PARTS):
            yield f"the law is singular where {decimal_text(singular)} = 0"
