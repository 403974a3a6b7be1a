"""`rehearsal`: what a chip would measure, from a short run of its loop in plain Python; no compiler is needed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ulna.deploy.errors import DeployError
from ulna.deploy.firmware import Firmware
from ulna.loop import Loop, applied, unrolled
from ulna.program import Kernel, to_python
from ulna.system import starting_point

PUSH = 0.1
"""SI, by which every state of the plant begins away from its operating point, and the size of references."""
EDGES = (0.3, -3.0, 30.0, -300.0, math.nan, math.inf, -math.inf, 1e30, 0.0, -0.0)
"""Values of all inputs, each at one of the last samples: commands reach their limits, numbers stop being finite."""

NUDGE = 1e-3
"""The same where an estimator watches its innovation: it should not lose the plant at once."""
FAR, LONGEST = 3e4, 50
"""SI, a value that no estimator follows, and how many samples of it a self-test holds at most."""


def rehearsal(made: Firmware, samples: int) -> np.ndarray:
    """(N, inputs) measured values and references of a run that begins off its operating point.

    The last samples are not from the run: values far off, not finite, huge or zero, one after the other, with a
    good sample between them, so that limits, faults and what comes after them are rehearsed, too.
    """
    run = _Run(made.loop)
    rows = []
    period = made.hardware.period or 0.0
    for k in range(samples):
        references = {f"r{j}": PUSH * math.sin(2.0 + j + 12.0 * k / samples) for j in range(len(made.loop.references))}
        # Some calls come late, where that is told.
        clock = {"elapsed": period * (3.0 if k % 11 == 5 else 1.0)}
        measured = run.sample(references | clock)
        if not all(map(math.isfinite, measured.values())):
            break
        known = {**references, **clock, **measured}
        rows.append([known[port.slot] for port in made.inputs] + ([float(k % 7 == 3)] if made.missed else []))
    last: list[float] = rows[-1] if rows else [0.0] * (len(made.inputs) + made.missed)
    for edge in EDGES:
        rows += [[edge] * len(made.inputs) + last[len(made.inputs) :], last]
    rows += [[FAR] * len(made.inputs) + last[len(made.inputs) :]] * _losing(made) + [last] * (_losing(made) > 0)
    return np.array(rows)


def _losing(made: Firmware) -> int:
    """How many values far off it takes to lose the plant; 0 where the self-test would grow too long."""
    limit = made.hardware.innovation
    return 0 if limit is None or limit.samples > LONGEST else limit.samples


class _Run:
    """Slots of a loop, and the kernels that work on them."""

    def __init__(self, loop: Loop) -> None:
        fitted, flow, step = loop.fit({}), loop.flow, loop.step
        missing = [p.name for p in loop.plant.parameters if p.si_value is None]
        if missing:
            raise DeployError(
                f"the self-test of '{loop.plant.name}'",
                f"parameters without a value: {', '.join(missing)}.",
                "Use plant.with_values(), or give the values in its file.",
            )
        self.numbers: Mapping[str, float] = {**step.numbers, **flow.numbers}
        self.slots: dict[str, float] = {}
        constants = {f"p{k}": float(p.si_value or 0) for k, p in enumerate(loop.plant.parameters)}
        self.slots |= {f"plant_{name}": value for name, value in constants.items()}
        found = _evaluated(flow.constants, constants)
        self.slots |= {f"plant_{name}": value for name, value in found.items()} | found
        point = starting_point(loop.plant).numbers
        self.slots |= {f"believed{k}": 0.0 for k in range(len(loop.wiring.driven))}
        push = PUSH if loop.hardware is None or loop.hardware.innovation is None else NUDGE
        self.slots |= {f"x{k}": float(point[s.name]) + push for k, s in enumerate(loop.plant.states)}
        self.outputs = _compiled((flow.outputs,))
        self.measured = len(loop.wiring.measured)
        self.work = _compiled((*step.stages, applied(fitted)))
        self.motion = _compiled(unrolled(flow.motion, self.numbers))
        self.period, self.count = fitted.period, 0

    def sample(self, references: Mapping[str, float]) -> dict[str, float]:
        """Measured values at the next sample; the plant then moves on to the one after it."""
        self.slots |= {**references} | {"time": self.count * self.period, "span": self.period}
        self._run(self.outputs)
        measured = {f"y{k}": self.slots[f"y{k}"] for k in range(self.measured)}
        measured |= {slot: value for slot, value in self.slots.items() if slot.startswith("believed")}
        try:
            self._run(self.work)
            self._run(self.motion)
        except (OverflowError, ValueError):
            self.slots["x0"] = math.nan
        self.count += 1
        return measured

    def _run(self, kernels: list[tuple[Kernel, Any]]) -> None:
        for kernel, evaluate in kernels:
            known = {**self.numbers, **self.slots}
            found = evaluate(*(known.get(name, 0.0) for name in kernel.inputs))
            self.slots |= dict(zip(kernel.outputs, found, strict=True))


def _evaluated(kernel: Kernel, known: Mapping[str, float]) -> dict[str, float]:
    return dict(zip(kernel.outputs, to_python(kernel)(*(known[name] for name in kernel.inputs)), strict=True))


def _compiled(kernels: tuple[Kernel, ...] | list[Kernel]) -> list[tuple[Kernel, Any]]:
    made = {id(each): to_python(each) for each in kernels}
    return [(each, made[id(each)]) for each in kernels]
