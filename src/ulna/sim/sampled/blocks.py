"""What a run does at each sample, put together from the kernels of a loop: blocks of work over named slots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ulna.loop import Fitted, Flow, Program, Repeat, SafeOutput, Step, applied
from ulna.program import Assembly, Kernel, Scalar, chained, restricted
from ulna.sim.figures import BAND
from ulna.sim.sampled.figures import effort, entries, output_figures
from ulna.sim.sampled.foreign import ForeignStep, to_the_drive

TABLE = "table_"
"""Begins the name of what a run begins with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """A random number of each sample: `kind` is "normal" or "uniform", `stream` its place among those of a sample.

    `ahead` samples ahead of the present one: a jittered clock draws the next instant.
    """

    kind: str
    stream: int
    ahead: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Columns:
    """Columns `begin` to `end` of what a run begins with: slots `<stem><first>`, and those that follow."""

    stem: str
    first: int
    begin: int
    end: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Blocks:
    """A sampled loop as blocks; within a block every run of a group is worked on before the next block begins.

    A name is a slot, one number for each run, unless it is among `numbers`, `shared` or `paths`.

    Attributes:
        begin: what each run begins with (`table_<name>`) → slots at time 0.
        samples: at each sample: measure, advance, figures; then command and drive.
        entries: when an output came into its band; seldom.
        motion: from one sample to the next; it ends with `check`.
        pace: at some samples. check: |x|² as `norm`, and whether a run is in `trouble`.
        draws: slots of random numbers. streams: of a sample.
        numbers: SI values of names that hold for all runs and samples.
        tables: names that are the same for all runs at a sample. paths: slots read from samples of each run's own.
        columns: what each run begins with.
    """

    begin: Kernel
    samples: tuple[Kernel | ForeignStep, ...]
    entries: Kernel
    motion: Program
    check: Kernel
    pace: Kernel
    draws: Mapping[str, Draw]
    streams: int
    numbers: Mapping[str, float]
    tables: tuple[str, ...]
    paths: tuple[str, ...]
    columns: tuple[Columns, ...]
    jittered: bool
    states: int


def blocks(
    loop: Fitted,
    step: Step,
    flow: Flow,
    *,
    disturbances: int,
    paths: tuple[str, ...],
    ramps: bool,
    bound: float,
    foreign: ForeignStep | None = None,
) -> Blocks:
    """The blocks of a loop.

    Args:
        loop: hardware and wiring. step, flow: its kernels. disturbances: how many are slots.
        paths: slots that are read from samples of each run's own, among `r<k>`, `d<k>` and `noise<k>`.
        ramps: whether disturbances have slopes. bound: of the norm of the plant's state.
        foreign: what computes the samples in place of the step.
    """
    wiring, plant = loop.wiring, loop.wiring.plant
    driven, outputs, states = len(wiring.driven), len(plant.outputs), len(plant.states)
    around = _surroundings(len(wiring.references), disturbances, paths)
    check = _check(loop, states)
    first = _begin(loop, flow, around, disturbances)
    sensed = [*_clock(loop), around, flow.outputs, output_figures(outputs)]
    before = chained("before", [_kept(loop, states), effort(driven, split=loop.split)])
    return Blocks(
        begin=first,
        samples=_samples(loop, step, around, sensed, foreign),
        entries=entries(outputs),
        motion=_merged((before, *_within(around, flow.motion), check)),
        check=check,
        pace=restricted(chained("pace", [around, flow.pace]), ["pace"]),
        draws=_draws(loop, paths),
        streams=2 * len(wiring.measured) + 2,
        numbers={**flow.numbers, "bound_square": bound**2, "band": BAND}
        | {f"std{name.removeprefix('noise')}": 1.0 for name in paths if name.startswith("noise")},
        tables=_tables(len(wiring.references), disturbances, ramps=ramps),
        paths=paths,
        columns=_columns(tuple(name for name in first.inputs if name.startswith(TABLE))),
        jittered=loop.hardware.jitter is not None,
        states=states,
    )


def _samples(
    loop: Fitted, step: Step, around: Kernel, sensed: list[Kernel], foreign: ForeignStep | None
) -> tuple[Kernel | ForeignStep, ...]:
    """What happens at a sample; of a foreign step the kernels compute only what it does not tell."""
    if foreign is None:
        commanded = [around, step.stages[1], applied(loop)]
        return chained("sensed", [*sensed, step.stages[0]]), chained("commanded", commanded)
    told = {*foreign.outputs, "begun", "fault"}
    told |= {f"{stem}{k}" for stem in ("late", "early", "believed") for k in range(len(loop.wiring.driven))}
    rest = restricted(step.kernel, [name for name in step.kernel.outputs if name not in told])
    driven = chained("driven", [to_the_drive(loop), applied(loop)])
    return chained("sensed", [*sensed, rest]), chained("around", [around]), foreign, driven


def _columns(names: tuple[str, ...]) -> tuple[Columns, ...]:
    found: list[Columns] = []
    for column, name in enumerate(names):
        stem = name.removeprefix(TABLE).rstrip("0123456789")
        number, last = int(name.removeprefix(TABLE + stem)), found[-1] if found else None
        if last is not None and last.stem == stem and number - last.first == column - last.begin:
            found[-1] = replace(last, end=column + 1)
        else:
            found.append(Columns(stem=stem, first=number, begin=column, end=column + 1))
    return tuple(found)


def _tables(references: int, disturbances: int, *, ramps: bool) -> tuple[str, ...]:
    names = [f"reference{k}" for k in range(references)] + [f"other{k}" for k in range(disturbances)]
    return (*names, *(f"slope{k}" for k in range(disturbances if ramps else 0)))


