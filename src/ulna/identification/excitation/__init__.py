"""The input from which parameters come out most surely."""

from ulna.identification.excitation.best_input import Excitation, excite

__all__ = ["Excitation", "excite"]
