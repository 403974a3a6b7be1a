"""Errors, verdicts, array axis names, units: what every other package may use."""

from ulna.base.errors import (
    DesignError,
    FormulaError,
    NoFormError,
    NotAffineError,
    OptionalDependencyError,
    PlantError,
    SimulationError,
    UlnaError,
    UlnaWarning,
    UnitError,
)
from ulna.base.verdict import Status, Verdict, all_of

__all__ = [
    "DesignError",
    "FormulaError",
    "NoFormError",
    "NotAffineError",
    "OptionalDependencyError",
    "PlantError",
    "SimulationError",
    "Status",
    "UlnaError",
    "UlnaWarning",
    "UnitError",
    "Verdict",
    "all_of",
]
