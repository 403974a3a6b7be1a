"""Which law and which observer a plant gets: the methods from the best down, and why one is passed over."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from enum import Enum

from ulna.base import DesignError, NoFormError, NotAffineError, UlnaError, UlnaWarning
from ulna.design.control import AbstractReference, Law, close_loop, local_law, state_feedback
from ulna.design.forms import approximate_form, controller_form, dynamic_extension, input_output_form
from ulna.design.gains import Bandwidth, Gains
from ulna.design.internal import minimum_phase, zero_dynamics
from ulna.design.linear import as_numbers, linear_plant, own_bandwidth
from ulna.design.observers import Observer, exact_observer, local_observer, observer_form, transformed_observer_form
from ulna.symbolic.exact import attempt
from ulna.symbolic.formulas import formula
from ulna.system import System, equilibrium, linearise, on_one_side

_SECONDS = 5.0
"""s that the search for one form may take; then the next best serves."""
_EXTEND = "Use `dynamic_extension`."
_STABLE = ("exponential", "asymptotic")


class Method(Enum):
    """How a law is designed, the best first.

    Examples:
        >>> ulna.controller_for("duffing", method=ulna.Method.LOCAL).law.method
        'local, on the linearisation at the origin'
        >>> [method.value for method in ulna.Method]
        ['exact', 'input-output', 'approximate', 'local']
    """

    EXACT = "exact"
    """Linearise the whole state, in the controller form."""
    INPUT_OUTPUT = "input-output"
    """Linearise the outputs, as many as inputs; the rest of the state is left to itself."""
    APPROXIMATE = "approximate"
    """Linearise the output but for terms that vanish at the operating point (Hauser, Sastry, Kokotović)."""
    LOCAL = "local"
    """Feed back the whole state with the gains of the linearisation at the operating point."""


class PassedOverError(Exception):
    """A method that the plant does not have; the text says why."""


def chosen_law(
    plant: System, gains: Gains, method: Method | None, *, reference: AbstractReference | None, integral: bool
) -> tuple[Law, dict[str, str]]:
    """The law by the method asked for, or by the best that exists with why the better ones were passed over.

    Raises:
        NoFormError: if the plant lacks the form asked for.
        DesignError: if no method gives a law, or the gains do not fit.
    """
    if method is not None:
        return _by(plant, gains, method, reference=reference, integral=integral), {}
    passed: dict[str, str] = {}
    singular, unfit = None, None
    try:
        found = attempt(_SECONDS, "the controller form", controller_form, plant)
        if found.value is None:
            raise NoFormError(f"a controller form of '{plant.name}'", f"{found.reason}.")
        form = found.value
        if not form.at_point.fails:
            return state_feedback(form, gains, reference=reference, integral=integral), {}
        singular = form
        passed[Method.EXACT.value] = "the law divides by zero at the operating point."
    except NoFormError as missing:
        passed[Method.EXACT.value] = missing.found
    except UlnaError as error:
        if isinstance(error, DesignError):
            raise
        passed[Method.EXACT.value], unfit = error.found, error
        if (side := on_one_side(plant)) is not None:
            law, further = chosen_law(side.system, gains, method, reference=reference, integral=integral)
            pieces = ", ".join(f"{formula(term)} is {formula(piece)}" for term, piece in side.pieces.items())
            law = replace(law, plant=plant, method=f"{law.method}, where {pieces}")
            return law, {"whole plant": f"{error.found} The law is for where {pieces}.", **further}
    rungs: tuple[tuple[Method, Callable[[], Law]], ...] = (
        (Method.INPUT_OUTPUT, lambda: _stable_outputs(plant, gains, reference=reference, integral=integral)),
        (Method.APPROXIMATE, lambda: _approximate(plant, gains, reference=reference, integral=integral)),
        (Method.LOCAL, lambda: local_law(plant, gains, reference=reference, integral=integral)),
    )
    for each, design in rungs:
        try:
            return design(), passed
        except PassedOverError as reason:
            passed[each.value] = str(reason)
        except UlnaError as error:
            passed[each.value] = error.found
    if singular is not None:
        return state_feedback(singular, gains, reference=reference, integral=integral), passed
    reasons = " ".join(f"{name}: {why}" for name, why in passed.items())
    raise DesignError(f"a law for '{plant.name}'", f"no method gives one. {reasons}", _hint(plant, passed, unfit))


def _hint(plant: System, passed: dict[str, str], first: UlnaError | None) -> str:
    if not plant.inputs:
        return "Add [inputs], or ask for an observer alone."
    if 0 < len(plant.outputs) == len(plant.inputs) and "needed" in passed[Method.LOCAL.value]:
        return "Give method=Method.INPUT_OUTPUT to linearise the outputs only, or other poles."
    if len(plant.inputs) > 1:
        extension = attempt(_SECONDS, "dynamic extension", dynamic_extension, plant).value
        if extension is not None and extension.verdict.holds and extension.complete.holds:
            return (
                "It is flat: integrators before its inputs give a law with a pole for each state and integrator. "
                + _EXTEND
            )
    if first is not None and (isinstance(first, NotAffineError) or "not smooth" in first.found):
        return first.hint
    return "Choose another [operating_point], where the inputs reach more."


def _by(plant: System, gains: Gains, method: Method, *, reference: AbstractReference | None, integral: bool) -> Law:
    if method is Method.LOCAL:
        return local_law(plant, gains, reference=reference, integral=integral)
    if method is Method.EXACT:
        return state_feedback(controller_form(plant), gains, reference=reference, integral=integral)
    if method is Method.APPROXIMATE:
        return state_feedback(approximate_form(plant), gains, reference=reference, integral=integral)
    form = input_output_form(plant)
    if form.at_point.fails and len(plant.inputs) == 1:
        with suppress(NoFormError):
            law = state_feedback(approximate_form(plant), gains, reference=reference, integral=integral)
            warnings.warn(
                f"the input-output law of '{plant.name}' divides by zero at the operating point: "
                f"this one is {law.method}.",
                UlnaWarning,
                stacklevel=5,
            )
            return law
    if form.internal_dimension:
        stability = _stability(plant)
        if stability not in _STABLE:
            warnings.warn(
                f"the zero dynamics of '{plant.name}' are {stability}: with the outputs held the rest of the state may "
                "diverge. `analyse` shows them.",
                UlnaWarning,
                stacklevel=5,
            )
    return state_feedback(form, gains, reference=reference, integral=integral)


def _stable_outputs(plant: System, gains: Gains, *, reference: AbstractReference | None, integral: bool) -> Law:
    """The input-output law where it is regular and what it leaves to itself is stable."""
    form = input_output_form(plant)
    if form.at_point.fails:
        raise PassedOverError("the law divides by zero at the operating point.")
    if form.internal_dimension and (stability := _stability(plant)) not in _STABLE:
        raise PassedOverError(f"the zero dynamics are {stability}: with the outputs held the rest may diverge.")
    return state_feedback(form, gains, reference=reference, integral=integral)


def _approximate(plant: System, gains: Gains, *, reference: AbstractReference | None, integral: bool) -> Law:
    """The approximate law, where its loop is stable near the operating point."""
    law = state_feedback(approximate_form(plant), gains, reference=reference, integral=integral)
    if not law.system.states and not reference:
        loop = close_loop(plant.with_values(), law).system.with_values()
        poles = linearise(loop, dict(equilibrium(plant.with_values()).states)).eigenvalues
        if max(p.real for p in poles) >= 0:
            raise PassedOverError("with the dropped terms included, its loop is not stable at the operating point.")
    elif law.form is not None and law.form.internal_dimension:
        raise PassedOverError("it leaves part of the state uncontrolled.")
    return law


def _stability(plant: System) -> str:
    return str(minimum_phase(zero_dynamics(plant)).stability)


def pace(plant: System) -> float:
    """The plant's own bandwidth ω in rad/s, at its operating point; 1 where it does not rest there."""
    try:
        return own_bandwidth(as_numbers(linear_plant(plant).A))
    except DesignError:
        return 1.0


