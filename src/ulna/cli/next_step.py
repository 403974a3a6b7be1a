"""The command that comes after an analysis."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ulna.design import Analysis


def next_step(analysis: Analysis, name: str) -> tuple[str, str]:
    """What to design or run next, in words, and the command that does it.

    Args:
        analysis: of the plant.
        name: the plant as it was typed.
    """
    name = shlex.quote(name)
    system, answers = analysis.system, analysis.answers
    missing = [p.name for p in system.parameters if p.value is None]
    if missing:
        values = " ".join(f"--set {each}=1" for each in missing)
        return "with values for the parameters that have none", f"ulna design {name} {values}"
    if not system.inputs and system.outputs and not system.discrete:
        noise = f"{','.join(['1'] * len(system.states))}:{','.join(['0.01'] * len(system.outputs))}"
        return "an observer, since there is no input", f"ulna design {name} --kalman {noise}"
    if system.discrete or not system.inputs:
        return "a run of the plant as it is", f"ulna simulate {name}"
    if _holds(analysis, "dynamic_extension") and not _holds(analysis, "full_state_linearizable"):
        order = sum(r or 0 for r in answers["dynamic_extension"].value["relative_degree"])
        poles = ",".join(str(-k) for k in range(2, 2 + order))
        return "a law with integrators before the inputs", f"ulna design {name} --extend --controller-poles={poles}"
    if _holds(analysis, "full_state_linearizable"):
        return "the exact law and an observer where one exists", f"ulna design {name}"
    return "the best law that the plant has, and why no better one", f"ulna design {name}"


def _holds(analysis: Analysis, key: str) -> bool:
    return key in analysis and analysis[key].verdict.holds and bool(analysis[key].value)
