"""From the options of a command to a design: which law, which observer, and the compensator of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ulna.cli.session import number_list, pole_list

if TYPE_CHECKING:
    from ulna.base import NoFormError
    from ulna.design import AbstractGainRule, ClosedLoop, Controller, Law
    from ulna.system import System

_LAW, _OBSERVER = "Law", "Observer"
ControllerPoles = Annotated[
    str, typer.Option("--controller-poles", help="Poles of the law: '-2+3.46j,-2-3.46j,-8'.", rich_help_panel=_LAW)
]
Weights = Annotated[
    str,
    typer.Option(
        "--lqr",
        metavar="Q1,…:R",
        help="Instead of poles: linear-quadratic weights, one per coordinate of each chain (or one for all), and of "
        "the new inputs: '100,1,1:1'.",
        rich_help_panel=_LAW,
    ),
]
InputOutput = Annotated[
    bool,
    typer.Option("--input-output", help="Linearise the given outputs only, not the whole state.", rich_help_panel=_LAW),
]
AsSetPoint = Annotated[
    bool, typer.Option("--set-point", help="Let the law take a set point, input '<output>_ref'.", rich_help_panel=_LAW)
]
AsTrack = Annotated[
    bool,
    typer.Option("--track", help="Let the law take a reference with its derivatives.", rich_help_panel=_LAW),
]
Integral = Annotated[
    bool,
    typer.Option("--integral", help="Add integral action; it needs one more pole per chain.", rich_help_panel=_LAW),
]
ObserverPoles = Annotated[
    str, typer.Option("--observer-poles", help="Poles of the error: '-9,-10,-11'.", rich_help_panel=_OBSERVER)
]
HighGain = Annotated[
    float | None,
    typer.Option(
        "--high-gain",
        metavar="EPS",
        help="A high-gain observer with the poles divided by EPS, for a plant without observer form.",
        rich_help_panel=_OBSERVER,
    ),
]
Kalman = Annotated[
    str,
    typer.Option(
        "--kalman",
        metavar="Q1,…:R1,…",
        help="An extended Kalman filter: noise densities of the states and of the outputs: '1,1,1:0.01'.",
        rich_help_panel=_OBSERVER,
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """What a user asks for on the command line, as text; empty where nothing is asked."""

    controller_poles: str = ""
    lqr: str = ""
    input_output: bool = False
    set_point: bool = False
    track: bool = False
    integral: bool = False
    observer_poles: str = ""
    high_gain: float | None = None
    kalman: str = ""

    @property
    def law(self) -> bool:
        """True if a law is asked for."""
        return bool(self.controller_poles or self.lqr)

    @property
    def observer(self) -> bool:
        """True if an observer is asked for."""
        return bool(self.observer_poles or self.kalman)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopMade:
    """A plant, with the controller asked for around it.

    Attributes:
        design: the law, observer and compensator; None where no controller was asked for.
        loop: the closed loop, or None.
        starts: where the controller's states start: estimates where the plant's file gives its operating point, else
            at zero as in the paper; a filter's covariance at its initial value.
    """

    design: Controller | None
    loop: ClosedLoop | None
    starts: Mapping[str, float]

    @property
    def law(self) -> Law | None:
        """The law, where there is one."""
        return None if self.design is None else self.design.law


def make_loop(system: System, options: DesignOptions) -> LoopMade:
    """The controller that the options ask for, designed at the nominal values, around the plant.

    Raises:
        UlnaError: as `make_design`; an observer without a law.
    """
    from ulna.base import DesignError
    from ulna.design import close_loop

    if not options.law and not options.observer:
        _require_consistent(options)
        return LoopMade(design=None, loop=None, starts={})
    if not options.law:
        found = "an observer is asked for without a law."
        raise DesignError("a closed loop", found, "Give --controller-poles or --lqr too.")
    made = make_design(system.with_values(), options)
    return LoopMade(design=made, loop=close_loop(system, made), starts=made.initial)


def given_states(system: System) -> dict[str, float]:
    """The states that the plant's file gives for its operating point, by name; zero where it gives none."""
    from ulna.system import given_point

    return given_point(system).numbers


