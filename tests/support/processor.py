"""A processor in plain Python: the kernels of a loop's step and flow, run sample after sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ulna.loop import Hardware, Loop, Steps, applied, unrolled
from ulna.loop.flow import flow as flow_of
from ulna.loop.step import step as step_of
from ulna.program import to_python
from ulna.system import Parameter, Signal, System, system_from_mapping


def static(name: str, inputs: list[str], outputs: dict[str, str], **parameters: float) -> System:
    """A system without states; a plant file always has some."""
    table = {
        "name": name,
        "states": {"nothing": "0"},
        "inputs": {each: {} for each in inputs},
        "outputs": outputs,
        "parameters": {p: {"value": v} for p, v in parameters.items()},
    }
    read = system_from_mapping(table)
    return System(
        name=name,
        states=(),
        rates=(),
        inputs=tuple(Signal(name=each) for each in inputs),
        outputs=read.outputs,
        readouts=read.readouts,
        parameters=tuple(Parameter(name=p.name, value=p.value) for p in read.parameters),
    )


class Processor:
    """Slots of a loop, and what happens to them."""

    def __init__(self, loop: Loop, parameters: Mapping[str, float] | None = None, **slots: float) -> None:
        self.loop = loop
        fitted = loop.fit(parameters or {})
        step, flow = step_of(fitted), flow_of(fitted, Steps(), {})
        self.numbers = {**step.numbers, **flow.numbers}
        self.slots: dict[str, float] = dict(slots)
        self.stages = [(each, to_python(each)) for each in (*step.stages, applied(fitted))]
        self.motion = [(each, to_python(each)) for each in unrolled(flow.motion, flow.numbers)]
        self.outputs = flow.outputs

    def run(self, kernel: Any, evaluate: Any) -> None:
        known = {**self.numbers, **self.slots}
        found = evaluate(*(known.get(name, 0.0) for name in kernel.inputs))
        self.slots |= dict(zip(kernel.outputs, found, strict=True))

    def sample(self, **given: float) -> dict[str, float]:
        """One sample: measured values y0 …, references r0 …; all slots after it."""
        self.slots |= given
        for kernel, evaluate in self.stages:
            self.run(kernel, evaluate)
        return dict(self.slots)

    def period(self, *, start: float, length: float) -> dict[str, float]:
        """The plant until the next sample; all slots after it."""
        self.slots |= {"time": start, "span": length}
        for kernel, evaluate in self.motion:
            self.run(kernel, evaluate)
        return dict(self.slots)


def hardware(**parts: Any) -> Hardware:
    return Hardware(**{"period": 0.01, **parts})
