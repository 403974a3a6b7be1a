"""`Experiment`: everything that decides the results of a campaign, as one value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import Enum
from typing import Any

import numpy as np

from ulna.campaign.errors import CampaignError
from ulna.campaign.grid import Grid
from ulna.campaign.measures import Measures
from ulna.campaign.sampling import LatinHypercube, Random, Saltelli, Sobol
from ulna.sim import Continuous
from ulna.sim.sampled import Sampled
from ulna.system import System, to_si


class Role(Enum):
    """What a varied quantity is."""

    INITIAL = "initial state"
    PARAMETER = "parameter"
    INPUT = "constant input"
    REFERENCE = "reference"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """A loop, how it is run, what varies and what is kept. Run k is a pure function of this value and k.

    Attributes:
        system: a whole closed loop with `Continuous`, the plant with `Sampled`.
        horizon: length of each run, s.
        time: how time passes.
        plan: what varies.
        initial: SI values of states that do not vary; others start at 0.
        parameters: SI values in place of the system's own.
        inputs: constant inputs, SI; others are 0.
        measures: what is kept of every run.

    Raises:
        CampaignError: names that nothing bears, values out of a parameter's bounds, a horizon that is no time.
    """

    system: System
    horizon: float
    time: Continuous | Sampled
    plan: Grid | LatinHypercube | Sobol | Random | Saltelli
    initial: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, float] = field(default_factory=dict)
    measures: Measures = field(default_factory=Measures)

    def __post_init__(self) -> None:
        if not 0 < self.horizon < math.inf:
            raise CampaignError("horizon of a campaign", f"{self.horizon} is not a positive time in s.")
        if isinstance(self.time, Sampled) and self.time.period > self.horizon:
            raise CampaignError(
                f"Sampled(period={self.time.period:g})",
                f"the period is longer than the run of {self.horizon:g} s.",
                "Run longer or sample faster.",
            )
        self._check_names()
        for name in self.plan.names:
            if self.role(name) is Role.PARAMETER:
                self._check_bounds(name, *self.plan.support(name))
        for name, value in self.parameters.items():
            self._check_bounds(name, value, value)
        _check_valued(self)

    def role(self, name: str) -> Role:
        """What a varied name is.

        Raises:
            CampaignError: where nothing bears it.
        """
        for role, names in self._known().items():
            if name in names:
                return role
        raise _unknown(f"'{name}' in the plan", name, self._known())

    def arguments(self, first: int, last: int) -> dict[str, Any]:
        """What the runs first ≤ k < last start from: `initial` (N, n), and (N,) arrays by name for what varies."""
        system, count = self.system, last - first
        varied = self.plan.values(first, last)
        initial = np.zeros((count, len(system.states)))
        tables: dict[Role, dict[str, Any]] = {
            Role.PARAMETER: dict(self.parameters), Role.INPUT: dict(self.inputs), Role.REFERENCE: {}
        }  # fmt: skip
        for column, signal in enumerate(system.states):
            initial[:, column] = varied.get(signal.name, self.initial.get(signal.name, 0.0))
        for name, values in varied.items():
            role = self.role(name)
            if role is not Role.INITIAL:
                tables[role][name] = values
        return {
            "initial": initial,
            "parameters": tables[Role.PARAMETER],
            "inputs": tables[Role.INPUT],
            "references": tables[Role.REFERENCE],
            "targets": {name: self._target(given, varied) for name, given in self.measures.targets.items()},
            "varied": varied,
        }

    def _target(self, given: float | str, varied: Mapping[str, np.ndarray]) -> Any:
        if not isinstance(given, str):
            return float(given)
        if given in varied:
            return varied[given]
        return float(self.inputs.get(given, _references(self).get(given, 0.0)))

    def _known(self) -> dict[Role, list[str]]:
        system = self.system
        return {
            Role.INITIAL: [s.name for s in system.states],
            Role.PARAMETER: [p.name for p in system.parameters],
            Role.INPUT: _free_inputs(self),
            Role.REFERENCE: list(_references(self)),
        }

    def _check_names(self) -> None:
        known = self._known()
        for what, given, role in (
            ("initial state", self.initial, Role.INITIAL),
            ("parameter", self.parameters, Role.PARAMETER),
            ("input", self.inputs, Role.INPUT),
        ):
            for name, value in given.items():
                if name not in known[role]:
                    raise _unknown(f"{what} '{name}'", name, {role: known[role]})
                if not math.isfinite(value):
                    raise CampaignError(f"{what} '{name}'", f"its value is {value}.", "Give a finite number.")
        for name in self.plan.names:
            self.role(name)
            if name in ("run", "outcome", "settled", "end_time"):
                raise CampaignError(f"'{name}' in the plan", "results have a column of this name.", "Rename it.")
        outputs = [s.name for s in self.system.outputs]
        for name in (*self.measures.outputs, *self.measures.targets, *self.measures.effort):
            if name not in outputs:
                raise _unknown(f"'{name}' in Measures", name, {"output": outputs})
        for name, given in self.measures.targets.items():
            if isinstance(given, str):
                everything = [n for names in known.values() for n in names]
                if given not in everything:
                    raise _unknown(f"target '{given}' of '{name}'", given, known)

    def _check_bounds(self, name: str, low: float, high: float) -> None:
        parameter = next(p for p in self.system.parameters if p.name == name)
        least = -math.inf if parameter.lower is None else float(to_si(parameter.lower, parameter.unit))
        most = math.inf if parameter.upper is None else float(to_si(parameter.upper, parameter.unit))
        if low < least or high > most:
            raise CampaignError(
                f"values of parameter '{name}' of '{self.system.name}'",
                f"they reach from {low:g} to {high:g}, its range is [{least:g}, {most:g}] in SI.",
                "Narrow them: Uniform(low=..., high=...), Normal(..., low=..., high=...).",
            )


def _free_inputs(experiment: Experiment) -> list[str]:
    """Inputs of the system that no controller drives."""
    return [s.name for s in experiment.system.inputs if not _drives(experiment, s.name)]


def _drives(experiment: Experiment, name: str) -> bool:
    time = experiment.time
    return isinstance(time, Sampled) and name in {s.name for s in time.controller.outputs}


def _references(experiment: Experiment) -> Mapping[str, Any]:
    return experiment.time.references if isinstance(experiment.time, Sampled) else {}


def _check_valued(experiment: Experiment) -> None:
    given = {*experiment.parameters, *experiment.plan.names}
    missing = [p.name for p in experiment.system.parameters if p.value is None and p.name not in given]
    if missing:
        raise CampaignError(
            f"campaign with '{experiment.system.name}'",
            f"parameters without a value: {', '.join(missing)}.",
            f"Give them: parameters={{'{missing[0]}': ...}}, or vary them.",
        )


def _unknown(asked: str, name: str, known: Mapping[Any, list[str]]) -> CampaignError:
    everything = [each for names in known.values() for each in names]
    near = get_close_matches(name, everything, n=3, cutoff=0.6)
    hint = f"Did you mean {' or '.join(near)}?" if near else f"Known: {', '.join(everything) or 'none'}."
    what = " or ".join(role.value if isinstance(role, Role) else str(role) for role in known)
    return CampaignError(asked, f"there is no {what} of this name.", hint)
