"""The table of options: each written once, in the group of those that belong together."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from ulna.cli.completion import complete_plant

_law = partial(typer.Option, rich_help_panel="Law")
_observer = partial(typer.Option, rich_help_panel="Observer")
_run = partial(typer.Option, rich_help_panel="Run")
_limits = partial(typer.Option, rich_help_panel="Limits")
_processor = partial(typer.Option, rich_help_panel="Processor, sensors and drive (with --period)")

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]

Substitute = Annotated[
    bool,
    typer.Option(
        "--substitute",
        help="Take functions of the inputs as the inputs, n**2 in place of n, where the plant is not affine in them.",
    ),
]

Exact = Annotated[bool, typer.Option("--exact", help="Show fractions in place of decimals of six digits.")]

Seconds = Annotated[
    float | None,
    typer.Option(
        "--seconds",
        min=1.0,
        help="CPU time for formulas in total, s; what is not found by then is undecided. 30 times ULNA_PATIENCE.",
        show_default=False,
    ),
]

Unknown = Annotated[
    str,
    typer.Option(
        "--identify",
        metavar="NAMES",
        help="Also answer whether these parameters can be known from records of the measured outputs: 'm2, Ra'.",
        show_default=False,
    ),
]


class Discretisation(StrEnum):
    """How the controller's differential equations are stepped."""

    euler = "euler"
    runge_kutta = "runge-kutta"
    exact = "exact"


class Arithmetic(StrEnum):
    """How the processor computes."""

    fused = "fused"
    plain = "plain"


