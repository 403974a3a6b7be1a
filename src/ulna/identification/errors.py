"""What `ulna.identification` raises."""

from __future__ import annotations

from ulna.base import UlnaError


class IdentificationError(UlnaError):
    """A record that cannot be used, or a question about parameters that cannot be asked of it.

    Examples:
        >>> try:
        ...     ulna.Robust(sigmas=0)
        ... except ulna.IdentificationError as error:
        ...     print(error)
        Robust(sigmas=0): it is not positive. 2 is usual.
    """
