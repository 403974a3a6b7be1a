"""The run that the options ask for: a loop, where it starts, what drives it."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import TYPE_CHECKING

from ulna.base import PlantError, SimulationError
from ulna.cli.asked_controller import designed, require_consistent
from ulna.cli.asked_hardware import hardware_of, require_period
from ulna.cli.asked_plant import parameter_values, require_in_range
from ulna.cli.options import DesignOptions, Discretisation, Engine, HardwareOptions, PlantOptions, RunOptions
from ulna.cli.typed_values import formula_of_time, known_name, named_values, quantity, typed_list, unit_in

if TYPE_CHECKING:
    import sympy as sp

    from ulna.design import Controller, ExtendedLaw
    from ulna.loop import Hardware, Loop
    from ulna.sim import Implicit, Taylor
    from ulna.system import Signal, System


LONGEST = 100
"""Letters of the reason why there is no controller."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What is run.

    Attributes:
        loop: plant, controller and hardware.
        initial: SI values by name of the plant's states and of the controller's.
        inputs: what drives references and disturbances: a number or a formula of time, by name.
        parameters: SI values of the plant's parameters other than those of its file.
        engine: what integrates a continuous loop, if that is said.
    """

    loop: Loop
    initial: Mapping[str, float]
    inputs: Mapping[str, float | sp.Expr]
    parameters: Mapping[str, float]
    engine: Taylor | Implicit | None


def run_of(
    system: System,
    plant: PlantOptions,
    run: RunOptions,
    design: DesignOptions,
    hardware: HardwareOptions,
    *,
    varied: Collection[str] | None = None,
    open_references: bool = False,
) -> Run:
    """The run that the options ask for.

    Args:
        system: the plant.
        plant, run, design, hardware: the options.
        varied: of a sweep, names that get their values from elsewhere.
        open_references: whether references may stay without a value.

    Raises:
        UlnaError: options that exclude each other, texts that cannot be read, names that are unknown, a plant that
            lacks the form needed.
    """
    from ulna.loop import Loop

    if not 0 < run.horizon < math.inf:
        raise SimulationError(f"--horizon {run.horizon:g}", "expected a positive time in s.", "Give --horizon 5, say.")
    read = _read(run, design, hardware)
    if read is not None and read.period is not None and not hardware.sampled:
        hardware = replace(hardware, period=float(read.period))
    require_period(hardware)
    values = parameter_values(system, plant.values, also=() if read is None else read.parameters)
    own = {name: values.pop(name) for name in list(values) if name not in {p.name for p in system.parameters}}
    unknown = {p.name: values[p.name] for p in system.parameters if p.value is None and p.name in values}
    controller = _in_numbers(read.with_parameters(own)) if read is not None else None
    if controller is None and _wants_design(design, hardware):
        exact = hardware.discretise is Discretisation.exact
        nominal = system.with_parameters(unknown).with_values()
        _require_values(nominal, varied or ())
        controller = designed(nominal, design, held_exactly=exact)
    fixed = {p.name: value for p in system.parameters if (value := p.si_value) is not None and p.name not in values}
    # What is set stays a parameter, so that a compiled loop serves every value of it.
    body = system.with_values(fixed) if varied is None else system
    _require_values(body, {*values, *(varied or ())})
    loop = Loop(plant=body, controller=controller, hardware=_hardware(body, controller, hardware))
    return Run(
        loop=loop,
        initial=_initial(loop, controller, run, varied or ()),
        inputs=_inputs(loop, run, [s.name for s in loop.references] if open_references else varied or ()),
        parameters={name: float(value) for name, value in values.items()},
        engine=_engine(run),
    )


def best_run_of(
    system: System,
    plant: PlantOptions,
    run: RunOptions,
    design: DesignOptions,
    hardware: HardwareOptions,
    *,
    alone: bool,
) -> Run:
    """The run that is asked for; where nothing is said of a controller the best there is, else the plant alone.

    Parameters stay in the plant, and references may stay open: a page has a slider for each.

    Raises:
        UlnaError: as `run_of`; `alone` with a controller.
    """
    import typer

    from ulna.base import DesignError, NoFormError

    said = bool(design.law or design.observer or run.controller)
    if alone and said:
        raise SimulationError("--alone with a controller", "they exclude each other.", "Leave one of them out.")
    if said or alone:
        return run_of(system, plant, run, design, hardware, varied=(), open_references=True)
    best = replace(design, best=True, set_point=not design.track)
    try:
        return run_of(system, plant, run, best, hardware, varied=(), open_references=True)
    except (NoFormError, DesignError) as error:
        if hardware.sampled:
            raise
        told = shorten(str(error), LONGEST, placeholder=" …")
        typer.echo(f"no controller: {told}\n`ulna design {plant.name}` shows the whole message.", err=True)
        return run_of(system, plant, run, design, hardware, varied=(), open_references=True)


def _engine(run: RunOptions) -> Taylor | Implicit | None:
    from ulna.sim import Implicit, Taylor

    if run.engine is None:
        return None
    return Implicit() if run.engine is Engine.implicit else Taylor()


def _read(run: RunOptions, design: DesignOptions, hardware: HardwareOptions) -> System | None:
    """The controller in a file, if one is given."""
    from ulna.system import read_system

    require_consistent(design)
    if run.controller is None:
        return None
    if design.law or design.observer:
        found = "both a file and a design are asked for."
        raise SimulationError("--controller", found, "Leave out either it or the poles and weights.")
    if hardware.discretise is Discretisation.exact:
        found = "no part of a controller in a file is known to be linear."
        raise SimulationError("--discretise exact", found, "Give --discretise runge-kutta.")
    try:
        return read_system(run.controller)
    except PlantError as error:
        asked = error.asked.replace("plant file", "--controller", 1)
        raise PlantError(asked, error.found, error.hint) from None


def _wants_design(design: DesignOptions, hardware: HardwareOptions) -> bool:
    if design.law or design.observer:
        return True
    if hardware.sampled:
        found = "there is no controller to be sampled."
        raise SimulationError("--period", found, "Give --controller-poles, --lqr, --observer-poles or --controller.")
    return False


def _in_numbers(controller: System) -> System:
    """The controller with its values put in, so that a plant's parameter of the same name is not its own.

    Its definitions stay: by them a loop knows that the observer inside reads the command, and lets it see the limited.
    """
    controller.with_values()  # raises where a value divides by zero
    numbers = controller.values
    made = replace(
        controller,
        rates=tuple(e.xreplace(numbers) for e in controller.rates),
        readouts=tuple(e.xreplace(numbers) for e in controller.readouts),
        definitions=tuple(replace(d, expression=d.expression.xreplace(numbers)) for d in controller.definitions),
        parameters=tuple(p for p in controller.parameters if p.value is None),
    )
    _require_values(made, ())
    return made


def _require_values(system: System, given: Collection[str]) -> None:
    missing = [p.name for p in system.parameters if p.value is None and p.name not in given]
    if missing:
        found = f"parameters without a value: {', '.join(missing)}."
        raise PlantError(f"'{system.name}'", found, f"Add --set {missing[0]}=1, say, or give the value in its file.")


def _hardware(
    plant: System, controller: Controller | ExtendedLaw | System | None, asked: HardwareOptions
) -> Hardware | None:
    from ulna.system import as_system

    law = getattr(controller, "law", None)
    whole = None if controller is None else as_system(controller)
    commanded = {s.name for s in (plant.inputs if whole is None else whole.outputs)}
    return hardware_of(
        plant,
        asked,
        driven=[s.name for s in plant.inputs if s.name in commanded],
        memory=[] if whole is None else [s.name for s in whole.states],
        integrals=[] if law is None else [s.name for s in law.system.states],
    )


def _initial(
    loop: Loop, controller: Controller | ExtendedLaw | System | None, run: RunOptions, varied: Collection[str]
) -> dict[str, float]:
    """Where the run starts: what is typed, else at rest at the operating point, else as the files say, else zero."""
    from ulna.system import System, given_point, starting_point

    signals = {s.name: s for s in (*_memory(loop), *loop.plant.states)}
    plant, memory = starting_point(loop.plant).numbers, {}
    if isinstance(controller, System):
        memory = given_point(controller).numbers
    elif controller is not None:
        memory = {name: value for name, value in controller.initial.items() if name in signals}
    memory |= {f"{name}_hat": value for name, value in _estimates(loop, run.observer_initial, signals).items()}
    for name, value, asked in _typed_states(run.initial, "--initial", list(plant)):
        known_name(name, list(signals), asked, "state")
        number = float(quantity(value, asked, unit=unit_in(loop.plant, signals[name])))
        (plant if name in plant else memory)[name] = number
        if name in plant:
            require_in_range(signals[name], number, asked)
    for name in (each for each in plant if each not in varied):
        require_in_range(signals[name], plant[name], f"no --initial {name}=…")
    if loop.sampled:
        return memory | plant
    # The states of the loop are those of the plant, then of the controller; a name that both have is prefixed there.
    numbers = (*plant.values(), *(memory.get(s.name, 0.0) for s in _memory(loop)))
    return dict(zip((s.name for s in loop.system.states), numbers, strict=True))


def _estimates(loop: Loop, text: str, known: Collection[str]) -> dict[str, float]:
    """Where the estimates of states start, by the state's name."""
    states = {s.name: s for s in loop.plant.states}
    found = {}
    for given, value, asked in _typed_states(text, "--observer-initial", list(states)):
        name = known_name(given.removesuffix("_hat"), list(states), asked, "state")
        if f"{name}_hat" not in known:
            what = "Add --observer-poles or --kalman, or leave it out."
            raise SimulationError(asked, f"nothing in the loop estimates {name}.", what)
        found[name] = float(quantity(value, asked, unit=unit_in(loop.plant, states[name])))
    return found


