"""What the templates know of a step in fixed point."""

from __future__ import annotations

from typing import Any

import numpy as np

from ulna.deploy.fixed_firmware import REHEARSED, FixedFirmware
from ulna.program import integer_header, integer_literal, integer_statements


def fixed_words(made: FixedFirmware, rows: np.ndarray) -> dict[str, Any]:
    """The words of the templates that differ from those of floating-point numbers.

    Args:
        made: what ships. rows: (N, inputs) of the self-test, SI.
    """
    shipped, program = made.made, made.program
    locals_, lines, results = _body(made)
    by_slot = dict(zip(program.outputs, results, strict=True))
    ports = [*shipped.commands, *shipped.estimates]
    scales = {f"input.{port.name}": _scale(made, port.slot) for port in shipped.inputs}
    scales |= {f"output.{port.name}": (program.outputs[port.slot].point, "") for port in ports}
    given = made.integers(rows)
    answers = made.run_integers(given)
    return {
        "fixed": made.fixed,
        "real": "int32_t",
        "whole": "",
        "c_head": integer_header("\n".join([*lines, *(place for _, place in locals_)])),
        "locals": locals_,
        "lines": lines,
        "new_memory": [(name, by_slot[slot]) for slot, name in shipped.memory.items()],
        "outputs": [(port.name, by_slot[port.slot]) for port in ports],
        "fault": by_slot["code"],
        "initial": [
            (name, integer_literal(program.inputs[slot].integer(made.initial[slot])))
            for slot, name in shipped.memory.items()
        ],
        "literal": lambda value: str(int(value)),
        "per_count": {},
        "operations": len(program.instructions),
        "bytes": 4 * len(shipped.memory),
        "unit": lambda place, unit: _unit(*scales[place], unit),
        "rehearsed": REHEARSED,
        "points": {
            **{port.name: program.outputs[port.slot].point for port in ports},
            **{port.name: made.form_in(port.slot).point for port in shipped.inputs if port.slot not in made.counts},
        },
        "signal_ranges": made.ranges,
        "differences": [
            (port.name, port.signal.unit, made.bounds[port.name], made.seen[port.name], made.difference[port.name])
            for port in shipped.commands
        ],
        "doubts": made.doubts,
        "functions": program.functions,
        "rows": [
            {"given": [str(v) for v in row], "expected": [str(v) for v in answer[:-1]], "fault": [str(answer[-1])]}
            for row, answer in zip(given, answers, strict=True)
        ],
    }


def _unit(point: int, counted: str, unit: str) -> str:
    """What one unit of an integer is."""
    return (
        " ".join(filter(None, [counted, "" if counted == "microseconds" else unit]))
        if counted
        else f"2^{-point} {unit}"
    )


def _scale(made: FixedFirmware, slot: str) -> tuple[int, str]:
    """(binary point, what one unit is where the input is counted)."""
    step = made.counts.get(slot)
    if step is None:
        return made.form_in(slot).point, ""
    return 0, "microseconds" if slot == "elapsed" else f"counts of {step!r}"


def _body(made: FixedFirmware) -> tuple[list[tuple[str, str]], list[str], list[str]]:
    """Locals (name, where it is read), statements, and the expressions of the results."""
    shipped, program = made.made, made.program
    places = {slot: ("memory", name) for slot, name in shipped.memory.items()}
    places |= {port.slot: ("input", port.name) for port in shipped.inputs} | {"missed": ("input", "missed")}
    used = {k for each in program.instructions for k in each.operands} | set(program.results)
    names, locals_ = [], []
    for k, (slot, form) in enumerate(program.inputs.items()):
        owner, name = places[slot]
        names.append(f"{owner}_{name}")
        if k in used:
            read = f"{owner}->{name}"
            if owner == "input":
                low, high = map(integer_literal, form.ends)
                read = f"limited({read}, {low}, {high})"
            locals_.append((names[-1], read))
    pairs, results = integer_statements(program, names)
    return locals_, [f"{name} = {text}" for name, text in pairs], results
