"""A system made ready for integration: kernel, what is constant, compiled flow; remembered between calls."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from threading import RLock

import numpy as np
import sympy as sp

from ulna.base import SimulationError
from ulna.program import (
    Edges,
    Kernel,
    branches_of,
    edges_of,
    hoist,
    surfaces_of,
    to_numpy,
    to_python,
    with_branches,
    with_modes,
)
from ulna.sim.cache import IdentityCache
from ulna.sim.continuous.course import Scheme
from ulna.sim.continuous.flow import Flow
from ulna.sim.continuous.implicit import Implicit
from ulna.sim.continuous.implicit_flow import ImplicitFlow
from ulna.sim.continuous.layout import Layout
from ulna.sim.continuous.rules import Limits, Reported, Rules, rules
from ulna.sim.continuous.runge_kutta_flow import RungeKuttaFlow, taylor_available
from ulna.sim.continuous.switched_flow import SwitchedFlow
from ulna.sim.continuous.switching import Switching
from ulna.sim.continuous.taylor import Taylor
from ulna.sim.continuous.watchers import scheme_of
from ulna.sim.inputs import TIME, Constant, Formula, Held, Input, Interpolated
from ulna.sim.parameters import default_values
from ulna.symbolic.compiling import kernel
from ulna.symbolic.solving import without_holes
from ulna.system import System

Engine = Taylor | Implicit
"""What integrates continuous runs."""

FLOWS_KEPT = 64
"""Compiled integrators kept in a process."""


class Drive(Enum):
    """How an input enters the compiled loop."""

    CONSTANT = "keeps its value on a stretch"
    RAMP = "a + b t on a stretch"


Shape = tuple[Drive | sp.Expr, ...]
"""For each input of a system how it enters; a formula of time is compiled in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Commands:
    """Limited inputs by name; evaluate(states, inputs, parameters) → command and limited command of each."""

    names: tuple[str, ...]
    evaluate: Callable[..., tuple[np.ndarray, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """A system with a compiled flow.

    Attributes:
        flow: the integrator. before: (parameters, constant inputs) → the constants that the flow needs.
        values: default SI value of each parameter, None where it has none.
        ready: the flow's constants for the default parameters when no input varies between runs, else None.
        rules: what the run obeys and reports, None where that is nothing.
        edges: where the right-hand side stops being defined. branches: what happens at the edge of each root that the
            flow watches. surfaces: at which it jumps, by name.
        shown: the system with its limits written out. commands: of what is limited, None where nothing is.
    """

    system: System
    flow: Flow | Switching
    rules: Rules | None
    edges: Edges
    branches: tuple[str, ...]
    surfaces: tuple[str, ...]
    shown: System
    commands: Commands | None
    before: Callable[..., tuple[float, ...]]
    before_inputs: tuple[str, ...]
    values: dict[str, float | None]
    ready: list[float] | None
    parameters: dict[str, float]


def shape_of(inputs: Mapping[str, Input], system: System) -> Shape:
    """How each input of the system enters the loop; an input that is not given is the constant 0."""
    return tuple(_entry(inputs.get(signal.name)) for signal in system.inputs)


def _entry(given: Input | None) -> Drive | sp.Expr:
    if isinstance(given, Formula):
        return given.expression
    return Drive.RAMP if isinstance(given, Interpolated) else Drive.CONSTANT


def prepared(
    system: System, shape: Shape, settings: Engine, limits: Limits, reported: tuple[Reported, ...]
) -> Prepared:
    """The system made ready; remembered by the identity of the system, compiled flows by the equality of kernels."""
    key = (shape, settings, limits, reported)
    return _PREPARED.get(system, key, lambda: _prepare(system, shape, settings, limits, reported))


_PREPARED = IdentityCache(FLOWS_KEPT)
_FLOWS: OrderedDict[tuple[Kernel | Scheme, Layout, Engine], Flow | Switching] = OrderedDict()
_LOCK = RLock()


def _prepare(
    system: System, shape: Shape, settings: Engine, limits: Limits, reported: tuple[Reported, ...]
) -> Prepared:
    wanted = rules(system, limits, reported) if limits or reported else None
    whole, layout, fixed = _whole(system, shape, wanted)
    split = hoist(whole, fixed)
    layout = replace(layout, constants=split.before.outputs)
    before = to_python(split.before)
    edges = edges_of(whole, fixed)
    watched = {branch.place for branch in branches_of(whole, fixed)}
    values = default_values(system)
    known = {name: value for name, value in values.items() if value is not None}
    ready = None
    if not system.inputs and len(known) == len(values):
        ready = constants(before, split.before.inputs, known, {}, system.name)
    return Prepared(
        system=system,
        flow=_flow(split.main, layout, wanted, settings),
        rules=wanted,
        edges=edges,
        branches=tuple(n for n, k in zip(edges.names, edges.places, strict=True) if k in watched),
        surfaces=surfaces_of(whole, fixed),
        shown=system if wanted is None else wanted.shown,
        commands=_commands(system, wanted) if wanted is not None and wanted.commands else None,
        before=before,
        before_inputs=split.before.inputs,
        values=values,
        ready=ready,
        parameters=known,
    )


def _whole(system: System, shape: Shape, wanted: Rules | None) -> tuple[Kernel, Layout, tuple[str, ...]]:
    """The kernel of the rates and of what is watched, where its inputs come from, and which of them are constant."""
    formulas = {s.symbol: e for s, e in zip(system.inputs, shape, strict=True) if isinstance(e, sp.Expr)}
    constant = [s.symbol for s, e in zip(system.inputs, shape, strict=True) if e is Drive.CONSTANT]
    ramps = [s.symbol for s, e in zip(system.inputs, shape, strict=True) if e is Drive.RAMP]
    rates = system.inline(system.rates) if wanted is None else wanted.rates
    watched = () if wanted is None else wanted.watched
    if formulas:
        _check_formulas(system, formulas)
        rates, watched = (tuple(e.xreplace(formulas) for e in each) for each in (rates, watched))
    timed = bool(formulas) or any(e.has(TIME) for e in watched)
    if timed:
        _check_time(system)
    clock = [TIME] if timed else []
    modes = [] if wanted is None else [limit.mode for limit in wanted.limits]
    held = [*system.parameter_symbols, *constant]
    moving = [*system.state_symbols, *ramps, *clock]
    rates = tuple(without_holes(rate, moving, system.values) for rate in rates)
    names = {f"{signal.name}'": rate for signal, rate in zip(system.states, rates, strict=True)}
    names |= {f"watched {k}": e for k, e in enumerate(watched)}
    whole = kernel(system.name, [*system.state_symbols, *ramps, *clock, *modes, *held], names, held=held)
    layout = Layout(
        states=tuple(signal.name for signal in system.states),
        ramps=tuple(s.name for s in ramps),
        time=TIME.name if timed else None,
        saturated=tuple(s.name for s in modes),
    )
    return whole, layout, tuple(s.name for s in held)


def _commands(system: System, wanted: Rules) -> Commands:
    symbols = [*system.state_symbols, *system.input_symbols, *system.parameter_symbols]
    named = {f"{k}": e for k, e in enumerate(each for pair in wanted.commands.values() for each in pair)}
    return Commands(
        names=tuple(wanted.commands),
        evaluate=to_numpy(kernel(f"commands of {system.name}", symbols, named)),
    )


def _check_time(system: System) -> None:
    if TIME in {*system.state_symbols, *system.input_symbols, *system.parameter_symbols}:
        raise SimulationError(
            f"a formula of time for '{system.name}'", f"the system calls something else '{TIME}'.", "Rename it."
        )


def _check_formulas(system: System, formulas: Mapping[sp.Symbol, sp.Expr]) -> None:
    allowed = {TIME, *system.parameter_symbols}
    for symbol, expression in formulas.items():
        unknown = sorted(str(each) for each in expression.free_symbols - allowed)
        if unknown:
            raise SimulationError(
                f"input '{symbol}' of '{system.name}'",
                f"its formula uses {', '.join(unknown)}.",
                f"It may use the time t (ulna.sim.TIME) and parameters: {', '.join(map(str, allowed - {TIME}))}.",
            )


def _flow(main: Kernel, layout: Layout, wanted: Rules | None, settings: Engine) -> Flow | Switching:
    moded = with_modes(main)
    branched = with_branches(moded.kernel, layout.constants)
    scheme: Kernel | Scheme = main
    if wanted is not None or moded.guards or branched.branches:
        scheme = scheme_of(branched, moded.guards, layout, wanted)
    key = (scheme, layout, settings)
    with _LOCK:
        flow = _FLOWS.get(key)
        if flow is None:
            if isinstance(settings, Implicit):
                flow = ImplicitFlow(scheme_of(branched, moded.guards, layout, wanted), settings)
            elif not taylor_available():
                flow = RungeKuttaFlow(scheme_of(branched, moded.guards, layout, wanted), settings)
            elif isinstance(scheme, Scheme):
                flow = SwitchedFlow(scheme, settings)
            else:
                flow = Flow(main, layout, settings)
            _FLOWS[key] = flow
        _FLOWS.move_to_end(key)
        while len(_FLOWS) > FLOWS_KEPT:
            _FLOWS.popitem(last=False)
        return flow


def constants(
    before: Callable[..., tuple[float, ...]],
    names: tuple[str, ...],
    parameters: Mapping[str, float],
    inputs: Mapping[str, float],
    system: str,
) -> list[float]:
    """What the flow needs to know before a stretch.

    Raises:
        SimulationError: parameter values that make a constant infinite or NaN.
    """
    known = {**parameters, **inputs}
    results = list(before(*(known[name] for name in names)))
    if not all(map(math.isfinite, results)):
        zeros = [name for name, value in parameters.items() if value == 0.0]
        raise SimulationError(
            f"simulation of '{system}'",
            "its right-hand side is not finite for these parameters"
            + (f" (zero: {', '.join(zeros)})." if zeros else "."),
            "Change the parameters that stand in a denominator, a root or a logarithm.",
        )
    return results


def stretch_values(
    ready: Prepared, parameters: Mapping[str, float], inputs: Mapping[str, Input], start: float, end: float
) -> list[float]:
    """The flow's run-time values between two neighbouring breakpoints of the inputs: constants, (a, b) per ramp."""
    middle = 0.5 * (start + end)
    held: dict[str, float] = {}
    pairs: list[float] = []
    for signal in ready.system.inputs:
        match inputs.get(signal.name):
            case None:
                held[signal.name] = 0.0
            case Constant(value=value):
                held[signal.name] = value
            case Held(times=times, values=values):
                held[signal.name] = float(values[np.searchsorted(times, middle, side="right") - 1])
            case Interpolated(times=times, values=values):
                k = int(np.searchsorted(times, middle, side="right")) - 1
                slope = float((values[k + 1] - values[k]) / (times[k + 1] - times[k]))
                pairs += [float(values[k]) - slope * float(times[k]), slope]
            case Formula():
                pass
    return constants(ready.before, ready.before_inputs, parameters, held, ready.system.name) + pairs
