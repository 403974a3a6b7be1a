"""What `ulna.certify` raises."""

from __future__ import annotations

from ulna.base import UlnaError


class CertifyError(UlnaError):
    """A loop that no theorem here covers, a claim that cannot be read, a file that is not a certificate."""


class ChangedError(CertifyError):
    """A certificate's file that is not as it was written."""
