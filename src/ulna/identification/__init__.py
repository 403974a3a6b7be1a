"""Parameters from measurements: whether they can be known, what they are, how surely (docs/identify.md)."""

from ulna.identification.errors import IdentificationError
from ulna.identification.response import Response, Sensitivities, sensitivities

__all__ = ["IdentificationError", "Response", "Sensitivities", "sensitivities"]
