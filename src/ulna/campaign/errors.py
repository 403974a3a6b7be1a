"""What campaigns raise."""

from __future__ import annotations

from ulna.base import UlnaError


class CampaignError(UlnaError):
    """A campaign that cannot be planned, run, stored or read back."""
