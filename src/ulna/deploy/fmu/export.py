"""`fmu`: a loop, its controller or its plant as an FMU for co-simulation."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ulna.deploy.errors import DeployError
from ulna.deploy.fmu.description import build_description, description
from ulna.deploy.fmu.models import controller_model, loop_model, plant_model
from ulna.deploy.fmu.part import FmuPart, Model
from ulna.deploy.fmu.source import sources
from ulna.loop import Loop
from ulna.program import C_FLAGS

STEP = 1e-3
"""s, the longest step of a plant alone."""

_MACHINES = {"AMD64": "x86_64", "arm64": "aarch64"}


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuFile:
    """An FMU.

    Attributes:
        path: of the file. part: what it holds. version: of FMI. design: the hash of plant, design and hardware.
        inputs, outputs, parameters: names of variables. platform: that its binary is for, "" where it has none.
    """

    path: Path
    part: FmuPart
    version: int
    design: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    platform: str


def fmu(
    loop: Loop,
    path: str | os.PathLike[str],
    *,
    part: FmuPart | str = FmuPart.LOOP,
    version: int = 3,
    initial: Mapping[str, float] | None = None,
    steps: int | None = None,
    step: float = STEP,
    compiler: str = "cc",
) -> FmuFile:
    """An FMU for co-simulation, FMI 3.0 or 2.0, as written: own C, a binary for this machine where it has a compiler.

    The processor samples every period from the start on, whatever the communication steps are: shorter ones show the
    motion between two samples and change no bit of it, longer ones hold several. Inputs count from the next sample on;
    those of a plant alone are held over a communication step. Sensors have no noise in an FMU.

    Args:
        loop: with a processor, unless the plant alone is asked for.
        path: of the file to be made. part: the loop, its controller or its plant. version: 2 or 3.
        initial: SI values by name of states of plant and controller and of driven inputs at the start; importers may
            set others.
        steps: Runge-Kutta steps of the plant in each stretch of constant input; left out, as many as a run near the
            operating point takes, as `FixedSteps()` would. step: s, the longest step of a plant alone.
        compiler: of this machine; without it the FMU holds sources only.

    Raises:
        DeployError: a loop without controller or period, a random clock, a file that exists or cannot be written, a
            version that is none, C that does not compile.
    """
    place, kind = Path(path), FmuPart(part)
    if version not in (2, 3):
        raise DeployError(f"FMI {version}", "FMI 2.0 and 3.0 are supported.", "Give version=3 or version=2.")
    if place.exists():
        raise DeployError(f"the file '{place}'", "it exists already.", "Name a new one, or remove it.")
    model = _model(loop, kind, dict(initial or {}), steps, step)
    token = f"{{{model.fingerprint}-{kind}}}"
    texts = {f"sources/{name}": text for name, text in sources(model, version, token).items()}
    texts |= {"modelDescription.xml": description(model, version, token)}
    texts |= {"sources/buildDescription.xml": build_description(model)} if version == 3 else {}
    binary = _compiled(texts, model, version, compiler)
    _write(place, texts, binary)
    return FmuFile(
        path=place,
        part=kind,
        version=version,
        design=model.fingerprint,
        inputs=_names(model, "input"),
        outputs=_names(model, "output"),
        parameters=_names(model, "parameter"),
        platform=_platform(version) if binary else "",
    )


def _model(loop: Loop, part: FmuPart, initial: Mapping[str, float], steps: int | None, step: float) -> Model:
    if steps is not None and steps < 1:
        raise DeployError(f"steps={steps}", "expected at least one step.", "Leave it out.")
    if part is FmuPart.PLANT:
        if not step > 0.0:
            raise DeployError(f"step={step}", "expected a positive time in s.", "Leave it out.")
        return plant_model(loop.plant, initial, step)
    return controller_model(loop, initial) if part is FmuPart.CONTROLLER else loop_model(loop, initial, steps)


def _names(model: Model, causality: str) -> tuple[str, ...]:
    return tuple(v.name for v in model.variables if v.causality == causality)


def _platform(version: int) -> str:
    """The folder of binaries of this machine."""
    machine = _MACHINES.get(platform.machine(), platform.machine())
    system = {"Linux": "linux", "Darwin": "darwin", "Windows": "windows"}.get(platform.system(), "linux")
    if version == 3:
        return f"{machine}-{system}"
    return {"linux": "linux", "darwin": "darwin", "windows": "win"}[system] + ("64" if "64" in machine else "32")


def _compiled(texts: Mapping[str, str], model: Model, version: int, compiler: str) -> tuple[str, bytes] | None:
    """(path in the FMU, the library); None without a compiler."""
    program = shutil.which(compiler)
    if program is None:
        return None
    end = {"Darwin": ".dylib", "Windows": ".dll"}.get(platform.system(), ".so")
    with tempfile.TemporaryDirectory(prefix="ulna-") as work:
        names = [name for name in texts if name.startswith("sources/") and name.endswith((".c", ".h"))]
        for name in names:
            (Path(work) / Path(name).name).write_text(texts[name], encoding="utf-8")
        files = [str(Path(work) / Path(name).name) for name in names if name.endswith(".c")]
        made = Path(work) / f"{model.identifier}{end}"
        flags = [*C_FLAGS, "-O2", "-fPIC", "-shared", "-fvisibility=hidden"]
        done = subprocess.run(  # noqa: S603 - a compiler on files that ulna wrote
            [program, *flags, *files, "-o", str(made), "-lm"], capture_output=True, text=True, check=False
        )
        if done.returncode:
            lines = done.stderr.strip().splitlines() or ["no message"]
            raise DeployError("the C of an FMU", f"{compiler} refuses it: {lines[0]}", "Name another compiler.")
        return f"binaries/{_platform(version)}/{made.name}", made.read_bytes()


def _write(place: Path, texts: Mapping[str, str], binary: tuple[str, bytes] | None) -> None:
    """The archive, whole or not at all; equal FMUs are equal files."""
    part = place.with_name(f".{place.name}.part")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in [*texts.items(), *([binary] if binary else [])]:
                archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
        part.replace(place)
    except OSError as error:
        raise DeployError(f"the file '{place}'", f"it cannot be written ({error.strerror}).") from None
    finally:
        part.unlink(missing_ok=True)
