"""Claims over a box of parameters."""

from ulna.certify.over.over import prove_over

__all__ = ["prove_over"]
