"""Observer forms, output transformations, and every kind of observer."""

from ulna.design.observers.constant_gain import local_observer
from ulna.design.observers.disturbance import extended_state_observer, with_disturbance
from ulna.design.observers.extended_kalman import KalmanNoise, extended_kalman_filter
from ulna.design.observers.high_gain import HighGain, high_gain_observer
from ulna.design.observers.linear_error_form import ObserverForm
from ulna.design.observers.observer import Observer, error_matrix, exact_observer, gains_in_form, injected_observer
from ulna.design.observers.observer_coordinates import find_observer_form, observer_form
from ulna.design.observers.recursive import recursive_estimator, with_unknowns
from ulna.design.observers.transformed_output import output_transformation, transformed_observer_form
