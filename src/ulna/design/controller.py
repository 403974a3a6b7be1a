"""The controller that a plant can have: which form, law and observer serve what is asked for."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ulna.base import DesignError, NoFormError, UlnaWarning
from ulna.design.control import AbstractReference, Compensator, Law, compensator, state_feedback
from ulna.design.forms import controller_form, input_output_form
from ulna.design.gains import Gains
from ulna.design.internal import minimum_phase, zero_dynamics
from ulna.design.observers import (
    HighGain,
    KalmanNoise,
    Observer,
    exact_observer,
    extended_kalman_filter,
    high_gain_observer,
    observer_form,
    transformed_observer_form,
)
from ulna.plants import PlantLike, as_plant
from ulna.system import System, controlled_part, measured_part, with_uses


@dataclass(frozen=True, slots=True, kw_only=True)
class Controller:
    """A law, an observer, or both as a compensator, for one plant.

    Attributes:
        plant: what it was designed for.
        law, observer: what was asked for, else None.
        compensator: both together; None unless both were asked for.
        system: the compensator as a system; the law or the observer where it is alone.
    """

    plant: System
    law: Law | None
    observer: Observer | None
    compensator: Compensator | None
    system: System

    @property
    def poles(self) -> dict[str, tuple[complex, ...]]:
        """Poles in 1/s that the law, and the error of the observer, were given; of a Kalman filter none."""
        return {name: part.poles for name, part in (("law", self.law), ("observer", self.observer)) if part is not None}

    @property
    def reads_states(self) -> bool:
        """Whether its inputs mean states of the plant, where an output bears the same name."""
        return self.observer is None and self.law is not None and self.law.reads_states

    @property
    def initial(self) -> Mapping[str, float]:
        """Where the observer's states start: estimates at the operating point that the plant gives, else at zero.

        A filter's covariance starts at its initial value.
        """
        if self.observer is None:
            return {}
        given, names = dict(self.plant.operating_point), [s.name for s in self.plant.states]
        starts = {f"{name}_hat": float(given.get(name, 0)) for name in names}
        return starts | {name: float(value) for name, value in self.observer.initial.items()}

    def __repr__(self) -> str:
        return "\n".join(repr(part) for part in (self.law, self.observer) if part is not None)


def controller_for(
    plant: PlantLike,
    *,
    law: Gains | Law | None = None,
    observer: Gains | HighGain | KalmanNoise | Observer | None = None,
    outputs_only: bool = False,
    reference: AbstractReference | None = None,
    integral: bool = False,
    controlled: Sequence[str] | None = None,
    measured: Sequence[str] | None = None,
) -> Controller:
    """The controller of a plant: the law in its controller form, the observer in its observer form, and both joined.

    Args:
        plant: the plant, its name or its file.
        law: poles or a gain rule; a law that is designed already is taken as it is.
        observer: poles of the error, for the observer form or, where only that exists, the one of transformed outputs;
            `HighGain(...)` or `KalmanNoise(...)` for a plant that has neither; or a ready observer.
        outputs_only: linearise the plant's outputs only (input-output form), not the whole state.
        reference: `SetPoint()` or `Track()`; left out, the law holds the operating point.
        controlled, measured: names of the outputs that the law is for, and of those that the observer reads; left out,
            what the plant says of its outputs (`with_uses`), which is both.
        integral: add integral action, which needs one more pole per chain.

    Raises:
        NoFormError: if the plant lacks the form; the hint says what serves instead.
        DesignError: if neither is asked for, an option has no law to act on, or gains do not fit.

    Warns:
        UlnaWarning: if the outputs alone are linearised and what is left to itself may run away.
    """
    plant = with_uses(as_plant(plant), controlled=controlled, measured=measured)
    if law is None and observer is None:
        what = "Give law=[-2, -3, -4], say, observer=[-9, -10, -11], or both."
        raise DesignError(f"a controller for '{plant.name}'", "neither a law nor an observer is asked for.", what)
    options = {"outputs_only": outputs_only, "reference": reference is not None, "integral": integral}
    wants = [name for name, asked in options.items() if asked]
    if wants and (law is None or isinstance(law, Law)):
        found = "there is no law to add it to." if law is None else "the law is designed already."
        raise DesignError(wants[0], found, "Give law= the poles.")
    if law is not None and not isinstance(law, Law):
        law = _law(controlled_part(plant), law, outputs_only=outputs_only, reference=reference, integral=integral)
    if observer is not None and not isinstance(observer, Observer):
        observer = _observer(measured_part(plant), observer)
    both = compensator(law, observer) if law is not None and observer is not None else None
    system = next(part.system for part in (both, law, observer) if part is not None)
    return Controller(plant=plant, law=law, observer=observer, compensator=both, system=system)


def _law(
    plant: System, gains: Gains, *, outputs_only: bool, reference: AbstractReference | None, integral: bool
) -> Law:
    if outputs_only:
        form = input_output_form(plant)
        if form.internal_dimension:
            _warn_of_internal_dynamics(plant)
    else:
        try:
            form = controller_form(plant)
        except NoFormError as missing:
            square = 0 < len(plant.outputs) == len(plant.inputs)
            offer = "Give outputs_only=True to linearise the outputs only." if square else missing.hint
            raise type(missing)(missing.asked, missing.found, offer, value=missing.value) from None
    return state_feedback(form, gains, reference=reference, integral=integral)


def _warn_of_internal_dynamics(plant: System) -> None:
    """Say what the law leaves to itself."""
    stability = str(minimum_phase(zero_dynamics(plant)).stability)
    if stability not in ("exponential", "asymptotic"):
        warnings.warn(
            f"the zero dynamics of '{plant.name}' are {stability}: with the outputs held the rest of the state may "
            "run away. `analyse` shows them.",
            UlnaWarning,
            stacklevel=4,
        )


def _observer(plant: System, asked: Gains | HighGain | KalmanNoise) -> Observer:
    if isinstance(asked, KalmanNoise):
        return extended_kalman_filter(plant, asked)
    if isinstance(asked, HighGain):
        return high_gain_observer(plant, asked.gains, time_scale=asked.time_scale)
    try:
        form = observer_form(plant)
    except NoFormError as missing:
        try:
            form = transformed_observer_form(plant)
        except NoFormError:
            offer = "Give observer=HighGain(gains=..., time_scale=0.1) or observer=KalmanNoise()."
            found = missing.found
            if not plant.outputs:
                found, offer = "the plant has no output to observe.", "Add [outputs], or leave the observer out."
            raise type(missing)(missing.asked, found, offer, value=missing.value) from None
    return exact_observer(form, asked)
