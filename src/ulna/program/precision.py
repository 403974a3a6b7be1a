"""`Precision`: how many digits the numbers of a lowered kernel carry."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import numpy as np


class Precision(StrEnum):
    """Binary floating point of IEEE 754, by its name in C."""

    SINGLE = "float"
    DOUBLE = "double"

    @property
    def dtype(self) -> Any:
        """NumPy's type."""
        return np.float32 if self is Precision.SINGLE else np.float64

    @property
    def bits(self) -> int:
        """Binary digits of the significand."""
        return 24 if self is Precision.SINGLE else 53

    def rounded(self, value: float) -> float:
        """The nearest number that it has."""
        with np.errstate(over="ignore"):
            return float(self.dtype(value))
