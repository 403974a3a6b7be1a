"""What is known before a fit: priors such as `5 ± 12%`, bounds, noise; numbers in SI or with their unit."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from ulna.base import UnitError, dimension_text, unit
from ulna.identification.errors import IdentificationError
from ulna.identification.records import factor_of

_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_QUANTITY = re.compile(rf"\s*{_NUMBER}\s*((?:[^\W\d]|[°%]).*?)?\s*")
_PLUS_MINUS = re.compile(r"±|\+/-|\+-")


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """A value that is known to a standard deviation, SI."""

    mean: float
    std: float


def prior_of(given: Any, asked: str, *, value: float | None, unit_text: str) -> Prior:
    """The prior in a `Prior`, a pair (mean, standard deviation) or a text: `5 ± 12%`, `4.8 kg ± 0.2 kg`, `± 12%`.

    What follows ± is taken as one standard deviation.

    Args:
        given: the prior. asked: how an error names it. value: of the plant, for a text that begins with ±.
        unit_text: the parameter's unit, which another must measure the same as.

    Raises:
        IdentificationError: text that is not a prior, a standard deviation that is not positive.
    """
    if isinstance(given, Prior):
        found = given
    elif isinstance(given, str):
        found = _written(given, asked, value, unit_text)
    else:
        try:
            mean, std = (float(each) for each in given)
        except (TypeError, ValueError):
            raise IdentificationError(asked, f"{given!r} is not a prior.", 'Write "5 ± 12%" or (5, 0.6).') from None
        found = Prior(mean=mean, std=std)
    if not (found.std > 0.0 and math.isfinite(found.std) and math.isfinite(found.mean)):
        hint = "Give its uncertainty, or leave the parameter out of free=[…]."
        raise IdentificationError(asked, f"its standard deviation is {found.std:g}.", hint)
    return found


def bounds_of(given: Any, asked: str, *, unit_text: str) -> tuple[float, float]:
    """(lower, upper) in SI of a pair of numbers or texts with units; None stands for no bound.

    Raises:
        IdentificationError: no pair, or the wrong way round.
    """
    try:
        low, high = given
    except (TypeError, ValueError):
        raise IdentificationError(asked, f"{given!r} is not a pair.", "Write (0.1, 2).") from None
    lower = -math.inf if low is None else quantity(low, asked, unit_text=unit_text)
    upper = math.inf if high is None else quantity(high, asked, unit_text=unit_text)
    if not lower < upper:
        raise IdentificationError(asked, f"[{lower:g}, {upper:g}] is empty.", "Write (lower, upper).")
    return lower, upper


def quantity(given: Any, asked: str, *, unit_text: str) -> float:
    """The SI number of a number or a text such as `0.05 deg`.

    Raises:
        IdentificationError: anything else. UnitError: a unit of another dimension.
    """
    if not isinstance(given, str):
        try:
            return float(given)
        except (TypeError, ValueError):
            raise IdentificationError(asked, f"{given!r} is not a number.") from None
    match = _QUANTITY.fullmatch(given)
    if match is None:
        raise IdentificationError(asked, f"'{given}' is not a number with a unit.", "Write 0.05 or '3 deg'.")
    return float(match[1]) * (_factor(match[2], asked, unit_text) if match[2] else 1.0)


def _written(text: str, asked: str, value: float | None, unit_text: str) -> Prior:
    parts = _PLUS_MINUS.split(text)
    if len(parts) != 2:
        raise IdentificationError(
            asked, f"'{text}' is not a prior.", 'Write "5 ± 12%", or "± 12%" about the plant\'s own.'
        )
    left, right = (each.strip() for each in parts)
    if left:
        mean = quantity(left, asked, unit_text=unit_text)
    elif value is not None:
        mean = value
    else:
        raise IdentificationError(asked, f"'{text}' has no value, and the plant gives none.", 'Write "5 ± 12%".')
    if right.endswith("%"):
        share = quantity(right[:-1].strip(), asked, unit_text="")
        return Prior(mean=mean, std=abs(mean) * share / 100.0)
    # A unit may stand once, on either side.
    one = _QUANTITY.fullmatch(left)
    written = one[2] if one is not None and one[2] else ""
    two = _QUANTITY.fullmatch(right)
    if two is not None and not two[2] and written:
        right = f"{right} {written}"
    elif two is not None and two[2] and left and not written:
        mean = quantity(f"{left} {two[2]}", asked, unit_text=unit_text)
    return Prior(mean=mean, std=quantity(right, asked, unit_text=unit_text))


def _factor(text: str, asked: str, wanted: str) -> float:
    try:
        found = unit(text)
    except UnitError as error:
        raise UnitError(asked, f"the {error.asked}: {error.found}", error.hint) from None
    if wanted and found.dimension != unit(wanted).dimension:
        due = dimension_text(unit(wanted).dimension)
        raise UnitError(asked, f"'{text}' measures {dimension_text(found.dimension)}, due is {due}.", f"Use {wanted}.")
    return factor_of(text)
