"""Forms, laws, observers, compensators and closed loops: from a plant's geometry to its controller."""

from ulna.design.analysis.analysis import Analysis, analyse
from ulna.design.analysis.answer import Answer
from ulna.design.control.cascade import InnerLoop, close_cascade, inner_loop
from ulna.design.control.compensator import Compensator, close_loop, compensator
from ulna.design.control.gains import AbstractGainRule, LinearQuadratic, Poles
from ulna.design.control.law import Law, state_feedback
from ulna.design.control.load_robust import LoadRobust, load_robust_compensator
from ulna.design.control.loop_grid import LoopGrid, loop_grid
from ulna.design.control.permanent_offset import PermanentOffset, permanent_offset
from ulna.design.control.reduced_order import ReducedOrder, reduced_order
from ulna.design.control.reference import Regulate, SetPoint, Track
from ulna.design.control.sampled_stability import sampled_grid, sampling_advice
from ulna.design.controller import Controller, controller_for
from ulna.design.forms.controller_form import controller_form
from ulna.design.forms.dynamic_extension import DynamicExtension, dynamic_extension
from ulna.design.forms.flatness import flat_output
from ulna.design.forms.input_output import input_output_form
from ulna.design.forms.linearisability import Linearisability, linearisability
from ulna.design.forms.linearising_form import LinearisingForm
from ulna.design.forms.linearising_outputs import LinearisingOutputs, linearising_outputs
from ulna.design.forms.normal_form import NormalForm, normal_form
from ulna.design.forms.state_linearisation import StateLinearisation, state_linearisation
from ulna.design.internal.minimum_phase import minimum_phase
from ulna.design.internal.zero_dynamics import ZeroDynamics, zero_dynamics
from ulna.design.observers.extended_kalman import KalmanNoise, extended_kalman_filter
from ulna.design.observers.extended_state_observer import extended_state_observer, with_disturbance
from ulna.design.observers.high_gain import HighGain, high_gain_observer
from ulna.design.observers.observer import Observer, error_matrix, exact_observer, gains_in_form, injected_observer
from ulna.design.observers.observer_form import ObserverForm, observer_form
from ulna.design.observers.output_transformation import transformed_observer_form

__all__ = [
    "AbstractGainRule",
    "Analysis",
    "Answer",
    "Compensator",
    "Controller",
    "DynamicExtension",
    "HighGain",
    "InnerLoop",
    "KalmanNoise",
    "Law",
    "LinearQuadratic",
    "Linearisability",
    "LinearisingForm",
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
    "controller_for",
    "controller_form",
    "dynamic_extension",
    "error_matrix",
    "exact_observer",
    "extended_kalman_filter",
    "extended_state_observer",
    "flat_output",
    "gains_in_form",
    "high_gain_observer",
    "injected_observer",
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
