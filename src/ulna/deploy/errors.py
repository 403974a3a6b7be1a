"""What `ulna.deploy` raises."""

from __future__ import annotations

from ulna.base import UlnaError


class DeployError(UlnaError):
    """A loop that cannot be shipped, a folder that cannot be written, a compiler that is not there."""
