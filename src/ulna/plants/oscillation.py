"""Small oscillations of a second-order plant, such as the passive forearm, about its equilibria (paper eq. 7-12)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import PlantError, Verdict
from ulna.plants.catalogue import PlantLike, as_plant
from ulna.system import Signal, System, equilibria, linearise


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallOscillation:
    """q″ + 2ζω_n q′ + ω_n² q = 0 for the small displacement q from an equilibrium (paper eq. 11).

    Attributes:
        system: the plant, with states (position, velocity).
        equilibrium: value by state symbol; may be symbolic.
        residual: the acceleration at that point; it vanishes exactly at an equilibrium (paper eq. 10).
        damping: 2ζω_n, in 1/s.
        stiffness: ω_n², in 1/s²; not positive where the plant does not swing about the point.
    """

    system: System
    equilibrium: Mapping[sp.Symbol, sp.Expr]
    residual: sp.Expr
    damping: sp.Expr
    stiffness: sp.Expr

    @property
    def natural_frequency(self) -> sp.Expr:
        """ω_n in rad/s (paper eq. 12); imaginary where the stiffness is negative."""
        return sp.sqrt(self.stiffness)

    @property
    def damping_ratio(self) -> sp.Expr:
        """ζ, the share of critical damping."""
        return self.damping / (2 * self.natural_frequency)

    @property
    def swings(self) -> bool:
        """Whether the plant comes back to the point with a real natural frequency. Needs numbers."""
        return bool(sp.N(self.stiffness) > 0)

    @property
    def linear(self) -> System:
        """The linear equation (11) as a system in the displacement and its rate."""
        position, velocity = self.system.states
        moved = tuple(
            Signal(name=f"d{s.name}", unit=s.unit, text=f"displacement of {s.text or s.name}")
            for s in (position, velocity)
        )
        q, rate = (s.symbol for s in moved)
        return replace(
            self.system,
            name=f"{self.system.name}, linearised",
            states=moved,
            rates=(rate, -self.damping * rate - self.stiffness * q),
            inputs=(),
            outputs=(replace(position, text=f"{position.text or position.name} from the linear equation"),),
            readouts=(self.equilibrium[position.symbol] + q,),
            definitions=(),
            operating_point=(),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SmallOscillations:
    """The small oscillation about every equilibrium in a range, and whether these are all."""

    points: tuple[SmallOscillation, ...]
    complete: Verdict


def small_oscillation(system: PlantLike, equilibrium: Mapping[str, sp.Expr] | None = None) -> SmallOscillation:
    """The small oscillation of a second-order plant about a point.

    Args:
        system: two states, the rate of the first being the second; parameters may stay symbolic. Inputs are zero.
        equilibrium: the position by state name, a number or a symbol; the velocity is zero. Left out, the position
            stays as its own symbol.

    Raises:
        PlantError: for a plant that is not of this kind, or a name that is not its position.
    """
    system = as_plant(system)
    position, velocity = _position_and_velocity(system)
    given = dict(equilibrium or {position.name: position})
    if set(given) != {position.name}:
        raise PlantError(
            f"equilibrium of '{system.name}'", f"it is given by {', '.join(given)}.", f"Give {position.name} alone."
        )
    at_rest: dict[sp.Symbol, sp.Expr] = {position: given[position.name], velocity: sp.Integer(0)}
    point = {**at_rest, **dict.fromkeys(system.input_symbols, sp.Integer(0))}
    matrix = linearise(system, point).A
    acceleration = system.inline(system.rates)[1]
    return SmallOscillation(
        system=system,
        equilibrium=at_rest,
        residual=acceleration.subs(point),
        damping=-matrix[1, 1],
        stiffness=-matrix[1, 0],
    )


def small_oscillations(system: PlantLike, within: tuple[float, float]) -> SmallOscillations:
    """The small oscillation about every equilibrium with the position in a range (paper eq. 10, all its roots).

    Args:
        system: as in `small_oscillation`; every parameter needs a value.
        within: (lower, upper) of the position, SI.

    Raises:
        PlantError: as `small_oscillation`, or for a parameter without value.
    """
    system = as_plant(system)
    position, _ = _position_and_velocity(system)
    found = equilibria(system, {position.name: within})
    numeric = system.with_values()
    points = tuple(small_oscillation(numeric, {position.name: sp.Float(point[position.name])}) for point in found)
    return SmallOscillations(points=points, complete=found.complete)


def _position_and_velocity(system: System) -> tuple[sp.Symbol, sp.Symbol]:
    symbols = system.state_symbols
    if len(symbols) != 2 or system.inline(system.rates)[0] != symbols[1]:
        raise PlantError(
            f"small oscillation of '{system.name}'",
            f"its states are {', '.join(s.name for s in symbols)}; a position and its rate are needed.",
            "Write the plant as position' = velocity, velocity' = acceleration.",
        )
    return symbols[0], symbols[1]
