"""The controller that a plant can have: which form, law and observer serve what is asked for."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ulna.base import DesignError, NoFormError, PlantError, UlnaWarning
from ulna.design.choice import Method, chosen_law, chosen_observer, formed_observer, pace
from ulna.design.control import AbstractReference, Compensator, Law, compensator
from ulna.design.gains import Bandwidth, Gains
from ulna.design.observers import (
    HighGain,
    KalmanNoise,
    Observer,
    extended_kalman_filter,
    high_gain_observer,
    local_observer,
)
from ulna.plants import PlantLike, as_plant
from ulna.system import System, controlled_part, measured_part, starting_point, with_uses


@dataclass(frozen=True, slots=True, kw_only=True)
class Controller:
    """A law, an observer, or both as a compensator, for one plant.

    Attributes:
        plant: what it was designed for.
        law, observer: what was asked for, else None.
        compensator: both together; None unless both were asked for.
        system: the compensator as a system; the law or the observer where it is alone.
        passed: by method why it was passed over for the one taken, in one line each; empty where none was.

    Examples:
        >>> made = ulna.controller_for("duffing", law=[-1, -2])
        >>> made.law.method
        'exact, on the whole state'
    """

    plant: System
    law: Law | None
    observer: Observer | None
    compensator: Compensator | None
    system: System
    passed: Mapping[str, str] = field(default_factory=dict)

    @property
    def poles(self) -> dict[str, tuple[complex, ...]]:
        """Poles in 1/s that the law, and the error of the observer, were given; of a Kalman filter none."""
        return {name: part.poles for name, part in (("law", self.law), ("observer", self.observer)) if part is not None}

    @property
    def reads_states(self) -> bool:
        """Whether its inputs mean states of the plant, where an output has the same name."""
        return self.observer is None and self.law is not None and self.law.reads_states

    @property
    def initial(self) -> Mapping[str, float]:
        """Where the observer's states start: estimates where the plant starts unless told otherwise.

        A filter's covariance starts at its initial value.
        """
        if self.observer is None:
            return {}
        point = starting_point(self.plant).numbers
        starts = {f"{s.name}_hat": point[s.name] for s in self.plant.states}
        return starts | {name: float(value) for name, value in self.observer.initial.items()}

    def __repr__(self) -> str:
        return "\n".join(repr(part) for part in (self.law, self.observer) if part is not None)

    def _repr_latex_(self) -> str:
        return "".join(part._repr_latex_() for part in (self.law, self.observer) if part is not None)


def controller_for(
    plant: PlantLike,
    *,
    law: Gains | Law | None = None,
    observer: Gains | HighGain | KalmanNoise | Observer | None = None,
    method: Method | None = None,
    reference: AbstractReference | None = None,
    integral: bool = False,
    controlled: Sequence[str] | None = None,
    measured: Sequence[str] | None = None,
) -> Controller:
    """The controller of a plant: a law, an observer, and both joined; with nothing asked for the best that exists.

    The law is the first of these that the plant has: exact, on the whole state; input-output, where the rest is stable
    by itself; approximate input-output; local, on the linearisation. `Controller.passed` says why the better ones are
    not there. Without gains the law has the plant's own bandwidth ω (its fastest growing mode, three times its slowest
    where none grows, 1 rad/s for bare integrators), the observer 2 ω; the observer is left out where every state is
    an output.

    Args:
        plant: the plant, its name or its file.
        law: poles or a gain rule, in the coordinates of the method; a law that is designed already is taken as it is.
        observer: poles of the error, for the observer form, or the one of transformed outputs, or the linearisation;
            `HighGain(...)`, `KalmanNoise(...)` (an extended filter, with `Method.LOCAL` one of constant gain); or a
            ready observer.
        method: how to design the law; left out, the best that exists. `Method.LOCAL` holds for the observer too.
        reference: `SetPoint()` or `Track()`; left out, the law holds the operating point.
        controlled, measured: names of the outputs that the law is for, and of those that the observer reads; left out,
            what the plant says of its outputs (`with_uses`), which is both.
        integral: add integral action, which needs one more pole per chain or held output.

    Raises:
        NoFormError: if the plant lacks the form of the method asked for; the hint says what serves instead.
        DesignError: if an option has no law to act on, gains do not fit, or there is no law at all: then with every
            method and why not.

    Warns:
        UlnaWarning: if gains were given and fell to a law that is not exact; if the outputs alone are linearised as
            asked and what is left to itself may diverge.

    Examples:
        >>> made = ulna.controller_for("mass_spring_damper", law=[-1, -2], observer=[-5, -6])
        >>> made.poles["law"]
        ((-2+0j), (-1+0j))
    """
    plant = with_uses(as_plant(plant), controlled=controlled, measured=measured)
    best = law is None and observer is None
    options = {
        "method": method is not None and observer is None,
        "reference": reference is not None,
        "integral": integral,
    }
    wants = [name for name, asked in options.items() if asked]
    if wants and not best and (law is None or isinstance(law, Law)):
        found = "there is no law to add it to." if law is None else "the law is designed already."
        raise DesignError(wants[0], found, "Give law= the poles.")
    passed: dict[str, str] = {}
    if best or (law is not None and not isinstance(law, Law)):
        gains = Bandwidth(pace(plant)) if law is None else law
        law, passed = chosen_law(controlled_part(plant), gains, method, reference=reference, integral=integral)
        if not best and method is None and passed:
            _warn_of_choice(law, passed)
    if best:
        observer, reason = chosen_observer(measured_part(plant), 2.0 * pace(plant))
        passed |= {"observer": reason} if reason else {}
    elif observer is not None and not isinstance(observer, Observer):
        observer = _observer(measured_part(plant), observer, local=method is Method.LOCAL)
    both = compensator(law, observer) if law is not None and observer is not None else None
    system = next(part.system for part in (both, law, observer) if part is not None)
    return Controller(plant=plant, law=law, observer=observer, compensator=both, system=system, passed=passed)


def _warn_of_choice(law: Law, passed: Mapping[str, str]) -> None:
    reasons = " ".join(f"{method}: {why}" for method, why in passed.items())
    warnings.warn(f"the law of '{law.plant.name}' is {law.method}. {reasons}", UlnaWarning, stacklevel=3)


def _observer(plant: System, asked: Gains | HighGain | KalmanNoise, *, local: bool) -> Observer:
    if isinstance(asked, HighGain):
        return high_gain_observer(plant, asked.gains, time_scale=asked.time_scale)
    if local:
        return local_observer(plant, asked)
    if isinstance(asked, KalmanNoise):
        return extended_kalman_filter(plant, asked)
    missing = formed_observer(plant, asked)
    if isinstance(missing, Observer):
        return missing
    try:
        made = local_observer(plant, asked)
    except (DesignError, PlantError) as error:
        offer = "Give observer=HighGain(gains=..., time_scale=0.1) or observer=KalmanNoise()."
        found = f"{missing.found} A local one: {error.found}"
        if not plant.outputs:
            found, offer = "the plant has no output to observe.", "Add [outputs], or leave the observer out."
        raise NoFormError(missing.asked, found, offer, value=missing.value) from None
    warnings.warn(f"the observer of '{plant.name}' is local: {missing.found}", UlnaWarning, stacklevel=3)
    return made