class Engine(StrEnum):
    """What integrates a continuous loop."""

    taylor = "taylor"
    implicit = "implicit"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantOptions:
    """Which plant, with which values."""

    name: Annotated[
        str,
        typer.Argument(
            metavar="PLANT",
            help="A plant file (TOML or JSON) or a catalogue name.",
            autocompletion=complete_plant,
        ),
    ]
    values: Annotated[
        list[str],
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Another value of a parameter, SI or with its unit: 'm2=4', 'm2=4 kg'. Repeatable. A controller that "
            "is designed for a run keeps the file's value.",
        ),
    ] = field(default_factory=list)

    controlled: Annotated[
        list[str],
        typer.Option(
            "--output",
            metavar="NAME",
            help="An output to control, where the file does not say which: 'y1', 'y1,y2'. Repeatable.",
        ),
    ] = field(default_factory=list)
    measured: Annotated[
        list[str],
        typer.Option("--measured", metavar="NAME", help="An output that an observer reads. Repeatable."),
    ] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignOptions:
    """Which law, which observer; empty where nothing is asked."""

    controller_poles: Annotated[str, _law("--controller-poles", help="Poles of the law: '-2+3.46j,-2-3.46j,-8'.")] = ""
    lqr: Annotated[
        str,
        _law(
            "--lqr",
            metavar="Q1,…:R1,…",
            help="Instead of poles: linear-quadratic weights, one per coordinate of each chain, of a local law per "
            "state (or one for all), and of the inputs: '100,1,1:1'.",
        ),
    ] = ""
    best: Annotated[
        bool,
        _law(
            "--best",
            help="Design the best law and observer that the plant has, with poles at its own speed; what "
            "`ulna design` does where nothing is asked for.",
        ),
    ] = False
    input_output: Annotated[
        bool,
        _law("--input-output", help="Linearise the given outputs only, not the whole state."),
    ] = False
    local: Annotated[
        bool,
        _law("--local", help="Design law and observer on the linearisation at the operating point."),
    ] = False
    extend: Annotated[
        bool,
        _law(
            "--extend",
            help="Put integrators before inputs until the outputs can be decoupled (dynamic extension): for flat "
            "plants such as cars. They start at the operating point, or where --initial names them.",
        ),
    ] = False
    set_point: Annotated[
        bool,
        _law("--set-point", help="Let the law take a set point, input '<output>_ref'."),
    ] = False
    track: Annotated[bool, _law("--track", help="Let the law take a reference with its derivatives.")] = False
    integral: Annotated[
        bool,
        _law("--integral", help="Add integral action; it needs one more pole per chain."),
    ] = False
    schedule: Annotated[
        str,
        _law(
            "--schedule",
            metavar="NAME=LOW:HIGH:KNOTS",
            help="Local laws at this many equilibria along an output, gains interpolated between them: "
            "'y=0.002:0.02:10'. The law takes a slow set point.",
        ),
    ] = ""
    swing_up: Annotated[
        str,
        _law(
            "--swing-up",
            metavar="ENERGY",
            help="Pump this energy to its value at the operating point, then switch to the local law of the poles "
            "or weights: 'om**2/8 + 4.9*(cos(th) - 1)'. Needs --catch.",
        ),
    ] = ""
    catch: Annotated[
        str, _law("--catch", metavar="NAME=SIZE", help="How near the point the local law takes over: 'th=0.4'.")
    ] = ""
    push: Annotated[float, _law("--push", min=0.0, help="Largest push of a swing-up, SI.")] = 5.0
    push_gain: Annotated[float, _law("--push-gain", min=0.0, help="Gain of a swing-up: push per energy, SI.")] = 5.0
    pivot: Annotated[
        str, _law("--pivot", metavar="OUTPUT", help="Output whose acceleration pumps, 'y' of a cart; else the input.")
    ] = ""
    hold: Annotated[str, _law("--hold", help="Poles that bring the pivot back: '-0.5,-0.5'.")] = ""
    observer_poles: Annotated[
        str, _observer("--observer-poles", help="Poles of the error of the estimates: '-9,-10,-11'.")
    ] = ""
    high_gain: Annotated[
        float | None,
        _observer(
            "--high-gain",
            metavar="EPS",
            help="A high-gain observer with the poles divided by EPS, for a plant without observer form.",
        ),
    ] = None
    kalman: Annotated[
        str,
        _observer(
            "--kalman",
            metavar="Q1,…:R1,…",
            help="An extended Kalman filter: noise densities of the states and of the outputs: '1,1,1:0.01'.",
        ),
    ] = ""

    @property
    def law(self) -> bool:
        """True if a law is asked for."""
        return bool(self.controller_poles or self.lqr or self.best)

    @property
    def observer(self) -> bool:
        """True if an observer is asked for."""
        return bool(self.observer_poles or self.kalman)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """Where a run starts, what drives it, how long it lasts."""

    controller: Annotated[
        Path | None,
        _run(
            "--controller",
            metavar="FILE",
            help="A controller in a file, instead of a design: from `ulna design --out`, or your own: a file like a "
            "plant's, whose outputs include inputs of the plant.",
        ),
    ] = None
    initial: Annotated[
        str,
        _run(
            "--initial",
            help="Initial states of the plant in order, '1,0,0', or by name, 'theta=30deg, omega=0', estimates and "
            "states of the controller too; SI or with a unit. Left out: at rest at the operating point, else zero.",
        ),
    ] = ""
    observer_initial: Annotated[
        str,
        _run(
            "--observer-initial",
            help="Initial estimates in the order of the plant's states, '0.1,0', or by the state's name. Left out: "
            "where the plant starts.",
        ),
    ] = ""
    horizon: Annotated[float, _run("--horizon", help="Length of a run, s.")] = 5.0
    engine: Annotated[
        Engine | None,
        _run(
            "--engine", help="Integrator of a continuous loop: Taylor series, or an implicit method for stiff plants."
        ),
    ] = None
    reference: Annotated[
        list[str],
        _run(
            "--reference",
            metavar="NAME=FORMULA",
            help="Reference of an output, a number or a formula of the time t: 'y=0.5*sin(t)'. It is the input 'y_ref' "
            "of the controller, and 'y_ref_d1' and so on its derivatives. Repeatable.",
        ),
    ] = field(default_factory=list)
    inputs: Annotated[
        list[str],
        _run(
            "--input",
            metavar="NAME=FORMULA",
            help="An input that no controller drives, a number or a formula of the time t: 'u=1.5', 'u=0.5*sin(t)'. "
            "Repeatable.",
        ),
    ] = field(default_factory=list)
    seed: Annotated[
        int,
        _run("--seed", min=0, help="Seed of all that is random: noise, clock, varied quantities."),
    ] = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class HardwareOptions:
    """Limits, processor, sensors and drive; zero or empty where nothing is said."""

    limit: Annotated[
        list[str],
        _limits(
            "--limit", metavar="NAME=LOW:HIGH", help="Limit an input: 'u=-24:24', 'u=24'; '24' for all. Repeatable."
        ),
    ] = field(default_factory=list)
    stop: Annotated[
        list[str],
        _limits(
            "--stop",
            metavar="NAME=LOW:HIGH",
            help="End stop of a position, SI: 'theta=-pi/2:pi/2', with a rebound 'theta=0:pi/2:0.5'. Repeatable.",
        ),
    ] = field(default_factory=list)
    period: Annotated[
        float | None,
        _processor("--period", help="Run the controller sampled, with this period in s."),
    ] = None
    delay: Annotated[float, _processor("--delay", help="Time from a sample to the new input, s.")] = 0.0
    discretise: Annotated[
        Discretisation,
        _processor("--discretise", help="How the controller is discretised; 'exact' needs --observer-poles."),
    ] = Discretisation.runge_kutta
    arithmetic: Annotated[
        Arithmetic | None,
        _processor(
            "--arithmetic",
            help="With fused multiply-add, or plain: the same bits in every language. Left out: fused, "
            "for an export plain.",
        ),
    ] = None
    encoder: Annotated[
        int | None,
        _processor("--encoder", metavar="BITS", help="Encoder with 2^BITS steps a turn.", show_default=False),
    ] = None
    resolution: Annotated[float, _processor("--resolution", help="Step of the measured outputs, SI.")] = 0.0
    noise: Annotated[
        float,
        _processor("--noise", help="Standard deviation of each measurement, SI."),
    ] = 0.0
    slew: Annotated[float, _processor("--slew", help="Largest rate of the inputs, SI per second.")] = 0.0
    anti_windup: Annotated[
        str,
        _processor(
            "--anti-windup",
            metavar="STATES",
            help="Integrators of the controller that stop while the input is limited, 'e1_int', or 'none'; left out, "
            "those of --integral.",
        ),
    ] = ""
    jitter: Annotated[float, _processor("--jitter", help="Samples are late by up to this time, s.")] = 0.0
    missed: Annotated[float, _processor("--missed", help="Probability of a missed sample.")] = 0.0
    reference_range: Annotated[
        list[str],
        _processor(
            "--reference-range",
            metavar="NAME=LOW:HIGH",
            help="A reference outside this range is a fault; the nearest end is used: 'y_ref=-1:1'. Repeatable.",
        ),
    ] = field(default_factory=list)
    lateness: Annotated[
        float | None, _processor("--lateness", help="A call later than this is a fault, s.", show_default=False)
    ] = None
    missed_most: Annotated[
        int | None, _processor("--missed-most", help="More missed samples in a row are a fault.", show_default=False)
    ] = None
    innovation: Annotated[
        str,
        _processor(
            "--innovation",
            metavar="SIZE:SAMPLES",
            help="Larger innovations at this many samples in a row are a fault, for good or until this many in a "
            "row are smaller: '0.2:10', '0.2:10:50'.",
        ),
    ] = ""
    safe_output: Annotated[
        float | None,
        _processor(
            "--safe-output", help="Command while a fault lasts, SI; left out: the last one.", show_default=False
        ),
    ] = None
    pwm: Annotated[
        str,
        _processor(
            "--pwm",
            metavar="HZ:V",
            help="PWM with this carrier and supply: '20e3:24' for its mean, '20e3:24:switched' for every pulse.",
        ),
    ] = ""

    @property
    def sampled(self) -> bool:
        """True if the controller runs on a processor."""
        return self.period is not None