def formed_observer(plant: System, gains: Gains) -> Observer | NoFormError:
    """The observer whose error is linear, in the observer form or that of transformed outputs; or why there is none."""
    missing: NoFormError | None = None
    for seek in (observer_form, transformed_observer_form):
        try:
            found = attempt(_SECONDS, "the form", seek, plant)
        except NoFormError as none:
            missing = missing or none
            continue
        if found.value is not None:
            return exact_observer(found.value, gains)
        more = "Give more time (--seconds, ULNA_PATIENCE), or take a local observer."
        missing = missing or NoFormError(f"an observer form of '{plant.name}'", f"{found.reason}.", more)
    return missing or NoFormError(f"an observer form of '{plant.name}'", "there is none.")


def chosen_observer(plant: System, bandwidth: float) -> tuple[Observer | None, str]:
    """The best observer of a plant, and why no better one or none; none where every state is measured."""
    if not plant.outputs:
        return None, "the plant has no output: the law reads its states."
    if set(plant.state_symbols) <= set(plant.inline(plant.readouts)):
        return None, ""
    gains = Bandwidth(bandwidth)
    try:
        missing = formed_observer(plant, gains)
    except UlnaError as error:
        missing = error
    if isinstance(missing, Observer):
        return missing, ""
    try:
        return local_observer(plant, gains), f"local, for there is no observer form: {missing.found}"
    except UlnaError as error:
        return None, f"none: {error.found} The law reads the states."
