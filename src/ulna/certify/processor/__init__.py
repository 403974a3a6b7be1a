"""Loops on their processor: a period as a map, and the box in which every run ends."""

from ulna.certify.processor.ultimate import prove_ultimate

__all__ = ["prove_ultimate"]
