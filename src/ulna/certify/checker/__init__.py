"""The second program: it proves a certificate again, and shares nothing with the prover but formulas and balls."""

from ulna.certify.checker.check import check

__all__ = ["check"]
