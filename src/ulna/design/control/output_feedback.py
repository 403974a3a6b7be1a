"""Law and observer together: the output-feedback compensator (paper eq. 53-54), and the loop it closes."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ulna.base import DesignError, Verdict
from ulna.design.control.law import Law
from ulna.design.observers import Observer
from ulna.plants import PlantLike, as_plant
from ulna.system import Signal, System, SystemLike, as_system, connect


@dataclass(frozen=True, slots=True, kw_only=True)
class Compensator:
    """A law fed by an observer's estimates.

    Attributes:
        law: the law; observer: what estimates the states.
        system: inputs the plant's outputs and the references, outputs the plant's inputs, then the estimates.
    """

    law: Law
    observer: Observer
    system: System

    def __repr__(self) -> str:
        return repr(self.system)

    def _repr_latex_(self) -> str:
        return self.system._repr_latex_()


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoop:
    """A plant and the controller around it.

    Attributes:
        plant: what is controlled.
        controller: a law, a compensator, or any other system that drives the plant's inputs.
        system: states those of the plant then of the controller; inputs the references (and plant inputs the
            controller does not drive); outputs those of the plant, its inputs, then what else the controller shows.
    """

    plant: System
    controller: SystemLike
    system: System

    def __repr__(self) -> str:
        return repr(self.system)

    def _repr_latex_(self) -> str:
        return self.system._repr_latex_()


def compensator(law: Law, observer: Observer | SystemLike) -> Compensator:
    """The compensator of a law and an observer of the same plant.

    Args:
        law: the law.
        observer: of any kind; a system of the user's own, if its outputs are called `<state>_hat`.

    Raises:
        DesignError: if the observer estimates other states than the law needs.
    """
    plant, estimator = law.form.system, as_system(observer)
    if not isinstance(observer, Observer):
        claim = f"'{estimator.name}' converges to the states of '{plant.name}'"
        verdict = Verdict.undecided(claim, tried="nothing: it was not designed here")
        observer = Observer(plant=plant, system=estimator, polynomials=(), verdict=verdict)
    estimates, taken = {s.name for s in estimator.outputs}, {s.name for s in estimator.inputs}
    missing = [s.name for s in plant.states if f"{s.name}_hat" not in estimates]
    if missing:
        raise DesignError(
            f"compensator of '{plant.name}'",
            f"the observer does not estimate {', '.join(missing)}.",
            "Design it for this plant.",
        )
    wires = {f"law.{s.name}": f"observer.{s.name}_hat" for s in plant.states}
    wires |= {f"observer.{s.name}": f"law.{s.name}" for s in plant.inputs if s.name in taken}
    whole = connect(
        {"observer": estimator, "law": law.system},
        wires,
        outputs=[*(f"law.{s.name}" for s in plant.inputs), *(f"observer.{s.name}_hat" for s in plant.states)],
        name=f"compensator of {plant.name}",
        text="observer and feedback law",
    )
    return Compensator(law=law, observer=observer, system=whole)


def close_loop(plant: PlantLike, controller: SystemLike) -> ClosedLoop:
    """The closed loop of a plant and a controller, wired by name.

    Each of the controller's inputs is fed by the plant's output of that name, else by its state of that name (a law on
    measured states takes states first); what is neither is a reference, an input of the loop. Each of its outputs
    drives the plant's input of that name.

    Args:
        plant: not necessarily the one designed for.
        controller: a law, a compensator, or any system whose outputs bear names of the plant's inputs.

    Raises:
        DesignError: if the controller drives none of the plant's inputs.
    """
    plant, system = as_plant(plant), as_system(controller)
    inputs = {s.name for s in plant.inputs}
    driven = [s.name for s in system.outputs if s.name in inputs]
    if not driven:
        raise DesignError(
            f"closed loop of '{plant.name}'",
            f"the controller's outputs are {', '.join(s.name for s in system.outputs) or 'none'}, "
            f"the plant's inputs {', '.join(inputs) or 'none'}.",
            "Give an output of the controller the name of the input it is to drive.",
        )
    measured, wires = _measured(plant, system, states_first=isinstance(controller, Law))
    wires |= {f"plant.{name}": f"controller.{name}" for name in driven}
    whole = connect(
        {"plant": measured, "controller": system},
        wires,
        outputs=[
            *(f"plant.{s.name}" for s in plant.outputs),
            *(f"plant.{s.name}" for s in plant.inputs),
            *(f"controller.{s.name}" for s in system.outputs if s.name not in inputs),
        ],
        name=f"closed loop of {plant.name}",
        text="plant with its controller",
    )
    return ClosedLoop(plant=plant, controller=controller, system=whole)


def _measured(plant: System, controller: System, *, states_first: bool) -> tuple[System, dict[str, str]]:
    """The plant with the states that the controller reads among its outputs, and the wires to the controller."""
    outputs = dict(zip((s.name for s in plant.outputs), plant.inline(plant.readouts), strict=True))
    states = {s.name: s for s in plant.states}
    wires: dict[str, str] = {}
    more: list[tuple[Signal, Signal]] = []
    for name in (s.name for s in controller.inputs):
        # An observer calls an output so whose own name belongs to a state that it is not.
        given = name if name in outputs else name.removesuffix("_measured")
        hidden = states_first and name in states and outputs.get(name) != states[name].symbol
        if given in outputs and not hidden:
            wires[f"controller.{name}"] = f"plant.{given}"
        elif name in states:
            shown = replace(states[name], name=f"{name}_state") if name in outputs else states[name]
            more.append((shown, states[name]))
            wires[f"controller.{name}"] = f"plant.{shown.name}"
    widened = replace(
        plant,
        outputs=(*plant.outputs, *(shown for shown, _ in more)),
        readouts=(*plant.readouts, *(state.symbol for _, state in more)),
    )
    return widened, wires
