"""Dynamic feedback: a law designed for a plant with integrators before its inputs, which then belong to the law."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ulna.base import NoFormError, UlnaWarning
from ulna.design.control.law import Law, state_feedback
from ulna.design.control.reference import AbstractReference
from ulna.design.forms import DynamicExtension, dynamic_extension, input_output_form
from ulna.design.gains import Gains
from ulna.plants import PlantLike, as_plant
from ulna.system import System, controlled_part, given_point


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtendedLaw:
    """A law on measured states whose own states are the integrators of a dynamic extension.

    Attributes:
        plant: the plant. extension: what was put before its inputs. law: for the extended plant.
        passed, observer, compensator: none, as a `Controller` has them.
        system: inputs the plant's states and the references, outputs the plant's inputs, states the integrators, then
            those of integral action.
    """

    plant: System
    extension: DynamicExtension
    law: Law
    system: System
    passed: Mapping[str, str] = field(default_factory=dict)
    observer: None = None
    compensator: None = None

    @property
    def reads_states(self) -> bool:
        """True: in a loop its inputs are states, whatever outputs of the plant are called."""
        return True

    @property
    def poles(self) -> dict[str, tuple[complex, ...]]:
        """The poles of the chains, in 1/s."""
        return {"law": self.law.poles}

    @property
    def initial(self) -> Mapping[str, float]:
        """Where the integrators start: at the operating point."""
        added = {s.name for s in self.extension.added}
        return {name: value for name, value in _start(self.extension).items() if name in added}

    def __repr__(self) -> str:
        return repr(self.law)


def extended_law(
    plant: PlantLike, gains: Gains, *, reference: AbstractReference | None = None, integral: bool = False
) -> ExtendedLaw:
    """The dynamic law that decouples a plant's controlled outputs where no static one does, such as a car's position.

    Integrators ξ are put before inputs until the decoupling matrix is invertible (Isidori, section 5.4): ξ' = w and
    u = feedback(x, ξ, w), with w the law for the extended plant. Where the plant stands still it may be singular there
    (a car that does not move cannot steer): start ξ elsewhere.

    Args:
        plant: as many controlled outputs as inputs, two or more.
        gains: poles or a gain rule for the chains of the extended plant.
        reference: `SetPoint()` or `Track()`; left out, the law holds the operating point.
        integral: add integral action, which needs one more pole per chain.

    Raises:
        NoFormError: if no extension decouples the outputs.
        DesignError: if the gains do not fit the chains.

    Examples:
        >>> law = ulna.extended_law("unicycle", [-1, -2, -1, -2])
        >>> [state.name for state in law.system.states]
        ['xi1']
    """
    plant = as_plant(plant)
    found = dynamic_extension(controlled_part(plant))
    if found.system is None:
        because = found.verdict.evidence.get("reason", "it was not found")
        asked = f"dynamic extension of '{plant.name}'"
        raise NoFormError(asked, f"{because}.", "Control other outputs, or leave the extension out.", value=found)
    with warnings.catch_warnings():
        # At rest such a plant is singular as a rule, and no [operating_point] can name the integrators.
        warnings.filterwarnings("ignore", "the law of .* divides by zero at the operating point", UlnaWarning)
        law = state_feedback(input_output_form(found.system), gains, reference=reference, integral=integral)
    return ExtendedLaw(plant=plant, extension=found, law=law, system=_joined(plant, found, law))


def _joined(plant: System, extension: DynamicExtension, law: Law) -> System:
    """ξ and the states of integral action move by what the law makes of the extended plant's state."""
    whole = extension.system
    if whole is None:
        raise TypeError(extension)
    commands = dict(zip((s.symbol for s in law.system.outputs), law.system.inline(law.system.readouts), strict=True))
    added = set(extension.added)
    rates = dict(zip(whole.state_symbols, whole.inline(whole.rates), strict=True))
    states = tuple(s for s in whole.states if s.symbol in added)
    moved = [rates[s.symbol].xreplace(commands) for s in states]
    integrals = law.system.inline(law.system.rates)
    feedback = [e.xreplace(commands) for e in extension.feedback]
    seen = {symbol for e in (*moved, *integrals, *feedback) for symbol in e.free_symbols}
    read = {s.name: s for s in (*plant.states, *(s for s in law.system.inputs if s.symbol not in added))}
    starts = {name: value for name, value in whole.operating_point if name in {s.name for s in states}}
    return replace(
        law.system,
        name=f"dynamic law of {plant.name}",
        states=(*states, *law.system.states),
        rates=(*moved, *integrals),
        inputs=tuple(s for s in read.values() if s.symbol in seen),
        outputs=plant.inputs,
        readouts=tuple(feedback),
        definitions=(),
        operating_point=tuple(starts.items()),
    )


def _start(extension: DynamicExtension) -> Mapping[str, float]:
    return {} if extension.system is None else given_point(extension.system).numbers
