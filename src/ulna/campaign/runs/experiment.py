"""`Experiment`: everything that decides the results of a campaign, as one value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import Enum
from typing import Any

import numpy as np
import sympy as sp

from ulna.campaign.errors import CampaignError
from ulna.campaign.plans import Plan, seeds
from ulna.campaign.runs.measures import Measures
from ulna.loop import Loop
from ulna.sim import Constant, FixedSteps, Implicit, Taylor, as_input
from ulna.system import STAY_INSIDE, System, declared_range, out_of_range

RESULT_COLUMNS = ("run", "outcome", "settled", "end_time")
"""Names that no varied quantity may have."""


class Role(Enum):
    """What a varied quantity is."""

    INITIAL = "initial state"
    PARAMETER = "parameter"
    INPUT = "constant input"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """A loop, how it is run, what varies and what is kept. Run k is a pure function of this value and k.

    Attributes:
        loop: plant, controller and hardware; a system by itself is a loop without a controller.
        horizon: length of each run, s.
        plan: what varies.
        engine: how it is run; by default `FixedSteps()` with a processor, else `Taylor()`.
        initial: SI values of states that do not vary; others start at 0.
        parameters: SI values in place of the loop's own.
        inputs: references and disturbances that do not vary, as `simulate` takes them; of samples with a row for each
            run, run k has row k. Disturbances left out are 0.
        measures: what is kept of every run.

    Raises:
        CampaignError: names of nothing in the loop, values out of a parameter's bounds, a reference without a value, a
            horizon that is no time, an engine that does not fit the loop.
    """

    loop: Loop
    horizon: float
    plan: Plan
    engine: Taylor | Implicit | FixedSteps | None = None
    initial: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    measures: Measures = field(default_factory=Measures)

    def __post_init__(self) -> None:
        if not 0 < self.horizon < math.inf:
            raise CampaignError("horizon of a campaign", f"{self.horizon} is not a positive time in s.")
        if self.engine is None:
            object.__setattr__(self, "engine", FixedSteps() if self.loop.sampled else Taylor())
        times = np.array([0.0, self.horizon])
        object.__setattr__(self, "inputs", {name: as_input(name, v, times) for name, v in self.inputs.items()})
        _check_hardware(self)
        self._check_names()
        self._check_ranges()
        _check_valued(self)

    @property
    def system(self) -> System:
        """Whose states are initial values and whose outputs are looked at: the plant of a loop with a processor."""
        return self.loop.plant if self.loop.sampled else self.loop.system

    @property
    def sample_times(self) -> np.ndarray:
        """(T,) s: the processor's samples, else the ends of the intervals on which a path is looked at."""
        hardware = self.loop.hardware
        if hardware is not None and hardware.period is not None:
            return hardware.period * np.arange(math.floor(self.horizon / hardware.period + 1e-9) + 1)
        return np.linspace(0.0, self.horizon, self.measures.samples + 1)

    def role(self, name: str) -> Role:
        """What a varied name is.

        Raises:
            CampaignError: where nothing has this name.
        """
        known = self._known()
        for role, names in known.items():
            if name in names:
                return role
        raise _unknown(f"'{name}' in the plan", name, known)

    def arguments(self, first: int, last: int) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """(what varies by name, what `simulate` takes by keyword) of the runs first ≤ k < last; arrays are (N,)."""
        varied = self.plan.values(first, last)
        tables: dict[Role, dict[str, Any]] = {
            Role.INITIAL: dict.fromkeys((s.name for s in self.system.states), 0.0)
            | dict(self.loop.initial)
            | dict(self.initial),
            Role.PARAMETER: dict(self.parameters),
            Role.INPUT: {name: _rows(given, first, last) for name, given in self.inputs.items()},
        }
        for name, values in varied.items():
            tables[self.role(name)][name] = values
        return varied, {
            "initial": tables[Role.INITIAL],
            "parameters": tables[Role.PARAMETER],
            "inputs": tables[Role.INPUT],
            "targets": {name: self._target(given, tables) for name, given in self.measures.targets.items()},
            "seed": seeds(self.plan, first, last),
        }

    def _target(self, given: float | str, tables: Mapping[Role, Mapping[str, Any]]) -> Any:
        if not isinstance(given, str):
            return float(given)
        value: Any = tables[self.role(given)].get(given)
        if value is None:
            # Of a parameter its own value; an input that is left out is 0.
            value = next((p.si_value for p in self.system.parameters if p.name == given), 0.0)
        return float(value) if isinstance(value, sp.Expr) else getattr(value, "value", value)

    def _known(self) -> dict[Role, list[str]]:
        loop = self.loop
        begun = [s.name for s in self.system.states]
        if loop.sampled:
            shown = () if loop.wiring.injected is None else loop.wiring.injected.system.outputs
            begun += [s.name for s in (*loop.wiring.memory, *shown, *loop.wiring.driven)]
        return {
            Role.INITIAL: begun,
            Role.PARAMETER: [p.name for p in self.system.parameters],
            Role.INPUT: [s.name for s in (*loop.disturbances, *loop.references)],
        }

    def _check_names(self) -> None:
        known = self._known()
        loop = self.loop
        # Not varied: of the controller, all runs have the same parameters, and noise has samples.
        further = {
            Role.PARAMETER: [name for name, _ in loop.wiring.parameters] if loop.sampled else [],
            Role.INPUT: [f"{s.name}_noise" for s in loop.wiring.measured] if loop.sampled else [],
        }
        for role, given in (
            (Role.INITIAL, self.initial),
            (Role.PARAMETER, self.parameters),
            (Role.INPUT, self.inputs),
        ):
            for name, value in given.items():
                if name not in (*known[role], *further.get(role, ())):
                    raise _unknown(f"{role.value} '{name}'", name, {role: known[role]})
                if role is not Role.INPUT and not math.isfinite(value):
                    raise CampaignError(f"{role.value} '{name}'", f"its value is {value}.", "Give a finite number.")
                rows = np.shape(getattr(value, "values", 0.0))[:-1]
                if rows and rows != (self.plan.count,):
                    raise CampaignError(
                        f"input '{name}'", f"it has samples for {rows[0]} runs, the plan has {self.plan.count}."
                    )
        for name in self.plan.names:
            self.role(name)
            if name in RESULT_COLUMNS:
                raise CampaignError(f"'{name}' in the plan", "results have a column of this name.", "Rename it.")
        self._check_measures(known)

    def _check_measures(self, known: dict[Role, list[str]]) -> None:
        outputs = [s.name for s in self.system.outputs]
        for name in (*self.measures.outputs, *self.measures.targets, *self.measures.effort):
            if name not in outputs:
                raise _unknown(f"'{name}' in Measures", name, {"output": outputs})
        for window in self.measures.windows:
            if not window.holds(self.sample_times).any() or window.end > self.horizon * (1 + 1e-9):
                raise CampaignError(
                    f"Window('{window.signal}', begin={window.begin:g}, end={window.end:g})",
                    f"no sample lies in it, or it ends after the run of {self.horizon:g} s.",
                    "Widen it, or run longer.",
                )
        for name, given in self.measures.targets.items():
            if not isinstance(given, str):
                continue
            if given not in [n for names in known.values() for n in names]:
                raise _unknown(f"target '{given}' of '{name}'", given, known)
            if not isinstance(self.inputs.get(given, Constant(value=0.0)), Constant):
                raise CampaignError(
                    f"target '{given}' of '{name}'", "it changes with time.", "Give the number that it ends at."
                )

    def _check_ranges(self) -> None:
        """Refuse what varies, or is given once, outside the range that the plant declares for it."""
        plant, system = self.loop.plant, self.system
        inputs = {n: given.value for n, given in self.inputs.items() if isinstance(given, Constant)}
        fixed = [s.name for s in system.states[: len(plant.states)] if s.name not in self.plan.names]
        starts = dict.fromkeys(fixed, 0.0) | dict(self.initial)
        for role, items, given in (
            (Role.INITIAL, system.states[: len(plant.states)], starts),
            (Role.PARAMETER, system.parameters, self.parameters),
            (Role.INPUT, system.inputs, inputs),
        ):
            for item in items:
                varied = item.name in self.plan.names and self.role(item.name) is role
                asked = f"{role.value} '{item.name}' of '{system.name}'"
                if varied and out_of_range(item, self.plan.support(item.name)):
                    low, high = self.plan.support(item.name)
                    least, most = declared_range(item) or (-math.inf, math.inf)
                    raise CampaignError(
                        f"values of {asked}",
                        f"they reach from {low:g} to {high:g}, its range is [{least:g}, {most:g}] in SI.",
                        "Narrow them: Uniform(low=..., high=...), Normal(..., low=..., high=...).",
                    )
                if item.name in given and (found := out_of_range(item, given[item.name])):
                    raise CampaignError(asked, found, STAY_INSIDE)


