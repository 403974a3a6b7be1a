"""Functional mock-up units: a loop, its plant or its controller for other simulators."""

from ulna.deploy.fmu.export import FmuFile, fmu
from ulna.deploy.fmu.part import FmuPart

__all__ = ["FmuFile", "FmuPart", "fmu"]
