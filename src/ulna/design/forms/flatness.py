"""Flat outputs: functions whose time courses determine all states and inputs (Fliess, Lévine, Martin, Rouchon 1995)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from ulna.base import PlantError, Verdict
from ulna.design.forms.extension import dynamic_extension
from ulna.geometry import relative_degree_of
from ulna.plants import PlantLike, as_plant
from ulna.symbolic.formulas import formula
from ulna.system import control_affine


def flat_output(system: PlantLike, outputs: Sequence[sp.Expr], *, seconds: float = 8.0) -> Verdict:
    """Whether functions of the state are a flat output, generically.

    They are if and only if dynamic extension ends with relative degrees that add up to the dimension of the extended
    plant; for a single input, if and only if the relative degree is n.

    Args:
        system: the plant.
        outputs: as many functions of the state as the plant has inputs.
        seconds: s, for everything together.

    Returns:
        A verdict whose evidence holds the relative degrees, the states added and the expression whose zeros are
        singular; refuted with the number of states that the outputs do not determine.

    Raises:
        PlantError: if an output holds symbols that are neither states nor parameters.

    Examples:
        >>> plant = ulna.model("unicycle")
        >>> px, py = plant.state_symbols[:2]
        >>> ulna.flat_output(plant, [px, py]).holds
        True
    """
    system = as_plant(system)
    claim = f"({', '.join(formula(h) for h in outputs)}) is a flat output"
    known = {*system.state_symbols, *system.parameter_symbols}
    for h in outputs:
        strange = sorted(s.name for s in h.free_symbols - known)
        if strange:
            raise PlantError(
                f"flat output {formula(h)} of '{system.name}'",
                f"{', '.join(strange)} is neither a state nor a parameter.",
            )
    m, n = len(system.inputs), len(system.states)
    if len(outputs) != m:
        return Verdict.refuted(claim, reason=f"{len(outputs)} functions for {m} inputs: as many are needed")
    degree = relative_degree_of(tuple(outputs), control_affine(system))
    if degree.invertible.holds and degree.total == n:
        return Verdict.proved(claim, relative_degrees=degree.per_output, states_added=(), singular=degree.singular)
    if m == 1:
        reason = f"with one input its relative degree must be {n}"
        return Verdict.refuted(claim, reason=reason, relative_degrees=degree.per_output)
    extension = dynamic_extension(system, outputs=outputs, seconds=seconds)
    evidence = {"relative_degrees": extension.indices, "states_added": tuple(str(s) for s in extension.added)}
    if extension.system is None:
        return extension.verdict.restated(claim)
    evidence |= {"singular": extension.singular, "feedback": extension.feedback}
    if extension.complete.fails:
        hidden = len(extension.system.states) - sum(extension.indices)
        return Verdict.refuted(claim, reason=f"{hidden} states are not determined by the outputs", **evidence)
    return replace(extension.complete, claim=claim, evidence=evidence)
