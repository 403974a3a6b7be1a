"""Parameters from measurements: whether they can be known, what they are, how surely (docs/identify.md)."""

from ulna.identification.errors import IdentificationError
from ulna.identification.excitation import Excitation, excite
from ulna.identification.fitting import (
    Estimate,
    Fit,
    GlobalStart,
    HeldOut,
    MultipleShooting,
    Prior,
    Ranked,
    ResidualTest,
    Robust,
    compared,
    identify,
)
from ulna.identification.records import Experiment, Record, Sheet, as_record, as_records, read_record, read_sheet
from ulna.identification.sensitivity import Response, Sensitivities, sensitivities
from ulna.identification.structural import (
    Combination,
    Extent,
    Identifiability,
    Motion,
    ParameterAnswer,
    identifiability,
)

__all__ = [
    "Combination",
    "Estimate",
    "Excitation",
    "Experiment",
    "Extent",
    "Fit",
    "GlobalStart",
    "HeldOut",
    "Identifiability",
    "IdentificationError",
    "Motion",
    "MultipleShooting",
    "ParameterAnswer",
    "Prior",
    "Ranked",
    "Record",
    "ResidualTest",
    "Response",
    "Robust",
    "Sensitivities",
    "Sheet",
    "as_record",
    "as_records",
    "compared",
    "excite",
    "identifiability",
    "identify",
    "read_record",
    "read_sheet",
    "sensitivities",
]
