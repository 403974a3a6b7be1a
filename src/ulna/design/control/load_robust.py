"""Load-robust compensators: the law cancels the disturbance that an extended-state observer estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import Verdict
from ulna.design.control.law import state_feedback
from ulna.design.control.output_feedback import Compensator, compensator
from ulna.design.control.reference import AbstractReference, SetPoint
from ulna.design.control.singular_perturbation import ReducedOrder, reduced_order
from ulna.design.forms import input_output_form
from ulna.design.gains import Gains
from ulna.design.observers import extended_state_observer, with_disturbance
from ulna.plants import PlantLike, as_plant
from ulna.system import Signal, System


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadRobust:
    """A compensator for a plant with an unknown load.

    Attributes:
        plant: what it was designed for, in full; extended: the design plant, fast states left out and the disturbance
            put in; reduction: how the fast states were left out, or None.
        compensator: law and observer; `compensator.system` has the estimate `<disturbance>_hat` among its outputs.
        verdict: whether the reduction holds; proved where nothing was left out.
    """

    plant: System
    extended: System
    reduction: ReducedOrder | None
    compensator: Compensator
    verdict: Verdict

    @property
    def system(self) -> System:
        """The compensator: inputs the plant's outputs and the reference, outputs the plant's inputs and estimates."""
        return self.compensator.system


def load_robust_compensator(
    plant: PlantLike,
    enters: Mapping[str, sp.Expr | int],
    *,
    law: Gains,
    observer: Gains,
    fast: Sequence[str] = (),
    period: float | None = None,
    reference: AbstractReference | None = None,
    disturbance: Signal | None = None,
) -> LoadRobust:
    """A compensator that holds its set point under every constant disturbance that leaves the loop stable.

    The plant gets the state d with d' = 0; the law linearises from the input to the output with d known, the observer
    estimates states and d from the output. At rest the observer's injection vanishes only with ŷ = y, so the output
    rests at the set point exactly whatever load or parameters the true plant has.

    Args:
        plant: the design plant, one input and one output, parameters with their design values.
        enters: how d enters the rates, by state name.
        law: one pole per derivative of the output until the input appears; observer: one per state and one for d.
        fast: states left out by singular perturbation; period: sampling period in s that must be long for them.
        reference: `SetPoint()` where left out.
        disturbance: name and unit of d.

    Raises:
        NoFormError: where the extended plant has no input-output or observer form.
        DesignError: for names or gains that do not fit.
    """
    plant = as_plant(plant)
    reduction = reduced_order(plant, fast, period=period) if fast else None
    design = plant if reduction is None else reduction.slow
    extended = with_disturbance(design.with_values(), enters, disturbance=disturbance)
    feedback = state_feedback(input_output_form(extended), law, reference=reference or SetPoint())
    whole = compensator(feedback, extended_state_observer(extended, observer))
    kept = Verdict.proved(f"no state of '{plant.name}' was left out")
    return LoadRobust(
        plant=plant,
        extended=extended,
        reduction=reduction,
        compensator=whole,
        verdict=kept if reduction is None else reduction.verdict,
    )
