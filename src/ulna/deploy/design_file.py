"""`design.json` of a folder: whose it is, and the hash of every file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ulna.base import text_of_file
from ulna.deploy.c import DESIGN
from ulna.deploy.errors import DeployError
from ulna.deploy.fixed_point import FixedPoint
from ulna.program import Precision


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """What a folder says of itself.

    Attributes:
        name: of the library. design: hash of plant, design and hardware. precision: of its numbers.
        fixed: bits and ranges, where these are integers.
        files: hash of each file by its path.
    """

    name: str
    design: str
    precision: Precision
    fixed: FixedPoint | None
    files: Mapping[str, str]


def read_design(folder: Path) -> Design:
    """What a folder says of itself.

    Raises:
        DeployError: a folder that `c_project` did not write.
    """
    try:
        data = json.loads(text_of_file(folder / DESIGN, most=1_000_000))
        return Design(
            name=str(data["name"]),
            design=str(data["design"]),
            precision=Precision(data["precision"]),
            fixed=_fixed(data.get("fixed")),
            files={str(path): str(value) for path, value in data["files"].items()},
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise DeployError(
            f"the folder '{folder}'", f"it has no {DESIGN} that ulna wrote.", "Export it again."
        ) from None


def _fixed(data: Any) -> FixedPoint | None:
    if data is None:
        return None
    ranges = {str(name): (float(low), float(high)) for name, (low, high) in data["ranges"].items()}
    return FixedPoint(factor=int(data["factor"]), ranges=ranges)
