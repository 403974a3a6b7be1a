"""`Loop`: a plant, its controller and the hardware between them, as one value that every engine reads."""

from ulna.loop.applied import applied
from ulna.loop.clock import Jitter, MissedSamples
from ulna.loop.discretisation import Discretisation, Euler, ExactHold, RungeKutta4
from ulna.loop.drive import Amplifier, Pwm
from ulna.loop.fault import Fault
from ulna.loop.fingerprint import fingerprint
from ulna.loop.fitted import TINY, Fitted, parameters_of
from ulna.loop.flow import Flow, Program, Repeat, Steps, plant_kernels, unrolled
from ulna.loop.guard import Guard
from ulna.loop.hardware import Hardware
from ulna.loop.limits import ConditionalIntegration, EndStop, Saturation, SlewLimit
from ulna.loop.loop import Loop
from ulna.loop.pace import ROUNDS
from ulna.loop.parts import Parts, joined, parts_of
from ulna.loop.reaction import Hold, Reaction, Report, SafeOutput
from ulna.loop.sensors import MeasurementNoise, Quantiser
from ulna.loop.step import Step
from ulna.loop.watches import Deadline, InnovationLimit, ReferenceRange
from ulna.loop.wiring import TIME, Wiring

__all__ = [
    "ROUNDS",
    "TIME",
    "TINY",
    "Amplifier",
    "ConditionalIntegration",
    "Deadline",
    "Discretisation",
    "EndStop",
    "Euler",
    "ExactHold",
    "Fault",
    "Fitted",
    "Flow",
    "Guard",
    "Hardware",
    "Hold",
    "InnovationLimit",
    "Jitter",
    "Loop",
    "MeasurementNoise",
    "MissedSamples",
    "Parts",
    "Program",
    "Pwm",
    "Quantiser",
    "Reaction",
    "ReferenceRange",
    "Repeat",
    "Report",
    "RungeKutta4",
    "SafeOutput",
    "Saturation",
    "SlewLimit",
    "Step",
    "Steps",
    "Wiring",
    "applied",
    "fingerprint",
    "joined",
    "parameters_of",
    "parts_of",
    "plant_kernels",
    "unrolled",
]
