"""Law and observer together: the output-feedback compensator (paper eq. 53-54), and the loop it closes."""

from __future__ import annotations

from dataclasses import dataclass

from ulna.base import DesignError, Verdict
from ulna.design.control.law import Law
from ulna.design.observers import Observer
from ulna.loop import Hardware, Loop, joined
from ulna.plants import PlantLike, as_plant
from ulna.system import System, SystemLike, as_system


@dataclass(frozen=True, slots=True, kw_only=True)
class Compensator:
    """A law fed by an observer's estimates.

    Attributes:
        law: the law; observer: what estimates the states.
        system: inputs the plant's outputs and the references, outputs the plant's inputs, then the estimates.

    Examples:
        >>> made = ulna.compensator(ulna.state_feedback("duffing", [-1, -2]), ulna.exact_observer("duffing", [-5, -6]))
        >>> [signal.name for signal in made.system.inputs]
        ['y']
    """

    law: Law
    observer: Observer
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

    Examples:
        >>> law, observer = ulna.state_feedback("duffing", [-1, -2]), ulna.exact_observer("duffing", [-5, -6])
        >>> ulna.compensator(law, observer).system.name
        'compensator of Duffing oscillator with force'
    """
    plant, estimator = law.plant, as_system(observer)
    if not isinstance(observer, Observer):
        claim = f"'{estimator.name}' converges to the states of '{plant.name}'"
        verdict = Verdict.undecided(claim, tried="nothing: it was not designed here")
        observer = Observer(plant=plant, system=estimator, polynomials=(), verdict=verdict)
    estimates = {s.name for s in estimator.outputs}
    missing = [s.name for s in plant.states if f"{s.name}_hat" not in estimates]
    if missing:
        raise DesignError(
            f"compensator of '{plant.name}'",
            f"the observer does not estimate {', '.join(missing)}.",
            "Design it for this plant.",
        )
    whole = joined(law.system, estimator, name=f"compensator of {plant.name}")
    return Compensator(law=law, observer=observer, system=whole)


def close_loop(plant: PlantLike, controller: SystemLike, hardware: Hardware | None = None) -> Loop:
    """The loop of a plant and a controller, wired by name; see `Loop`.

    Args:
        plant: not necessarily the one designed for; a system, a catalogue name or a plant file.
        controller: a law, a compensator, or any system whose outputs are named like the plant's inputs.
        hardware: processor, sensors, drive and limits; None for the continuous loop.

    Raises:
        SimulationError: if the controller drives none of the plant's inputs.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> [output.name for output in ulna.close_loop("duffing", law).system.outputs]
        ['y', 'u']
    """
    return Loop(plant=as_plant(plant), controller=controller, hardware=hardware)
