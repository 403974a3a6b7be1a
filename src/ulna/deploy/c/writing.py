"""The files of a C project, as texts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import DictLoader, Environment, StrictUndefined

from ulna.deploy.c.integers import fixed_words
from ulna.deploy.emulation import Cost
from ulna.deploy.firmware import Firmware, Port
from ulna.deploy.fixed_firmware import FixedFirmware
from ulna.deploy.target import Target
from ulna.loop import Fault, Hold, Pwm, Reaction, SafeOutput
from ulna.program import C_FLAGS, Operation, Precision, c_header, c_literal, c_statements

DESIGN = "design.json"
"""What of the folder a program reads: whose it is, and the hash of every file."""

_TEMPLATES = {
    "{name}.h": "header.h",
    "{name}.c": "source.c",
    "self_test.c": "self_test.c",
    "CMakeLists.txt": "CMakeLists.txt",
    "README.md": "README.md",
    "library.properties": "library.properties",
    "library.json": "library.json",
    "examples/control/control.ino": "control.ino",
}
"""Path in the project, and the template it is made from."""


def c_files(
    made: Firmware, target: Target, rows: np.ndarray, fixed: FixedFirmware | None = None, cost: Cost | None = None
) -> dict[str, str]:
    """Path → text of every file of the project.

    Args:
        made: what ships. target: for its flags. rows: (N, inputs) of the self-test, SI. fixed: the same in integers.
        cost: of a call, where it is known.
    """
    known = _words(made, target) | {"cost": cost}
    if fixed is None:
        known |= _number_words(made) | {"rows": _rows(made, (rows, made.run(rows)))}
    else:
        known |= fixed_words(fixed, rows)
    environment = _environment()
    texts = {
        path.format(name=made.name): environment.get_template(template).render(known)
        for path, template in _TEMPLATES.items()
    }
    design = {
        "written_by": f"ulna {version('ulna')}",
        "name": made.name,
        "design": made.fingerprint,
        "precision": made.precision.value,
        "fixed": None if fixed is None else {"factor": fixed.fixed.factor, "ranges": dict(fixed.fixed.ranges)},
        "target": target.name,
        "files": {path: hashlib.sha256(text.encode()).hexdigest() for path, text in texts.items()},
    }
    return {**texts, DESIGN: json.dumps(design, indent=2) + "\n"}


@cache
def _environment() -> Environment:
    place = files("ulna.deploy.c") / "templates"
    texts = {name: (place / name).read_text(encoding="utf-8") for name in _TEMPLATES.values()}
    # What users wrote reaches the text of C through `comment`, `quoted` and names made by `c_name`, never as it is.
    environment = Environment(
        loader=DictLoader(texts),
        autoescape=False,  # noqa: S701 - not HTML
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"comment": comment, "quoted": quoted, "cell": cell}
    return environment


def comment(text: Any) -> str:
    """The text inside a comment of C: one line that neither ends nor opens one, nor goes on on the next."""
    line = " ".join(str(text).split())
    shown = "".join(letter if letter.isprintable() else "?" for letter in line)
    return shown.replace("*/", "* /").replace("/*", "/ *").replace("//", "/ /").replace("\\", "/").replace("??", "? ?")


def quoted(text: Any) -> str:
    """The text inside double quotes of C or JSON: plain ASCII without quotes and backslashes."""
    return "".join(c if c.isascii() and c.isprintable() and c not in '"\\' else "?" for c in str(text))


def cell(text: Any) -> str:
    """The text inside a table of Markdown."""
    return comment(text).replace("|", "/").replace("<", "&lt;").replace("`", "'")


def _words(made: Firmware, target: Target) -> dict[str, Any]:
    """What the templates know."""
    hardware = made.hardware
    drives = dict(zip((p.signal.name for p in made.commands), made.loop.fit({}).drives, strict=True))
    supplies = {name: drive.supply for name, drive in drives.items() if isinstance(drive, Pwm)}
    ranges = list(zip(made.loop.wiring.references, made.loop.fit({}).ranges, strict=True))
    watched = {what: getattr(hardware, what) for what in ("guard", "deadline", "innovation")}
    return {
        "faults": [Fault.NOT_FINITE, *([Fault.LATE] if hardware.watches else [])],
        "reactions": {what: _reaction(each.reaction) for what, each in watched.items() if each is not None},
        "ranges": [(signal, bounds) for signal, bounds in ranges if bounds is not None],
        "unchecked": [signal for signal, bounds in ranges if bounds is None],
        "version": version("ulna"),
        "made": made,
        "target": target,
        "name": made.name,
        "guard_name": f"ULNA_{made.name.upper()}",
        "plant": made.loop.plant.name,
        "fingerprint": made.fingerprint,
        "hardware": hardware,
        "inf": float("inf"),
        "flags": " ".join(C_FLAGS),
        "inputs": [(port, _limits(port)) for port in made.inputs],
        "commands": [(port, _saturation(made, port)) for port in made.commands],
        "supply": {port.name: supplies[port.signal.name] for port in made.commands if port.signal.name in supplies},
        "delay_periods": hardware.delay / (hardware.period or 1.0),
    }


def _number_words(made: Firmware) -> dict[str, Any]:
    """What the templates know of a step on floating-point numbers."""
    locals_, lines, results = _body(made)
    by_slot = dict(zip(made.kernel.outputs, results, strict=True))
    sensors = zip(made.loop.wiring.measured, made.loop.fit({}).sensors, strict=True)
    steps = {signal.name: sensor.step for signal, sensor in sensors if sensor is not None}
    single = made.precision is Precision.SINGLE
    return {
        "fixed": None,
        "unit": lambda _, unit: unit or "1",
        "real": made.precision.value,
        "whole": "uint32_t" if single else "uint64_t",
        "c_head": c_header(made.precision, flips=Operation.FLIP in made.kernel.operations),
        "locals": locals_,
        "lines": lines,
        "new_memory": [(name, by_slot[slot]) for slot, name in made.memory.items()],
        "outputs": [(port.name, by_slot[port.slot]) for port in (*made.commands, *made.estimates)],
        "fault": by_slot["code"],
        "initial": [(name, c_literal(made.initial[slot], made.precision)) for slot, name in made.memory.items()],
        "literal": lambda value: c_literal(float(value), made.precision),
        "per_count": {port.name: steps[port.signal.name] for port in made.inputs if port.signal.name in steps},
        "operations": made.kernel.operation_count,
        "bytes": len(made.memory) * (4 if single else 8),
    }


def _body(made: Firmware) -> tuple[list[tuple[str, str]], list[str], list[str]]:
    """Locals (name, where it is read), statements, and the expressions of the results."""
    places = {slot: ("memory", name) for slot, name in made.memory.items()}
    places |= {port.slot: ("input", port.name) for port in made.inputs}
    places |= {"missed": ("input", "missed")}
    kernel = made.kernel
    used = {k for each in kernel.instructions for k in each.operands} | set(kernel.results)
    names, locals_ = [], []
    for k, slot in enumerate(kernel.inputs):
        owner, name = places[slot]
        names.append(f"{owner}_{name}")
        if k in used:
            read = f"({made.precision.value})input->missed" if slot == "missed" else f"{owner}->{name}"
            locals_.append((names[-1], read))
    pairs, results = c_statements(kernel, names, precision=made.precision)
    return locals_, [f"{name} = {text}" for name, text in pairs], results


def _reaction(reaction: Reaction) -> str:
    """What is commanded, as the end of a sentence."""
    if isinstance(reaction, SafeOutput):
        given = reaction.output
        if not isinstance(given, Mapping):
            return f"{given:g} is commanded"
        return ", ".join(f"{cell(name)} is commanded {value:g}" for name, value in given.items())
    return "the command is held" if isinstance(reaction, Hold) else "the controller goes on"


def _limits(port: Port) -> str:
    signal = port.signal
    low, high = ("" if each is None else f"{float(each):g}" for each in (signal.lower, signal.upper))
    return f"{low or '-inf'} … {high or 'inf'}" if low or high else ""


def _saturation(made: Firmware, port: Port) -> str:
    limit = made.loop.saturation.get(port.signal.name)
    return "" if limit is None else f"{limit.lower:g} … {limit.upper:g}"


def _rows(made: Firmware, vectors: tuple[np.ndarray, np.ndarray]) -> list[dict[str, list[str]]]:
    """Every sample of the self-test as literals."""
    given, expected = vectors

    def texts(row: np.ndarray) -> list[str]:
        return [c_literal(float(value), made.precision) for value in row]

    return [
        {"given": texts(row), "expected": texts(answer[:-1]), "fault": [str(int(answer[-1]))]}
        for row, answer in zip(given, expected, strict=True)
    ]
