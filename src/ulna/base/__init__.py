"""Errors, verdicts, array axis names, units: what every other package may use."""

import ulna.base.read_only  # noqa: F401 - values are pickled
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
    printable,
)
from ulna.base.files import text_of_file, whole_file
from ulna.base.formula_element import mathml
from ulna.base.letters import LETTERS
from ulna.base.machine import HAS_FORK, HAS_TIMER, cores, lock_alone
from ulna.base.tables import html_table, number_text
from ulna.base.units import Dimension, Unit, coherent, dimension_text, unit
from ulna.base.verdict import Status, Verdict, all_of, evidence_label, told_evidence

__all__ = [
    "HAS_FORK",
    "HAS_TIMER",
    "LETTERS",
    "DesignError",
    "Dimension",
    "FormulaError",
    "NoFormError",
    "NotAffineError",
    "OptionalDependencyError",
    "PlantError",
    "SimulationError",
    "Status",
    "UlnaError",
    "UlnaWarning",
    "Unit",
    "UnitError",
    "Verdict",
    "all_of",
    "coherent",
    "cores",
    "dimension_text",
    "evidence_label",
    "html_table",
    "lock_alone",
    "mathml",
    "number_text",
    "printable",
    "text_of_file",
    "told_evidence",
    "unit",
    "whole_file",
]