def _rows(given: Any, first: int, last: int) -> Any:
    """Of samples with a row for each run the rows of these runs."""
    if np.ndim(getattr(given, "values", 0.0)) < 2:
        return given
    return type(given).known(times=given.times, values=given.values[first:last])


def _check_hardware(experiment: Experiment) -> None:
    """Refuse a processor that never runs, and the engine of the other kind of loop."""
    loop = experiment.loop
    if isinstance(experiment.engine, FixedSteps) is not loop.sampled:
        fitting = "FixedSteps" if loop.sampled else "Taylor"
        raise CampaignError(
            f"a campaign with engine={type(experiment.engine).__name__}(...)",
            f"a loop {'with' if loop.sampled else 'without'} a processor is run by {fitting}.",
            f"Give engine={fitting}(...), or leave it out.",
        )
    period = loop.hardware.period if loop.hardware is not None else None
    if period is not None and period > experiment.horizon:
        raise CampaignError(
            f"Hardware(period={period:g})",
            f"the period is longer than the run of {experiment.horizon:g} s.",
            "Run longer or sample faster.",
        )


def _check_valued(experiment: Experiment) -> None:
    """Refuse parameters and references without a value."""
    varied, what = experiment.plan.names, f"campaign with '{experiment.system.name}'"
    missing = [
        p.name
        for p in experiment.system.parameters
        if p.value is None and p.name not in (*experiment.parameters, *varied)
    ]
    if missing:
        found = f"parameters without a value: {', '.join(missing)}."
        raise CampaignError(what, found, f"Give them: parameters={{'{missing[0]}': ...}}, or vary them.")
    missing = [name for name in experiment.loop.required if name not in (*experiment.inputs, *varied)]
    if missing:
        found = f"references without a value: {', '.join(missing)}."
        raise CampaignError(what, found, f"Give them: inputs={{'{missing[0]}': ...}}, or vary them.")


def _unknown(asked: str, name: str, known: Mapping[Any, list[str]]) -> CampaignError:
    everything = [each for names in known.values() for each in names]
    near = get_close_matches(name, everything, n=3, cutoff=0.6)
    hint = f"Did you mean {' or '.join(near)}?" if near else f"Known: {', '.join(everything) or 'none'}."
    what = " or ".join(role.value if isinstance(role, Role) else str(role) for role in known)
    return CampaignError(asked, f"there is no {what} of this name.", hint)
