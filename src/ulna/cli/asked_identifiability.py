"""The answers of `ulna analyse --identify`: which parameters can be known, alone or together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ulna.cli.typed_values import typed_list

if TYPE_CHECKING:
    from ulna.design import Answer
    from ulna.identification import Identifiability
    from ulna.system import System

KEY = "identifiability"


def identifiability_answers(system: System, names: str, *, as_json: bool) -> dict[str, Answer]:
    """What can be known of the parameters in a comma-separated text: for machines one answer; none if none is named."""
    if not names.strip():
        return {}
    from ulna.design import Answer
    from ulna.identification import identifiability

    found = identifiability(system, typed_list(names))
    if as_json:
        return {KEY: Answer(verdict=found.verdict, value=_value(found))}
    return _rows(found)


def _rows(found: Identifiability) -> dict[str, Answer]:
    """One answer for each parameter, one for each combination, one for the starts that hide parameters."""
    from ulna.base import Verdict
    from ulna.design import Answer

    rows = {}
    for name, answer in found.parameters.items():
        value = str(answer.extent) if answer.needs is None else f"{answer.extent}, with {answer.needs}"
        rows[f"{name} from {', '.join(found.outputs)}"] = Answer(verdict=answer.verdict, value=value)
    for number, one in enumerate(found.combinations, 1):
        rows[f"together {number}"] = Answer(verdict=one.verdict, value=one.expression)
    if found.lost:
        verdict = Verdict.supported("at these starts no derivative of the outputs shows these parameters")
        starts = {where: ", ".join(hidden) for where, hidden in found.lost.items()}
        rows["not from a start at"] = Answer(verdict=verdict, value=starts)
    return rows


def _value(found: Identifiability) -> Mapping[str, Any]:
    """The whole answer as one value, for machines."""
    return {
        "outputs": found.outputs,
        "parameters": {
            name: {
                "extent": answer.extent,
                "verdict": answer.verdict.status,
                "without_input": answer.without_input,
                "needs": answer.needs,
                "evidence": {"claim": answer.verdict.claim, **answer.verdict.evidence},
            }
            for name, answer in found.parameters.items()
        },
        "combinations": [{"expression": c.expression, "verdict": c.verdict.status} for c in found.combinations],
        "combinations_complete": found.combinations_complete,
        "scalings": found.scalings,
        "lost": found.lost,
    }
