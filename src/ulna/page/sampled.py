"""A loop with a processor as a program of the page: what `simulate` does at a sample, by the same kernels."""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from ulna.loop import (
    ROUNDS,
    Amplifier,
    Fitted,
    Flow,
    Loop,
    Pwm,
    SafeOutput,
    Steps,
    applied,
    plant_kernels,
)
from ulna.page.program import Program
from ulna.program import HOISTED, Plain, Precision, in_arithmetic, restricted
from ulna.symbolic.compiling import kernel

SPARE = 2
"""Periods by which the delay may be made longer in the page than the loop has it."""
PACED = 32
"""Samples between two looks at how fast the plant moves, as in `simulate`."""
WITHIN = 0.25
"""Steps over the plant's shortest time constant, as in `FixedSteps`."""


def plain(loop: Loop) -> Loop:
    """The loop with a processor that rounds every operation by itself: JavaScript has no fused steps."""
    hardware = loop.hardware
    if hardware is None or not hardware.sampled or isinstance(hardware.arithmetic, Plain):
        return loop
    return replace(loop, hardware=replace(hardware, arithmetic=Plain(precision=hardware.arithmetic.precision)))


def retimed(loop: Loop) -> bool:
    """Whether the delay can be changed while it runs: not where steps or pulses have to fit it."""
    return not loop.plant.discrete and not any(isinstance(d, Pwm) and d.pulsed for d in loop.fit({}).drives)


def sampled_program(loop: Loop) -> Program:
    """The program of a loop with a processor in plain arithmetic.

    Slots are those of `Step` and `Flow`; besides `q<k>` parameters of the controller, `f<k>` rates of the plant at
    `g<k>`, `w<k>` estimates wanted at the start.
    """
    own = loop.fit({})
    precision = own.hardware.arithmetic.precision
    controller = _with_room(loop)
    found = controller.fit({})
    # The plant is nobody's processor: doubles.
    body = _in_doubles(controller)
    moving = body.flow_by(Steps(), ramps=False)
    made = Program()
    _add_flow(made, body.fit({}), moving)
    sense, command = controller.step.stages
    made.add("sense", sense, precision=precision)
    made.add("command", command, precision=precision)
    made.add("apply", applied(body.fit({})))
    _add_controller(made, found, precision)
    _add_field(made, body.fit({}))
    _tell(made, own, found, moving)
    return made


def _with_room(loop: Loop) -> Loop:
    """The loop with a delay line that is long enough for every delay that the page offers."""
    own = loop.fit({})
    if not retimed(loop):
        return loop
    delay = (own.whole_delay + SPARE + 0.5) * own.period
    return replace(loop, hardware=replace(own.hardware, delay=delay))


def _in_doubles(loop: Loop) -> Loop:
    hardware = loop.fit({}).hardware
    if hardware.arithmetic.precision is Precision.DOUBLE:
        return loop
    return replace(loop, hardware=replace(hardware, arithmetic=Plain()))


def _add_flow(made: Program, loop: Fitted, moving: Flow) -> None:
    parameters = {f"p{k}": f"plant_p{k}" for k in range(len(loop.wiring.plant.parameters))}
    hoisted = {name: f"plant_{name}" for name in moving.constants.outputs}
    made.row("x", len(loop.wiring.plant.states))
    for slot in parameters.values():
        made.slot(slot)
    made.add("constants", moving.constants, renamed=parameters | hoisted)
    made.add("shown", moving.outputs)
    made.add_motion("motion", moving.motion)
    made.add("pace", moving.pace)


def _add_controller(made: Program, loop: Fitted, precision: Precision) -> None:
    """Its coefficients as functions of its parameters, and its estimator's states for wanted estimates."""
    before = loop.written(loop.wiring.controller.before)
    made.add("coefficients", before, renamed={name: f"set_{name}" for name in before.outputs}, precision=precision)
    estimator = loop.wiring.injected
    if estimator is None:
        return
    shown = [sp.Symbol(s.name, real=True) for s in estimator.system.outputs]
    values = dict(zip(estimator.system.parameter_symbols, (v for _, v in loop.wiring.parameters), strict=False))
    wanted = {symbol: sp.Symbol(f"w{k}", real=True) for k, symbol in enumerate(shown)}
    starts = [e.xreplace(values).xreplace(wanted) for e in estimator.start]
    found = kernel("start", list(wanted.values()), {f"z{k}": e for k, e in enumerate(starts)})
    made.add("estimated", loop.written(found), precision=precision)


def _add_field(made: Program, loop: Fitted) -> None:
    """The plant's rates at a state `g` for the phase plane, present inputs held."""
    plant = plant_kernels(loop.wiring, {}).main
    rates = restricted(plant, [f"x'{k}" for k in range(len(loop.wiring.plant.states))])
    renamed = {name: f"plant_{name}" for name in plant.inputs if name.startswith(HOISTED)}
    renamed |= {f"x{k}": f"g{k}" for k in range(len(rates.outputs))} | {"t": "time"}
    renamed |= {f"u{k}": f"ub{k}" for k in range(len(loop.wiring.driven))}
    renamed |= {name: f"f{k}" for k, name in enumerate(rates.outputs)}
    made.add("field", in_arithmetic(rates, Plain()), renamed=renamed)


def _tell(made: Program, own: Fitted, found: Fitted, moving: Flow) -> None:
    """Numbers and counts; what the reader does around the kernels."""
    wiring, hardware = own.wiring, own.hardware
    driven, measured = len(wiring.driven), len(wiring.measured)
    numbers = {**moving.numbers, **found.numbers, "fraction": own.fraction if own.split else 0.0}
    for name, value in numbers.items():
        # Coefficients stand apart: those that the parameters give are put in their place when a parameter is changed.
        made.begin[name] = value
    for slot in (
        "time",
        "earlier",
        "next",
        "clock",
        "span",
        "begun",
        "missed",
        "elapsed",
        "fraction",
        "jitter",
        "missed_share",
    ):
        made.slot(slot)
    for stem, count in (("r", len(wiring.references)), ("d", len(wiring.disturbances)), ("z", len(wiring.memory))):
        made.row(stem, count)
    for stem in ("c", "believed", "ua", "ub", "early", "late"):
        made.row(stem, driven)
    for stem, count in (
        ("o", len(wiring.plant.outputs)),
        ("y", measured),
        ("yn", measured),
        ("e", len(wiring.estimates)),
    ):
        made.row(stem, count)
    made.row("noise", measured)
    rows = found.whole_delay + found.split
    for k in range(driven):
        made.row(f"h{k}_", rows + 1)
    guard = hardware.guard
    made.constants.update(
        {
            "kind": "sampled",
            "driven": driven,
            "measured": measured,
            "rows": rows,
            "retimed": rows > own.whole_delay + own.split,
            "delay": [own.whole_delay, own.fraction if own.split else 0],
            "noises": [k for k, noise in enumerate(own.noises) if noise is not None],
            "jittered": hardware.jitter is not None,
            "missing": hardware.missed is not None,
            "timed": hardware.told_elapsed,
            "safe": guard is not None and isinstance(guard.reaction, SafeOutput),
            "single": hardware.arithmetic.precision is Precision.SINGLE,
            "pulsed": any(isinstance(each, Pwm) and each.pulsed for each in own.drives),
            "driveless": all(each is None for each in own.drives),
            "measuring": [k for k, each in enumerate(own.drives) if isinstance(each, Amplifier) and each.measured],
            "stretch": moving.stretch,
            "rounds": 2 * ROUNDS,
            "paced": PACED,
            "within": WITHIN,
        }
    )
