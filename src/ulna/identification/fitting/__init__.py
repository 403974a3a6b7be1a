"""Parameters from records: the search, how sure they are, and what is left over."""

from ulna.identification.fitting.fit import Estimate, Fit, HeldOut, Ranked, compared
from ulna.identification.fitting.prior import Prior
from ulna.identification.fitting.residual_tests import ResidualTest
from ulna.identification.fitting.search import identify
from ulna.identification.fitting.solve import MultipleShooting, Robust
from ulna.identification.fitting.start import GlobalStart

__all__ = [
    "Estimate",
    "Fit",
    "GlobalStart",
    "HeldOut",
    "MultipleShooting",
    "Prior",
    "Ranked",
    "ResidualTest",
    "Robust",
    "compared",
    "identify",
]