def _surroundings(references: int, disturbances: int, paths: tuple[str, ...]) -> Kernel:
    """References and disturbances of a run at a sample: what all runs share, and what it adds of its own."""
    w = Assembly("surroundings")
    found: dict[str, Scalar] = {}
    for stem, table, count in (("r", "reference", references), ("d", "other", disturbances)):
        for k in range(count):
            if f"{stem}{k}" not in paths:
                found[f"{stem}{k}"] = w.input(f"{table}{k}") + w.input(f"own_{stem}{k}")
    return w.finished(found)


def _begin(loop: Fitted, flow: Flow, around: Kernel, disturbances: int) -> Kernel:
    """Every slot that does not begin at 0."""
    w, wiring = Assembly("begin"), loop.wiring
    plant = wiring.plant
    found = {f"x{k}": w.input(f"{TABLE}x{k}") for k in range(len(plant.states))}
    found |= {f"z{k}": w.input(f"{TABLE}z{k}") for k in range(len(wiring.memory))}
    for k in range(len(wiring.driven)):
        held = w.input(f"{TABLE}u{k}")
        names = [f"c{k}", f"believed{k}", f"ua{k}", f"ub{k}", *(f"h{k}_{j}" for j in range(loop.whole_delay + 2))]
        found |= dict.fromkeys(names, held)
    for stem, count in (("r", len(wiring.references)), ("d", disturbances)):
        found |= {f"own_{stem}{k}": w.input(f"{TABLE}{stem}{k}") for k in range(count)}
    parameters = {f"p{k}": w.input(f"{TABLE}p{k}") for k in range(len(plant.parameters))}
    found |= {f"plant_{name}": value for name, value in parameters.items()}
    found |= {f"plant_{name}": value for name, value in w.call(flow.constants, parameters).items()}
    if loop.hardware.jitter:
        found["time"] = found["next"] = w.input("jitter") * w.input("uniform_jitter")
    known = found | w.call(around, found)
    known |= {f"noise{k}": w.constant(0.0) for k in range(len(wiring.measured))}
    for k, value in enumerate(row(w.call(flow.outputs, known), "o")):
        target = w.input(f"{TABLE}target{k}")
        found |= {f"target{k}": target, f"band{k}": w.input("band") * abs(target - value)}
        found |= dict.fromkeys([f"{name}{k}" for name in ("first", "last", "least", "most")], value)
    return w.finished(found | {"alive": w.constant(1.0)})


def row(values: Mapping[str, Scalar], stem: str) -> list[Scalar]:
    """The values stem0, stem1 and so on, in order."""
    return [value for name, value in values.items() if name.rstrip("0123456789") == stem]


def _clock(loop: Fitted) -> list[Kernel]:
    """Instants of a jittered clock, and whether this sample is missed."""
    w, hardware = Assembly("clock"), loop.hardware
    found: dict[str, Scalar] = {}
    if hardware.jitter:
        found = {"earlier": w.input("time"), "time": w.input("next")}
        found["next"] = w.input("clock") + w.input("jitter") * w.input("uniform_jitter")
    if hardware.told_elapsed:
        found["elapsed"] = found["time"] - found["earlier"] if hardware.jitter else w.input("period")
    if hardware.missed:
        # The first sample is never missed: the controller has to start.
        found["missed"] = w.input("uniform_missed").less(w.input("missed_share")).both(w.input("begun"))
    return [w.finished(found)] if found else []


def _draws(loop: Fitted, paths: tuple[str, ...]) -> dict[str, Draw]:
    measured = len(loop.wiring.measured)
    found = {
        f"noise{k}": Draw(kind="normal", stream=2 * k)
        for k, noise in enumerate(loop.noises)
        if noise is not None and f"noise{k}" not in paths
    }
    if loop.hardware.jitter:
        found["uniform_jitter"] = Draw(kind="uniform", stream=2 * measured, ahead=1)
    if loop.hardware.missed:
        found["uniform_missed"] = Draw(kind="uniform", stream=2 * measured + 1)
    return found


def _kept(loop: Fitted, states: int) -> Kernel:
    """The state at the sample, to which a run that stops being finite is put back; the length of a jittered period."""
    w = Assembly("kept")
    found = {f"was{k}": value for k, value in enumerate(w.inputs("x", states))}
    if loop.hardware.jitter:
        found["span"] = w.input("next") - w.input("time")
    return w.finished(found)


def _check(loop: Fitted, states: int) -> Kernel:
    """|x|², NaN where the processor met a fault, and whether it passed the bound; a NaN fails the comparison.

    A guard with a safe output lives with faults.
    """
    w, guard = Assembly("check"), loop.hardware.guard
    norm = w.input("fault") if guard is None or not isinstance(guard.reaction, SafeOutput) else w.constant(0.0)
    for value in w.inputs("x", states):
        norm = value.fused(value, norm)
    return w.finished({"norm": norm, "trouble": norm.less(w.input("bound_square")).negated()})


def _within(around: Kernel, program: Program) -> Program:
    """The program in its surroundings."""
    return tuple(
        Repeat(times=each.times, body=_within(around, each.body))
        if isinstance(each, Repeat)
        else restricted(chained(each.name, [around, each]), each.outputs)
        for each in program
    )


def _merged(program: Program) -> Program:
    """Kernels that follow each other as one, repetitions as they are."""
    found: list[Kernel | Repeat] = []
    for each in program:
        if isinstance(each, Repeat):
            found.append(Repeat(times=each.times, body=_merged(each.body)))
        elif found and isinstance(found[-1], Kernel):
            found[-1] = chained(found[-1].name, [found[-1], each])
        else:
            found.append(each)
    return tuple(found)
