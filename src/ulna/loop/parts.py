"""`Parts`: a controller as plain systems, whatever it was made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ulna.base import SimulationError
from ulna.system import KalmanFilter, LinearInjection, System, connect


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parts:
    """A controller.

    Attributes:
        system: the whole. law: what computes the commands; the whole, where there is no observer; None of an observer
            by itself.
        observer: what estimates, by itself: in a loop with a processor it sees the limited, delayed input.
        states_first: whether its inputs mean states, where an output of the plant has the same name.
        initial: where states of the controller start that are not at 0 and nobody names: a filter's covariance.
    """

    system: System
    law: System | None
    observer: System | LinearInjection | KalmanFilter | None = None
    states_first: bool = False
    initial: Mapping[str, float] = field(default_factory=dict)


def parts_of(controller: Any) -> Parts:
    """The parts of a controller: a `System`, or what has one as its `.system` and perhaps `.law` and `.observer`.

    An observer by itself has `.sampled`, None where a processor runs steps of its rates.

    Raises:
        SimulationError: what is neither.
    """
    if isinstance(controller, Parts):
        return controller
    whole = _system(controller)
    law, observer = getattr(controller, "law", None), getattr(controller, "observer", None)
    if law is None and observer is None and hasattr(controller, "sampled"):
        observer = controller
    if observer is None:
        return Parts(system=whole, law=whole, states_first=bool(getattr(controller, "reads_states", False)))
    sampled = observer if isinstance(observer, LinearInjection | KalmanFilter) else getattr(observer, "sampled", None)
    return Parts(
        system=whole,
        law=None if law is None else _system(law),
        observer=_system(observer) if sampled is None else sampled,
        initial={name: float(value) for name, value in getattr(observer, "initial", {}).items()},
    )


def joined(law: System, observer: System, *, name: str) -> System:
    """Law and observer as one system: the law reads the estimate `<name>_hat` (or `<name>`) of each of its inputs.

    Its inputs are the measured signals and the references, its outputs those of the law, then the estimates. The
    observer reads what the law says, without limits.
    """
    estimates = [s.name for s in observer.outputs]
    commands = {s.name for s in law.outputs}
    wires = {f"observer.{s.name}": f"law.{s.name}" for s in observer.inputs if s.name in commands}
    for signal in law.inputs:
        known = [label for label in (f"{signal.name}_hat", signal.name) if label in estimates]
        wires |= {f"law.{signal.name}": f"observer.{label}" for label in known[:1]}
    return connect(
        {"observer": observer, "law": law},
        wires,
        outputs=[*(f"law.{s.name}" for s in law.outputs), *(f"observer.{each}" for each in estimates)],
        name=name,
        text="observer and feedback law",
    )


def _system(given: Any) -> System:
    found = given if isinstance(given, System) else getattr(given, "system", None)
    if not isinstance(found, System):
        raise SimulationError(
            f"controller of type {type(given).__name__}",
            "it is not a system and has none.",
            "Give a law, a compensator, or a System with the plant's inputs among its outputs.",
        )
    return found
