"""`c_project`: a folder of C that computes what was simulated."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from ulna.deploy.c import c_files
from ulna.deploy.emulation import Cost, cost_of
from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import Firmware, firmware
from ulna.deploy.fixed_firmware import FixedFirmware, fixed_firmware
from ulna.deploy.fixed_point import FixedPoint
from ulna.deploy.rehearsal import rehearsal
from ulna.deploy.target import TARGETS, Target
from ulna.loop import Loop
from ulna.program import Precision

VECTORS = 200
"""Samples of a run that the self-test holds."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CProject:
    """A folder of C.

    Attributes:
        folder: where it lies. firmware: what it computes. target: what it was written for.
        files: paths in the folder. fixed: the step in integers, where it computes in these.
        cost: instructions, stack and code of a call, where they were asked for.
    """

    folder: Path
    firmware: Firmware
    target: Target
    files: tuple[str, ...]
    fixed: FixedFirmware | None = None
    cost: Cost | None = None

    @property
    def operations(self) -> int:
        """Of a call."""
        return self.firmware.kernel.operation_count if self.fixed is None else len(self.fixed.program.instructions)

    def __repr__(self) -> str:
        made, fixed = self.firmware, self.fixed
        kind = made.precision.value if fixed is None else fixed.fixed.name
        accuracy = "" if fixed is None else f"; {fixed.accuracy}"
        return (
            f"CProject '{made.name}' in {self.folder}: {self.operations} operations on "
            f"{kind} every {made.hardware.period} s, design {made.fingerprint}{accuracy}"
            + ("" if self.cost is None else f"; {self.cost}")
        )


def c_project(
    loop: Loop,
    folder: str | os.PathLike[str],
    *,
    name: str = "",
    target: str | Target = "generic",
    precision: Precision | str | None = None,
    arithmetic: FixedPoint | None = None,
    initial: Mapping[str, float] | None = None,
    measure: bool = False,
) -> CProject:
    """A folder with the processor's step of a loop as a C99 library and a self-test, written whole or not at all.

    Args:
        loop: with `Hardware(period=...)`; `arithmetic=Plain()` gives the same bits on every processor.
        folder: to be made; an empty one is taken.
        name: of the library; that of the plant if left out.
        target: one of `TARGETS`, or its name.
        precision: "float" or "double"; what the target computes in hardware if left out.
        arithmetic: `FixedPoint(...)` for integers instead.
        initial: SI values of the controller's states and of the driven inputs before the first sample, by name.
        measure: count instructions, stack and code of a call on an emulated processor, for the README: needs a target
            that is a processor, its compiler, and QEMU.

    Returns:
        The folder and what it computes.

    Raises:
        DeployError: a loop without controller or processor, a target that is not known, a folder that is not empty or
            cannot be written, names that clash in C; where costs are measured, as `cost_of`.
    """
    aim = _target(target)
    kind = aim.precision if precision is None else Precision(precision)
    place = Path(folder)
    _check_free(place)
    if arithmetic is not None and precision is not None:
        raise DeployError(f"precision '{kind}' and FixedPoint(...)", "both choose the number format.", "Leave one out.")
    fixed = None if arithmetic is None else fixed_firmware(loop, arithmetic, name=name, initial=initial)
    made = firmware(loop, name=name, precision=kind, initial=initial) if fixed is None else fixed.made
    rows = rehearsal(made, VECTORS)
    texts, cost = c_files(made, aim, rows, fixed), None
    if measure:
        with tempfile.TemporaryDirectory(prefix="ulna-") as work:
            _write(Path(work) / "c", texts)
            cost = cost_of(Path(work) / "c", made.name, aim)
        texts = c_files(made, aim, rows, fixed, cost)
    _write(place, texts)
    return CProject(folder=place, firmware=made, target=aim, files=tuple(texts), fixed=fixed, cost=cost)


def _target(asked: str | Target) -> Target:
    if isinstance(asked, Target):
        return asked
    if asked not in TARGETS:
        close = get_close_matches(asked, TARGETS, n=1)
        hint = f"Did you mean '{close[0]}'? " if close else ""
        raise DeployError(f"target '{asked}'", "it is not known.", f"{hint}Known: {', '.join(TARGETS)}.")
    return TARGETS[asked]


def _check_free(place: Path) -> None:
    if place.is_dir():
        if any(place.iterdir()):
            raise DeployError(f"the folder '{place}'", "it is not empty.", "Name a new folder, or empty this one.")
    elif place.exists():
        raise DeployError(f"the folder '{place}'", "there is a file of this name.", "Name a new folder.")


def _write(place: Path, texts: Mapping[str, str]) -> None:
    """All files, in a folder beside the final one that takes its place at the end."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(dir=place.parent, prefix=f".{place.name}."))
    except OSError as error:
        raise DeployError(f"the folder '{place}'", f"it cannot be written ({error.strerror}).") from None
    try:
        for path, text in texts.items():
            target = work / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
        work.chmod(0o777 & ~_umask())
        work.replace(place)
    except OSError as error:
        raise DeployError(f"the folder '{place}'", f"it cannot be written ({error.strerror}).") from None
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
