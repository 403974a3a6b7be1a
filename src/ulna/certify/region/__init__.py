"""Regions of loops in continuous time: the loop in its coordinates, where it rests, a function that falls."""

from ulna.certify.region.balls import Slopes, ball, slopes_of
from ulna.certify.region.box import comes_back, inside
from ulna.certify.region.certificate_of import certificate_of
from ulna.certify.region.form import Form, form_of, in_states, moved, start_of
from ulna.certify.region.limited import Limited, check_smooth, limited_loop
from ulna.certify.region.metrics import Candidate, candidates
from ulna.certify.region.region import HALVED, LEAF, Attempt, attempt, rational
from ulna.certify.region.rest import Rest, decays, equilibrium_near, holding, linear_answer, rest

__all__ = [
    "HALVED",
    "LEAF",
    "Attempt",
    "Candidate",
    "Form",
    "Limited",
    "Rest",
    "Slopes",
    "attempt",
    "ball",
    "candidates",
    "certificate_of",
    "check_smooth",
    "comes_back",
    "decays",
    "equilibrium_near",
    "form_of",
    "holding",
    "in_states",
    "inside",
    "limited_loop",
    "linear_answer",
    "moved",
    "rational",
    "rest",
    "slopes_of",
    "start_of",
]
