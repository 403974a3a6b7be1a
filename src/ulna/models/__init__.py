"""Plants: the forearm, the arm with its motor, and the textbook catalogue, each a data file with its sources."""

from ulna.models.catalogue import Model, model, models

__all__ = ["Model", "model", "models"]
