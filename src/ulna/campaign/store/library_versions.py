"""Versions of what the bits of a result depend on besides the settings."""

from __future__ import annotations

import importlib.metadata
import platform
import sys
from collections.abc import Mapping
from functools import lru_cache

from ulna.campaign.errors import CampaignError

_WATCHED = ("ulna", "heyoka", "numba", "llvmlite", "numpy", "scipy", "sympy")


@lru_cache(maxsize=1)
def versions() -> Mapping[str, str]:
    """Versions by name: libraries, Python and the kind of processor."""
    found = {"python": platform.python_version(), "machine": f"{sys.platform} {platform.machine()}"}
    for name in _WATCHED:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def changed_versions(begun: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """What is another version than when the campaign was begun, by name: (then, now)."""
    now = versions()
    return {name: (then, now.get(name, "")) for name, then in begun.items() if then != now.get(name)}


def check_versions(begun: Mapping[str, str], asked: str) -> None:
    """Refuse to mix results of different libraries.

    Raises:
        CampaignError: naming what differs.
    """
    differing = [f"{name} {then} (here {now})" for name, (then, now) in changed_versions(begun).items()]
    if differing:
        raise CampaignError(
            asked,
            f"the campaign was begun with {', '.join(differing)}.",
            "Results of both would differ in their last bits: install those versions, or give another folder.",
        )
