"""Forms, laws, observers, compensators and closed loops: from a plant's geometry to its controller."""

from ulna.design.analysis import Analysis, analyse
from ulna.design.cascade import InnerLoop, close_cascade, inner_loop
from ulna.design.compensator import ClosedLoop, Compensator, close_loop, compensator
from ulna.design.controller_form import ControllerForm, controller_form
from ulna.design.dynamic_extension import DynamicExtension, dynamic_extension
from ulna.design.extended_kalman import extended_kalman_filter
from ulna.design.extended_state_observer import extended_state_observer, with_disturbance
from ulna.design.findings import Finding
from ulna.design.flatness import flat_output
from ulna.design.gains import AbstractGainRule, LinearQuadratic, Poles
from ulna.design.high_gain import high_gain_observer
from ulna.design.input_output import InputOutputForm, input_output_form
from ulna.design.law import Law, state_feedback
from ulna.design.linearisability import Linearisability, linearisability
from ulna.design.linearising_outputs import LinearisingOutputs, linearising_outputs
from ulna.design.load_robust import LoadRobust, load_robust_compensator
from ulna.design.loop_grid import LoopGrid, loop_grid
from ulna.design.minimum_phase import minimum_phase
from ulna.design.normal_form import NormalForm, normal_form
from ulna.design.observer import Observer, exact_observer
from ulna.design.observer_form import ObserverForm, observer_form
from ulna.design.output_transformation import transformed_observer_form
from ulna.design.permanent_offset import PermanentOffset, permanent_offset
from ulna.design.reduced_order import ReducedOrder, reduced_order
from ulna.design.reference import Regulate, SetPoint, Track
from ulna.design.sampled_stability import sampled_grid, sampling_advice
from ulna.design.state_linearisation import StateLinearisation, state_linearisation
from ulna.design.zero_dynamics import ZeroDynamics, zero_dynamics

__all__ = [
    "AbstractGainRule",
    "Analysis",
    "ClosedLoop",
    "Compensator",
    "ControllerForm",
    "DynamicExtension",
    "Finding",
    "InnerLoop",
    "InputOutputForm",
    "Law",
    "LinearQuadratic",
    "Linearisability",
    "LinearisingOutputs",
    "LoadRobust",
    "LoopGrid",
    "NormalForm",
    "Observer",
    "ObserverForm",
    "PermanentOffset",
    "Poles",
    "ReducedOrder",
    "Regulate",
    "SetPoint",
    "StateLinearisation",
    "Track",
    "ZeroDynamics",
    "analyse",
    "close_cascade",
    "close_loop",
    "compensator",
    "controller_form",
    "dynamic_extension",
    "exact_observer",
    "extended_kalman_filter",
    "extended_state_observer",
    "flat_output",
    "high_gain_observer",
    "inner_loop",
    "input_output_form",
    "linearisability",
    "linearising_outputs",
    "load_robust_compensator",
    "loop_grid",
    "minimum_phase",
    "normal_form",
    "observer_form",
    "permanent_offset",
    "reduced_order",
    "sampled_grid",
    "sampling_advice",
    "state_feedback",
    "state_linearisation",
    "transformed_observer_form",
    "with_disturbance",
    "zero_dynamics",
]
