"""Global stability by cascade."""

from ulna.certify.cascade.cascade import NotByThisTheoremError, cascade, worded

__all__ = ["NotByThisTheoremError", "cascade", "worded"]
