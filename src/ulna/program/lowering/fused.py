"""The fused multiply-add without the processor's: for Python, whose `math` has none before 3.13, and for NumPy.

The product and the sum are split into two doubles each without error; the small parts are added with rounding to odd,
so that the last addition rounds as if it were the only one. S. Boldo, G. Melquiond, "Emulation of FMA and correctly
rounded sums: proved algorithms using rounding to odd", IEEE Trans. Computers 57 (2008). Where a part would overflow or
lose digits below the smallest normal number, whole numbers of any length decide.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np

_SPLIT = 134217729.0
"""2^27 + 1: Veltkamp's, cuts a double into two halves."""
_LEAST, _LARGEST = 2.0**-400, 2.0**400
"""Magnitudes between which no part of the computation overflows or underflows."""


def fused_scalar(a: float, b: float, c: float) -> float:
    """a·b + c rounded once."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):
        return c
    (p, q), (r, s), (t, u) = a.as_integer_ratio(), b.as_integer_ratio(), c.as_integer_ratio()
    above, below = p * r * u + t * q * s, q * s * u
    if above == 0:
        # Signs of zero: the product is exact where a factor is zero, else the two cancel.
        return a * b + c if p == 0 or r == 0 else 0.0
    try:
        return above / below
    except OverflowError:
        return math.inf if above > 0 else -math.inf


def fused(a: Any, b: Any, c: Any) -> np.ndarray:
    """a·b + c rounded once, for arrays that broadcast, double or single."""
    kind = np.result_type(a, b, c)
    a, b, c = np.broadcast_arrays(*(np.asarray(each, dtype=float) for each in (a, b, c)))
    with np.errstate(all="ignore"):
        if kind == np.float32:
            # The product of two singles is exact in double precision.
            return _added_to_odd(a * b, c).astype(np.float32)
        high, low = _product(a, b)
        above, rest = _sum(c, low)
        above, middle = _sum(high, above)
        result = above + _added_to_odd(middle, rest)
        exact = (a == 0.0) | (b == 0.0) | ~(np.isfinite(a) & np.isfinite(b))
        result = np.where(exact, a * b + c, result)
        safe = exact | (_middling(a) & _middling(b) & _middling(a * b) & ((c == 0.0) | _middling(c)))
    for place in np.argwhere(~safe):
        k = tuple(place)
        result[k] = fused_scalar(float(a[k]), float(b[k]), float(c[k]))
    return result


def flipped_scalar(value: float, turns: float) -> float:
    """The value, its sign changed where the last bit of the other number is set."""
    (bits,) = struct.unpack("<Q", struct.pack("<d", turns))
    return -value if bits & 1 else value


def flipped(value: Any, turns: Any) -> np.ndarray:
    """The values, their signs changed where the last bit of the other numbers is set."""
    return np.where(_last_bits(turns), np.negative(value), value)


def _middling(a: Any) -> Any:
    return (np.abs(a) > _LEAST) & (np.abs(a) < _LARGEST)


def _sum(a: Any, b: Any) -> tuple[Any, Any]:
    """Knuth's: the rounded sum and what rounding lost."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _product(a: Any, b: Any) -> tuple[Any, Any]:
    """Dekker's: the rounded product and what rounding lost."""
    (a1, a2), (b1, b2) = _halves(a), _halves(b)
    total = a * b
    return total, a2 * b2 - (((total - a1 * b1) - a2 * b1) - a1 * b2)


def _halves(a: Any) -> tuple[Any, Any]:
    scaled = a * _SPLIT
    high = scaled - (scaled - a)
    return high, a - high


def _added_to_odd(a: Any, b: Any) -> Any:
    """The sum; where it is not exact that of its two neighbours whose last bit is set."""
    total, lost = _sum(a, b)
    toward = np.nextafter(total, np.where(lost > 0.0, np.inf, -np.inf))
    return np.where((lost != 0.0) & np.isfinite(total) & (_last_bits(total) == 0), toward, total)


def _last_bits(a: Any) -> Any:
    array = np.ascontiguousarray(a)
    whole = np.uint32 if array.dtype == np.float32 else np.uint64
    return (array.view(whole) & whole(1)).reshape(np.shape(a))
