"""`System` and what is made of one: its file, its control-affine view, its linearisation; `connect` joins systems."""

from ulna.system.affine import ControlAffine, control_affine, non_smooth_terms
from ulna.system.connect import connect
from ulna.system.equilibria import Equilibria, Equilibrium, equilibria
from ulna.system.file import read_system, write_system
from ulna.system.holder import HasSystem, SystemLike, as_system
from ulna.system.linear_injection import LinearInjection
from ulna.system.linearise import Linearisation, linearise
from ulna.system.operating_point import OperatingPoint, operating_point
from ulna.system.rest_point import RestPoint, rest_point
from ulna.system.schema import system_from_mapping, system_to_mapping
from ulna.system.signal import Definition, Parameter, Signal
from ulna.system.system import System

__all__ = [
    "ControlAffine",
    "Definition",
    "Equilibria",
    "Equilibrium",
    "HasSystem",
    "LinearInjection",
    "Linearisation",
    "OperatingPoint",
    "Parameter",
    "RestPoint",
    "Signal",
    "System",
    "SystemLike",
    "as_system",
    "connect",
    "control_affine",
    "equilibria",
    "linearise",
    "non_smooth_terms",
    "operating_point",
    "read_system",
    "rest_point",
    "system_from_mapping",
    "system_to_mapping",
    "write_system",
]
