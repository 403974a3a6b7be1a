"""The controller that the options ask for: which law, which observer, both as a compensator."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from ulna.cli.options import DesignOptions
from ulna.cli.typed_values import named_values, number_list, pole_list, quantity, three_numbers

if TYPE_CHECKING:
    from ulna.base import NoFormError
    from ulna.design import AbstractGainRule, Controller, ExtendedLaw, Law
    from ulna.system import System


def designed(system: System, options: DesignOptions, *, held_exactly: bool = False) -> Controller | ExtendedLaw:
    """The controller that the options ask for.

    Args:
        system: the plant.
        options: what is asked for.
        held_exactly: the observer is to have a linear part that a processor can hold exactly between samples.

    Raises:
        UlnaError: if two options exclude each other, or the plant lacks what is asked for.
    """
    from ulna.base import DesignError, NoFormError
    from ulna.design import Method, SetPoint, Track, controller_for, injected_observer

    require_consistent(options)
    if options.extend:
        return _extended(system, options)
    if options.schedule or options.swing_up:
        law = _scheduled(system, options) if options.schedule else _swung_up(system, options)
        return controller_for(system, law=law, observer=_observer(options) if options.observer else None)
    try:
        made = controller_for(
            system,
            law=None if options.best or not options.law else _gains(options),
            observer=_observer(options) if options.observer else None,
            method=Method.INPUT_OUTPUT if options.input_output else Method.LOCAL if options.local else None,
            reference=SetPoint() if options.set_point else Track() if options.track else None,
            integral=options.integral,
        )
    except NoFormError as missing:
        raise _in_options(missing, system) from None
    if not held_exactly:
        return made
    if made.observer is None or made.observer.form is None:
        found = (
            "there is no observer whose error is linear." if options.observer else "there is no observer to be held."
        )
        raise DesignError("--discretise exact", found, "Give --observer-poles alone, or --discretise runge-kutta.")
    observer = injected_observer(made.observer.form, _poles(options.observer_poles))
    return controller_for(system, law=made.law, observer=observer)


def _extended(system: System, options: DesignOptions) -> ExtendedLaw:
    from ulna.base import DesignError
    from ulna.design import SetPoint, Track, extended_law

    if options.best:
        asked = "Give --controller-poles, one for each state and each integrator, or --lqr."
        raise DesignError("--extend", "it needs poles or weights.", asked)
    names = {"--local": options.local, "--input-output": options.input_output}
    clash = next((name for name, given in names.items() if given), "an observer" if options.observer else "")
    if clash:
        found = f"it linearises the outputs by a law on measured states, without {clash}."
        raise DesignError("--extend", found, "Leave one of them out.")
    reference = SetPoint() if options.set_point else Track() if options.track else None
    return extended_law(system, _gains(options), reference=reference, integral=options.integral)


def _scheduled(system: System, options: DesignOptions) -> Law:
    from ulna.design import gain_schedule

    over: dict[str, tuple[float, float, int]] = {}
    for name, text, asked in named_values([options.schedule], "--schedule"):
        low, high, count = three_numbers(text, asked)
        over[name] = low, high, int(count)
    return gain_schedule(system, over=over, gains=_gains(options), integral=options.integral)


def _swung_up(system: System, options: DesignOptions) -> Law:
    from ulna.design import local_law, swing_up

    near = {
        name: float(quantity(text, asked)) for name, text, asked in named_values([options.catch], "--catch") if text
    }
    return swing_up(
        local_law(system, _gains(options)),
        energy=options.swing_up,
        push=options.push,
        gain=options.push_gain,
        within=near,
        pivot=options.pivot or None,
        hold=_poles(options.hold) if options.hold else None,
    )


def as_file(controller: Controller | ExtendedLaw) -> System:
    """The controller as a system whose operating point says where its states start.

    Raises:
        DesignError: a law on states that would read an output of the same name.
    """
    from ulna.base import DesignError
    from ulna.symbolic.formulas import exact

    plant = controller.plant
    states = {s.name: s.symbol for s in plant.states} if controller.reads_states else {}
    for output, readout in zip(plant.outputs, plant.inline(plant.readouts), strict=True):
        if states.get(output.name, readout) != readout:
            found = f"the output '{output.name}' of the plant is not its state of that name, which the law reads."
            raise DesignError(
                "--out", found, "Rename the output: a controller in a file refers to signals by name only."
            )
    own = {s.name for s in controller.system.states}
    starts = tuple((name, exact(value)) for name, value in controller.initial.items() if name in own)
    return replace(controller.system, operating_point=starts)


def require_consistent(options: DesignOptions) -> None:
    """Refuse options that exclude each other or have nothing to act on.

    Raises:
        DesignError: naming them.
    """
    from ulna.base import DesignError

    pairs = (
        ("--controller-poles", "--lqr", options.controller_poles and options.lqr),
        ("--set-point", "--track", options.set_point and options.track),
        ("--best", "poles or weights", options.best and (options.controller_poles or options.lqr or options.observer)),
        ("--input-output", "--local", options.input_output and options.local),
        ("--observer-poles", "--kalman", options.observer_poles and options.kalman),
        ("--schedule", "--swing-up", options.schedule and options.swing_up),
        ("--schedule", "--track", options.schedule and options.track),
        ("--swing-up", "--set-point, --track or --integral", options.swing_up and _moves(options)),
        ("--schedule or --swing-up", "--best, --extend or --input-output", _special(options) and _other(options)),
    )
    for one, other, clash in pairs:
        if clash:
            raise DesignError(f"{one} and {other}", "they exclude each other.", "Leave one of them out.")
    if options.high_gain is not None and not options.observer_poles:
        raise DesignError("--high-gain", "it needs the poles of the error.", "Add --observer-poles.")
    if options.swing_up and not options.catch:
        raise DesignError(
            "--swing-up", "the region where the local law takes over is missing.", "Add --catch th=0.4, say."
        )
    changed = [name for name in ("catch", "push", "push_gain", "pivot", "hold") if _given(options, name)]
    if changed and not options.swing_up:
        asked = f"--{changed[0].replace('_', '-')}"
        raise DesignError(asked, "it is an option of a swing-up.", "Add --swing-up with the energy to be pumped.")
    flags = ("integral", "set_point", "track", "input_output", "extend", "schedule", "swing_up")
    wants = [name for name in flags if getattr(options, name)]
    if wants and not options.law:
        asked = f"--{wants[0].replace('_', '-')}"
        raise DesignError(asked, "there is no law to add it to.", "Add --controller-poles, --lqr or --best.")


def _given(options: DesignOptions, name: str) -> bool:
    return getattr(options, name) != next(field.default for field in fields(options) if field.name == name)


def _special(options: DesignOptions) -> bool:
    return bool(options.schedule or options.swing_up)


def _moves(options: DesignOptions) -> bool:
    return options.set_point or options.track or options.integral


def _other(options: DesignOptions) -> bool:
    return options.best or options.extend or options.input_output


def _gains(options: DesignOptions) -> AbstractGainRule:
    from ulna.design import LinearQuadratic

    if options.controller_poles:
        return _poles(options.controller_poles)
    states, inputs = _halves(options.lqr, "--lqr", "'100,1,1:1'", missing="1")
    return LinearQuadratic(state_weights=states, input_weight=inputs)


def _poles(text: str) -> AbstractGainRule:
    from ulna.design import Poles

    return Poles(*pole_list(text))


def _observer(options: DesignOptions) -> Any:
    from ulna.design import HighGain, KalmanNoise

    if options.kalman:
        process, measurement = _halves(options.kalman, "--kalman", "'1,1,1:0.01'")
        return KalmanNoise(process=process, measurement=measurement)
    gains = _poles(options.observer_poles)
    return gains if options.high_gain is None else HighGain(gains=gains, time_scale=options.high_gain)


def _in_options(missing: NoFormError, system: System) -> NoFormError:
    """The refusal with what the command line offers instead of the form."""
    hint = missing.hint
    if "KalmanNoise" in hint:
        weights = f"{','.join(['1'] * len(system.states))}:{','.join(['0.01'] * len(system.outputs))}"
        hint = f"Add --high-gain 0.1, or replace --observer-poles by --kalman {weights}."
    return type(missing)(missing.asked, missing.found, hint, value=missing.value)


def _halves(text: str, option: str, example: str, *, missing: str = "") -> tuple[list[float], list[float]]:
    """The numbers before and behind the colon."""
    from ulna.base import DesignError

    first, colon, second = text.partition(":")
    if not first or (colon and not second) or (not colon and not missing):
        raise DesignError(f"{option} '{text}'", "expected two lists separated by ':'.", f"Write {example}.")
    return number_list(first, option), number_list(second or missing, option)
