"""`verify`: whether a folder of C still is what was written, and still belongs to a design."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path

from ulna.base import Verdict
from ulna.deploy.c import DESIGN
from ulna.deploy.errors import DeployError
from ulna.loop import Loop, fingerprint
from ulna.program import Fused, Plain, Precision


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
    try:
        written = json.loads((place / DESIGN).read_text(encoding="utf-8"))
        files, precision = dict(written["files"]), Precision(written["precision"])
        name, design = str(written["name"]), str(written["design"])
    except OSError as error:
        raise DeployError(f"the folder '{place}'", f"its {DESIGN} cannot be read ({error.strerror}).") from None
    except (ValueError, KeyError, TypeError):
        raise DeployError(f"the folder '{place}'", f"its {DESIGN} is not one that ulna wrote.") from None
    changed, missing = [], []
    for path, expected in files.items():
        try:
            found = hashlib.sha256((place / path).read_bytes()).hexdigest()
        except OSError:
            missing.append(path)
        else:
            changed += [path] if found != expected else []
    now = None if loop is None else fingerprint(_in_precision(loop, precision))
    claim = f"the folder '{place}' is '{name}' of design {design}" + ("" if loop is None else ", as it is now")
    good = not changed and not missing and now in (None, design)
    evidence = {"changed": tuple(changed), "missing": tuple(missing), "design": design, "design_now": now}
    return Verdict.proved(claim, **evidence) if good else Verdict.refuted(claim, **evidence)


def _in_precision(loop: Loop, precision: Precision) -> Loop:
    """The loop as `firmware` takes it."""
    if loop.hardware is None:
        return loop
    kind = Fused if loop.hardware.arithmetic.fuses else Plain
    hardware = replace(loop.hardware, arithmetic=kind(precision=precision))
    return Loop(plant=loop.plant, controller=loop.controller, hardware=hardware)
