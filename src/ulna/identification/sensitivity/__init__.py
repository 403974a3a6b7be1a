"""Runs with their exact slopes by parameters and initial states."""

from ulna.identification.sensitivity.response import Response, Sensitivities, response_of, sensitivities

__all__ = ["Response", "Sensitivities", "response_of", "sensitivities"]
