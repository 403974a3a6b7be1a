"""What leaves the house: the step of a loop as C that computes what was simulated, and FMUs for other simulators."""

from ulna.deploy.comparison import Comparison, compare
from ulna.deploy.compiled import Compiled
from ulna.deploy.emulation import Cost
from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import Firmware, Port, controllers_part, firmware
from ulna.deploy.fixed_firmware import FixedFirmware, Range, fixed_firmware
from ulna.deploy.fixed_point import FixedPoint
from ulna.deploy.fmu import FmuFile, FmuPart, fmu
from ulna.deploy.project import CProject, c_project
from ulna.deploy.target import TARGETS, Board, Target
from ulna.deploy.verification import verify

__all__ = [
    "TARGETS",
    "Board",
    "CProject",
    "Comparison",
    "Compiled",
    "Cost",
    "DeployError",
    "Firmware",
    "FixedFirmware",
    "FixedPoint",
    "FmuFile",
    "FmuPart",
    "Port",
    "Range",
    "Target",
    "c_project",
    "compare",
    "controllers_part",
    "firmware",
    "fixed_firmware",
    "fmu",
    "verify",
]