def _typed_states(text: str, option: str, names: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """(name, value, what was asked) of states by name, `theta=30deg, omega=0`, or in their order."""
    if "=" in text:
        yield from named_values([text], option)
        return
    parts = typed_list(text) if text else []
    if text and len(parts) != len(names):
        found = f"{len(parts)} numbers, {len(names)} states ({', '.join(names)})."
        raise SimulationError(f"{option} '{text}'", found, f"Give one for each, or by name: '{names[0]}=1'.")
    for name, part in zip(names, parts, strict=False):
        yield name, part, f"{option} '{text}'"


def _memory(loop: Loop) -> tuple[Signal, ...]:
    """What of the controller may start elsewhere than at zero."""
    if loop.parts is None:
        return ()
    if not loop.sampled:
        return loop.parts.system.states
    wiring = loop.wiring
    estimates = () if wiring.injected is None else wiring.injected.system.outputs
    return (*wiring.memory, *estimates, *wiring.driven)


def _inputs(loop: Loop, run: RunOptions, varied: Collection[str]) -> dict[str, float | sp.Expr]:
    references = {s.name: s for s in loop.references}
    free = {s.name: s for s in (*loop.disturbances, *loop.references)}
    found: dict[str, float | sp.Expr] = {}
    for name, text, asked in named_values(run.inputs, "--input"):
        known_name(name, list(free), asked, "input")
        found[name] = value = formula_of_time(text, asked, unit=unit_in(loop.plant, free[name]))
        if isinstance(value, float):
            require_in_range(free[name], value, asked)
    for name, text, asked in named_values(run.reference, "--reference"):
        known = [each.removesuffix("_ref") for each in references if not _DERIVATIVE.search(each)]
        if not known:
            raise SimulationError(asked, "the loop follows no reference.", "Add --set-point or --track to the design.")
        label = name if name in references else f"{known_name(name, known, asked, 'reference')}_ref"
        found |= _with_derivatives(label, references, text, asked, unit_in(loop.plant, references[label]))
    missing = [name for name in loop.required if name not in found and name not in varied]
    if missing:
        asked, name = f"the reference '{missing[0]}'", missing[0].partition("_ref")[0]
        found_text = "the controller reads it, and neither the plant nor an option gives it."
        raise SimulationError(asked, found_text, f'Add --reference "{name}=0.5", say.')
    return found


_DERIVATIVE = re.compile(r"_d\d+$")


def _with_derivatives(
    label: str, references: Collection[str], text: str, asked: str, unit: str | None
) -> dict[str, float | sp.Expr]:
    """The reference, and what of its derivatives the controller reads."""
    import sympy as sp

    from ulna.sim import TIME

    value = formula_of_time(text, asked, unit=unit)
    found, order = {label: value}, 1
    while (name := f"{label}_d{order}") in references:
        slope = sp.diff(value, TIME) if isinstance(value, sp.Expr) else sp.Integer(0)
        if slope.has(sp.DiracDelta, sp.Derivative, sp.Subs):
            given = f"derivative {order} of it does not exist where it jumps or has a corner."
            raise SimulationError(asked, given, "Give a smooth formula, or --set-point instead of --track.")
        value = found[name] = slope if slope.free_symbols else float(slope)
        order += 1
    return found
