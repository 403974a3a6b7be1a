"""Whether parameters can be known from outputs at all, before any number is measured."""

from ulna.identification.structural.combinations import Combination
from ulna.identification.structural.experiment import Motion
from ulna.identification.structural.extent import Extent, ParameterAnswer
from ulna.identification.structural.identifiability import Identifiability, identifiability

__all__ = ["Combination", "Extent", "Identifiability", "Motion", "ParameterAnswer", "identifiability"]
