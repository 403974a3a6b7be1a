"""`Compiled`: the C of a folder computes the samples of a simulated run: software in the loop."""

from __future__ import annotations

import ctypes
import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ulna.deploy.design_file import read_design
from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import Firmware, firmware
from ulna.deploy.fixed_firmware import FixedFirmware, fixed_firmware
from ulna.deploy.library import library
from ulna.loop import Loop
from ulna.sim import AbstractProcessor, ForeignStep


@dataclass(frozen=True, slots=True, eq=False)
class Compiled(AbstractProcessor):
    """`simulate(loop, ..., engine=Compiled(folder))`: the folder's C in place of the simulator's step.

    Plant, noise, clock, delay and drive stay the simulator's; quantiser, estimator, law, limits and guard are the
    folder's, in its precision or in integers, which SI values are turned into and back. Commands before their limits,
    which C does not tell, are computed beside it from its memory. Where a run names no initial value of the controller,
    the memory begins as the folder's `init` fills it. The C is compiled when a loop is first run; what was changed in
    it by hand is run as it stands.

    Args:
        folder: written by `c_project` from this loop.
        compiler: a C compiler for this machine.

    Raises:
        DeployError: when run: a folder of another design, no compiler, C that does not compile.
    """

    folder: str | os.PathLike[str]
    compiler: str = "cc"

    def step_of(self, loop: Loop) -> ForeignStep:
        """The C as a step of the loop."""
        place = Path(self.folder)
        written = read_design(place)
        fixed = None if written.fixed is None else fixed_firmware(loop, written.fixed, name=written.name)
        made = firmware(loop, name=written.name, precision=written.precision) if fixed is None else fixed.made
        if made.fingerprint != written.design:
            raise DeployError(
                f"Compiled('{place}') in the loop of '{loop.plant.name}'",
                f"the folder is of design {written.design}, the loop is {made.fingerprint}.",
                "Export it again, or give the loop that it was written from.",
            )
        symbol = "ulna_" + _hash(place, written.name, self.compiler)
        loaded = library(place, written.name, _harness(made, symbol, fixed), self.compiler)
        return ForeignStep(
            symbol=symbol,
            address=ctypes.cast(getattr(loaded, symbol), ctypes.c_void_p).value or 0,
            inputs=_inputs(made),
            outputs=_outputs(made),
            initial=_initial(made, loaded),
            library=loaded,
        )


def _hash(place: Path, name: str, compiler: str) -> str:
    parts = [(place / f"{name}.{end}").read_bytes() for end in ("h", "c")]
    return hashlib.sha256(b"\0".join([*parts, compiler.encode()])).hexdigest()[:24]


def _inputs(made: Firmware) -> tuple[str, ...]:
    return (*made.memory, *(port.slot for port in made.inputs), *(["missed"] if made.missed else []))


def _outputs(made: Firmware) -> tuple[str, ...]:
    """Slots told; whether the first sample has been is what the simulator knows."""
    shown = [port.slot for port in (*made.commands, *made.estimates)]
    return (*shown, *(slot for slot in made.memory if slot not in {*shown, "begun"}), "code", "fault")


def _initial(made: Firmware, loaded: ctypes.CDLL) -> dict[str, float]:
    """What `init` fills in, by the names of the signals."""
    values = np.zeros(max(1, len(made.memory)))
    loaded.ulna_begin.argtypes, loaded.ulna_begin.restype = [ctypes.c_void_p], None
    loaded.ulna_begin(values.ctypes.data)
    slots = dict(zip(made.memory, values.tolist(), strict=False))
    wiring = made.loop.wiring
    found = {s.name: slots.get(f"z{k}", 0.0) for k, s in enumerate(wiring.memory)}
    held = [(s.name, slots.get(f"h{k}_0", slots.get(f"believed{k}", 0.0))) for k, s in enumerate(wiring.driven)]
    return found | dict(held)


_INTEGER = """
static int32_t integer(double value, double low, double high, int point)
{
    return isnan(value) ? 0 : (int32_t)floor(ldexp(fmin(fmax(value, low), high), point) + 0.5);
}
"""


def _harness(made: Firmware, symbol: str, fixed: FixedFirmware | None) -> str:
    """Functions over rows of numbers: the memory that `init` fills, and one sample."""
    name, real = made.name, made.precision.value

    def taken(slot: str, text: str) -> str:
        if fixed is None:
            return f"({real}){text}"
        form = fixed.form_in(slot)
        return f"integer({text} / {fixed.counts.get(slot, 1.0)!r}, {form.lower!r}, {form.upper!r}, {form.point})"

    def shown_as(slot: str, text: str) -> str:
        return text if fixed is None else f"ldexp({text}, {-fixed.program.outputs[slot].point})"

    memory, shown = list(made.memory.items()), (*made.commands, *made.estimates)
    given = [(slot, f"memory.{label}") for slot, label in memory]
    given += [(port.slot, f"input.{port.name}") for port in made.inputs]
    lines = [f"{place} = {taken(slot, f'given[{k}]')};" for k, (slot, place) in enumerate(given)]
    lines += [f"input.missed = given[{len(given)}] != 0.0;"] if made.missed else []
    labels = {slot: f"memory.{n}" for slot, n in memory} | {port.slot: f"output.{port.name}" for port in shown}
    told = [f"told[{k}] = {shown_as(slot, labels[slot])};" for k, slot in enumerate(_outputs(made)[:-2])]
    told += [f"told[{len(told)}] = output.fault;", f"told[{len(told) + 1}] = (output.fault & 1) ? NAN : 0.0;"]
    begun = [f"values[{k}] = {shown_as(slot, f'memory.{label}')};" for k, (slot, label) in enumerate(memory)]
    step = [*lines, f"{name}_step(&memory, &input, &output);", *told]
    return (
        f"#include <math.h>\n{_INTEGER if fixed is not None else ''}"
        f"void ulna_begin(double *values)\n{{\n    {name}_memory memory;\n"
        f"    {name}_init(&memory);\n    (void)values;\n    {_lines(begun)}\n}}\n"
        f"void {symbol}(const double *given, double *told)\n{{\n    {name}_memory memory;\n"
        f"    {name}_input input;\n    {name}_output output;\n    {_lines(step)}\n}}\n"
    )


def _lines(texts: list[str]) -> str:
    return "\n    ".join(texts)
