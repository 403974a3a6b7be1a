"""Gains, references, laws, compensators and the loops they close."""

from ulna.design.control.cascade import InnerLoop, close_cascade, inner_loop
from ulna.design.control.energy_pumping import swing_up
from ulna.design.control.extended import ExtendedLaw, extended_law
from ulna.design.control.grid import LoopGrid, loop_grid
from ulna.design.control.law import Law, state_feedback
from ulna.design.control.load_robust import LoadRobust, load_robust_compensator
from ulna.design.control.local import local_law
from ulna.design.control.offset import PermanentOffset, permanent_offset
from ulna.design.control.output_feedback import Compensator, close_loop, compensator
from ulna.design.control.reference import AbstractReference, Regulate, SetPoint, Track
from ulna.design.control.sampled_stability import sampled_grid, sampling_advice
from ulna.design.control.schedule import gain_schedule
from ulna.design.control.singular_perturbation import SETTLED, ReducedOrder, reduced_order
