"""Parameters from measurements: whether they can be known, what they are, how surely (docs/identify.md)."""

from ulna.identification.combinations import Combination
from ulna.identification.errors import IdentificationError
from ulna.identification.excitation import Excitation, excite
from ulna.identification.experiment import Motion
from ulna.identification.extent import Extent, ParameterAnswer
from ulna.identification.fit import Estimate, Fit, HeldOut, Ranked, compared
from ulna.identification.prior import Prior
from ulna.identification.record import Record, as_record, as_records, read_record
from ulna.identification.recorded_experiment import Experiment
from ulna.identification.residual_tests import ResidualTest
from ulna.identification.response import Response, Sensitivities, sensitivities
from ulna.identification.search import identify
from ulna.identification.sheet import Sheet, read_sheet
from ulna.identification.solve import MultipleShooting, Robust
from ulna.identification.start import GlobalStart
from ulna.identification.structural import Identifiability, identifiability

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
