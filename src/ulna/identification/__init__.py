"""Parameters from measurements: whether they can be known, what they are, how surely (docs/identify.md)."""

from ulna.identification.errors import IdentificationError

__all__ = ["IdentificationError"]
