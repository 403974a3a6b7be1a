"""What campaigns raise."""

from __future__ import annotations

from ulna.base import UlnaError


class CampaignError(UlnaError):
    """A campaign that cannot be planned, run, stored or read back.

    Examples:
        >>> try:
        ...     ulna.Uniform(low=2, high=1)
        ... except ulna.CampaignError as error:
        ...     print(error)
        Uniform(low=2, high=1): low is not below high. Give low < high.
    """
