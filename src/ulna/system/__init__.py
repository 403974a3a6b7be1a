"""`System` and what is made of one: its file, its control-affine view, its linearisation; `connect` joins systems."""

from ulna.system.affine import ControlAffine, control_affine, require_continuous
from ulna.system.connection import connect
from ulna.system.equations import system_latex
from ulna.system.equilibrium_point import Equilibrium, PointLike, as_point
from ulna.system.equilibrium_range import Equilibria, equilibria
from ulna.system.equilibrium_search import equilibrium
from ulna.system.file import read_system, write_system
from ulna.system.holder import HasSystem, SystemLike, as_system
from ulna.system.input_substitution import InputSubstitution, substitute_input
from ulna.system.kalman_filter import KalmanFilter
from ulna.system.linear_injection import LinearInjection
from ulna.system.linearisation import Linearisation, linearise
from ulna.system.number_with_unit import quantity
from ulna.system.operating_point import equilibrium_in_numbers, given_point, known_signs, stand_ins, starting_point
from ulna.system.picture import Picture
from ulna.system.ranges import STAY_INSIDE, declared_range, out_of_range
from ulna.system.right_hand_side import SystemKernel, system_kernel
from ulna.system.schema import system_from_mapping, system_to_mapping
from ulna.system.side import NON_SMOOTH, OneSide, on_one_side
from ulna.system.signal import Definition, Parameter, Signal, to_si
from ulna.system.system import System
from ulna.system.uses import controlled_part, measured_part, with_uses
from ulna.system.zeros import Zeros, decimal_root, newton

__all__ = [
    "NON_SMOOTH",
    "STAY_INSIDE",
    "ControlAffine",
    "Definition",
    "Equilibria",
    "Equilibrium",
    "HasSystem",
    "InputSubstitution",
    "KalmanFilter",
    "LinearInjection",
    "Linearisation",
    "OneSide",
    "Parameter",
    "Picture",
    "PointLike",
    "Signal",
    "System",
    "SystemKernel",
    "SystemLike",
    "Zeros",
    "as_point",
    "as_system",
    "connect",
    "control_affine",
    "controlled_part",
    "decimal_root",
    "declared_range",
    "equilibria",
    "equilibrium",
    "equilibrium_in_numbers",
    "given_point",
    "known_signs",
    "linearise",
    "measured_part",
    "newton",
    "on_one_side",
    "out_of_range",
    "quantity",
    "read_system",
    "require_continuous",
    "stand_ins",
    "starting_point",
    "substitute_input",
    "system_from_mapping",
    "system_kernel",
    "system_latex",
    "system_to_mapping",
    "to_si",
    "with_uses",
    "write_system",
]
