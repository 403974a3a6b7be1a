"""Law and observer together: the output-feedback compensator (paper eq. 53-54), and the loop it closes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from ulna.base.errors import DesignError
from ulna.design.control.law import Law
from ulna.system import connect
from ulna.system.system import System


@runtime_checkable
class StateEstimator(Protocol):
    """Any observer: a system from the plant's inputs and outputs to estimates `<state>_hat`, in the plant's order."""

    @property
    def system(self) -> System:
        """The observer: inputs u and y, outputs the estimates."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Compensator:
    """A law fed by an observer's estimates.

    Attributes:
        system: inputs the plant's outputs and the references, outputs the plant's inputs, then the estimates.
    """

    law: Law
    observer: StateEstimator
    system: System

    def __repr__(self) -> str:
        return repr(self.system)

    def _repr_latex_(self) -> str:
        return self.system._repr_latex_()


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoop:
    """A plant and the controller around it.

    Attributes:
        system: states those of the plant then of the controller; inputs the references (and plant inputs the
            controller does not drive); outputs those of the plant, its inputs, then the estimates.
    """

    plant: System
    controller: Law | Compensator
    system: System

    def __repr__(self) -> str:
        return repr(self.system)

    def _repr_latex_(self) -> str:
        return self.system._repr_latex_()


def compensator(law: Law, observer: StateEstimator) -> Compensator:
    """The compensator of a law and an observer (exact, high-gain or Kalman) of the same plant.

    Raises:
        DesignError: if the observer estimates other states than the law needs.
    """
    plant = law.form.system
    estimates = {s.name for s in observer.system.outputs}
    missing = [s.name for s in plant.states if f"{s.name}_hat" not in estimates]
    if missing:
        raise DesignError(
            f"compensator of '{plant.name}'",
            f"the observer does not estimate {', '.join(missing)}.",
            "Design it for this plant.",
        )
    wires = {f"law.{s.name}": f"observer.{s.name}_hat" for s in plant.states}
    wires |= {f"observer.{s.name}": f"law.{s.name}" for s in plant.inputs}
    whole = connect(
        {"observer": observer.system, "law": law.system},
        wires,
        outputs=[*(f"law.{s.name}" for s in plant.inputs), *(f"observer.{s.name}_hat" for s in plant.states)],
        name=f"compensator of {plant.name}",
        text="observer and feedback law",
    )
    return Compensator(law=law, observer=observer, system=whole)


def close_loop(plant: System, controller: Law | Compensator) -> ClosedLoop:
    """The closed loop of a plant, not necessarily the one designed for, and a law or compensator."""
    if isinstance(controller, Law):
        # A law designed for a reduced plant asks for some of the states only.
        asked = {s.name for s in controller.system.inputs}
        measured, wires = (
            _with_states_as_outputs(plant),
            {f"controller.{s.name}": f"plant.{s.name}" for s in plant.states if s.name in asked},
        )
        shown: list[str] = []
    else:
        designed = controller.law.form.system
        measured = plant
        wires = {f"controller.{s.name}": f"plant.{s.name}" for s in designed.outputs}
        shown = [f"controller.{s.name}_hat" for s in designed.states]
    wires |= {f"plant.{s.name}": f"controller.{s.name}" for s in controller.system.outputs if s.name in _names(plant)}
    whole = connect(
        {"plant": measured, "controller": controller.system},
        wires,
        outputs=[
            *(f"plant.{s.name}" for s in plant.outputs),
            *(f"plant.{s.name}" for s in plant.inputs),
            *shown,
        ],
        name=f"closed loop of {plant.name}",
        text="plant with its controller",
    )
    return ClosedLoop(plant=plant, controller=controller, system=whole)


def _names(plant: System) -> set[str]:
    return {s.name for s in plant.inputs}


def _with_states_as_outputs(plant: System) -> System:

    own = {s.name for s in plant.outputs}
    extra = [s for s in plant.states if s.name not in own]
    return replace(
        plant,
        outputs=(*plant.outputs, *extra),
        readouts=(*plant.readouts, *(s.symbol for s in extra)),
    )