def make_design(system: System, options: DesignOptions) -> Controller:
    """The design that the options ask for.

    Raises:
        UlnaError: if nothing is asked for or two options exclude each other, or the plant lacks the form needed.
    """
    from ulna.base import DesignError, NoFormError
    from ulna.design import SetPoint, Track, controller_for

    _require_consistent(options)
    if not options.law and not options.observer:
        what = "Add --controller-poles or --lqr, --observer-poles or --kalman, or one of each."
        raise DesignError("a design", "neither a law nor an observer is asked for.", what)
    try:
        return controller_for(
            system,
            law=_gains(options) if options.law else None,
            observer=_observer(options) if options.observer else None,
            outputs_only=options.input_output,
            reference=SetPoint() if options.set_point else Track() if options.track else None,
            integral=options.integral,
        )
    except NoFormError as missing:
        raise _in_options(missing, system) from None


def _require_consistent(options: DesignOptions) -> None:
    from ulna.base import DesignError

    pairs = (
        ("--controller-poles", "--lqr", options.controller_poles and options.lqr),
        ("--set-point", "--track", options.set_point and options.track),
        ("--observer-poles", "--kalman", options.observer_poles and options.kalman),
    )
    for one, other, clash in pairs:
        if clash:
            raise DesignError(f"{one} and {other}", "they exclude each other.", "Leave one of them out.")
    if options.high_gain is not None and not options.observer_poles:
        raise DesignError("--high-gain", "it needs the poles of the error.", "Add --observer-poles.")
    wants = [name for name in ("integral", "set_point", "track", "input_output") if getattr(options, name)]
    if wants and not options.law:
        asked = f"--{wants[0].replace('_', '-')}"
        raise DesignError(asked, "there is no law to add it to.", "Add --controller-poles or --lqr.")


def _gains(options: DesignOptions) -> AbstractGainRule:
    from ulna.design import LinearQuadratic, Poles

    if options.controller_poles:
        return Poles(*pole_list(options.controller_poles))
    states, weight = _halves(options.lqr, "--lqr", "'100,1,1:1'", missing="1")
    if len(weight) != 1:
        from ulna.base import DesignError

        raise DesignError(f"--lqr '{options.lqr}'", f"{len(weight)} weights of the new input.", "Give one after ':'.")
    return LinearQuadratic(state_weights=states, input_weight=weight[0])


def _observer(options: DesignOptions) -> Any:
    from ulna.design import HighGain, KalmanNoise, Poles

    if options.kalman:
        process, measurement = _halves(options.kalman, "--kalman", "'1,1,1:0.01'")
        return KalmanNoise(process=process, measurement=measurement)
    gains = Poles(*pole_list(options.observer_poles))
    return gains if options.high_gain is None else HighGain(gains=gains, time_scale=options.high_gain)


def _in_options(missing: NoFormError, system: System) -> NoFormError:
    """The refusal with what the command line offers instead of the form."""
    weights = f"{','.join(['1'] * len(system.states))}:{','.join(['0.01'] * len(system.outputs))}"
    offers = {
        "outputs_only": "Add --input-output to linearise the outputs only.",
        "KalmanNoise": f"Add --high-gain 0.1, or replace --observer-poles by --kalman {weights}.",
    }
    hint = next((text for word, text in offers.items() if word in missing.hint), missing.hint)
    return type(missing)(missing.asked, missing.found, hint, value=missing.value)


def _halves(text: str, option: str, example: str, *, missing: str = "") -> tuple[list[float], list[float]]:
    """The numbers before and behind the colon."""
    from ulna.base import DesignError

    first, colon, second = text.partition(":")
    if not first or (colon and not second) or (not colon and not missing):
        raise DesignError(f"{option} '{text}'", "two lists divided by ':' are due.", f"Write {example}.")
    return number_list(first, option), number_list(second or missing, option)
