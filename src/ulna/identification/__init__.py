"""Parameters from measurements: whether they can be known, what they are, how surely (docs/identify.md)."""

from ulna.identification.combinations import Combination
from ulna.identification.errors import IdentificationError
from ulna.identification.experiment import Motion
from ulna.identification.extent import Extent, ParameterAnswer
from ulna.identification.response import Response, Sensitivities, sensitivities
from ulna.identification.structural import Identifiability, identifiability

__all__ = [
    "Combination",
    "Extent",
    "Identifiability",
    "IdentificationError",
    "Motion",
    "ParameterAnswer",
    "Response",
    "Sensitivities",
    "identifiability",
    "sensitivities",
]
