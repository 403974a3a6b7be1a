"""`verify`: whether a folder of C still is what was written, and still belongs to a design."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from ulna.base import Verdict
from ulna.deploy.design_file import read_design
from ulna.deploy.firmware import in_precision
from ulna.loop import Loop, fingerprint


def verify(folder: str | os.PathLike[str], loop: Loop | None = None) -> Verdict:
    """Whether every file is as it was written, and, with a loop, whether the folder belongs to it.

    Args:
        folder: written by `c_project`. loop: the design as it is now, with its hardware.

    Returns:
        Proved by equal hashes, or refuted; the evidence holds `changed` files, `missing` ones, and both `designs`.

    Raises:
        DeployError: a folder that `c_project` did not write.
    """
    place = Path(folder)
    written = read_design(place)
    changed, missing = [], []
    for path, expected in written.files.items():
        try:
            found = hashlib.sha256((place / path).read_bytes()).hexdigest()
        except OSError:
            missing.append(path)
        else:
            changed += [path] if found != expected else []
    now = None if loop is None else fingerprint(in_precision(loop, written.precision))
    claim = f"the folder '{place}' is '{written.name}' of design {written.design}" + (
        "" if loop is None else ", as it is now"
    )
    good = not changed and not missing and now in (None, written.design)
    evidence = {"changed": tuple(changed), "missing": tuple(missing), "design": written.design, "design_now": now}
    return Verdict.proved(claim, **evidence) if good else Verdict.refuted(claim, **evidence)
