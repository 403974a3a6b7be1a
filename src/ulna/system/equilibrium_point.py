"""`Equilibrium`: a point of a system, exact or in decimals, and whether the system rests there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import sympy as sp

from ulna.base import PlantError, Verdict
from ulna.symbolic.formulas import exact, listing
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class Equilibrium:
    """Values of states and inputs, SI, exact or in decimals, and whether the system rests there.

    `point["theta"]` is the number of a state, input or output there.

    Attributes:
        states: value by state symbol, in the order of the system's states; parameters may appear.
        inputs: value by input symbol.
        verdict: on "it rests there": proved, supported (a point in decimals tells its `digits`), refuted with the
            rate that does not vanish, undecided where it was not asked. Its evidence tells how the point was found.
        parameters: value by parameter symbol where the system rests there only at the parameters' values; empty where
            it rests for any parameters, or not at all.

    Examples:
        >>> rest = ulna.equilibrium(ulna.model("one_link_arm").with_values())
        >>> rest.states
        {theta: 0, omega: 0, i: -441/25}
    """

    system: System
    states: Mapping[sp.Symbol, sp.Expr]
    inputs: Mapping[sp.Symbol, sp.Expr]
    verdict: Verdict
    parameters: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)

    @property
    def exact(self) -> bool:
        """Whether the values are exact, not decimals."""
        return "digits" not in self.verdict.evidence

    @property
    def where(self) -> dict[sp.Symbol, sp.Expr]:
        """What questions at the point are asked at: the states, and the parameters where the point depends on them."""
        return {**self.states, **self.parameters}

    @property
    def values(self) -> dict[sp.Symbol, sp.Expr]:
        """States and inputs together."""
        return {**self.states, **self.inputs}

    @property
    def phrase(self) -> str:
        """`at the operating point`, and that parameters stand at their values where they do."""
        return "at the operating point" + (", parameters at their values" if self.parameters else "")

    @property
    def numbers(self) -> dict[str, float]:
        """SI number by state name, parameters at their values: where a run may start."""
        return {s.name: self[s.name] for s in self.system.states}

    def __getitem__(self, name: str) -> float:
        """The SI number of a state, input or output at the point, parameters at their values.

        Raises:
            PlantError: for an unknown name, or parameters without a value.
        """
        asked = f"'{name}' at a point of '{self.system.name}'"
        known = {s.name: value for s, value in self.values.items()}
        if name not in known:
            readouts = zip(self.system.outputs, self.system.inline(self.system.readouts), strict=True)
            known = {o.name: e.subs(self.values) for o, e in readouts} | known
        if name not in known:
            raise PlantError(asked, "there is no such state, input or output.", f"Known: {', '.join(known)}.")
        value = known[name].xreplace({**self.system.values, **self.parameters})
        if value.free_symbols:
            missing = ", ".join(sorted(s.name for s in value.free_symbols))
            raise PlantError(asked, f"it depends on parameters without a value: {missing}.", "Give them values.")
        return float(value)

    def __repr__(self) -> str:
        return listing(str(self.verdict), [(s.name, value) for s, value in self.values.items()])


PointLike: TypeAlias = Equilibrium | Mapping[sp.Symbol, Any] | Mapping[str, Any]
"""A point as users may give it: a value by symbol or by name, or an equilibrium."""


def as_point(system: System, given: PointLike) -> dict[sp.Symbol, sp.Expr]:
    """Exact SI values by symbol of what a point gives for states, inputs and parameters.

    Raises:
        PlantError: for a name that the system does not have, or a value that is no number or expression.
    """
    if isinstance(given, Equilibrium):
        return {**given.values, **given.parameters}
    known = {item.name: item.symbol for item in (*system.states, *system.inputs, *system.parameters)}
    point = {}
    for key, value in given.items():
        name = key if isinstance(key, str) else key.name
        if name not in known:
            raise PlantError(
                f"'{name}' of a point of '{system.name}'",
                "there is no such state, input or parameter.",
                f"Known: {', '.join(known)}.",
            )
        try:
            point[known[name]] = value if isinstance(value, sp.Expr) else exact(value)
        except (ValueError, TypeError):
            raise PlantError(f"'{name}' of a point of '{system.name}'", f"{value!r} is not a finite number.") from None
    return point
