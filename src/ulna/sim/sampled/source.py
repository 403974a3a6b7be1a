"""The source of a sampled loop: samples outside, runs of a block inside, one text for one run and for many."""

from __future__ import annotations

from ulna.program import GPU_HEADER, HEADER
from ulna.sim.sampled.control_source import (
    outputs_at,
    write_command,
    write_entries,
    write_measurement,
    write_noise,
    write_update,
)
from ulna.sim.sampled.layout import Layout
from ulna.sim.sampled.loop_writer import LoopWriter
from ulna.sim.sampled.plant_source import write_ends, write_period, write_results

TYPES = (
    "int64, int64, int64, float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], uint64[::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1]"
)

ARGUMENTS = (
    "first, last, count, settings, held, memory, initial, parameters, references, own_references, others, own_others, "
    "seeds, targets, results, record"
)


def loop_source(layout: Layout, *, lanes: int, recording: bool) -> tuple[str, tuple[str, ...]]:
    """The module of a loop and the names of its settings, in order.

    Args:
        layout: what it is made of.
        lanes: runs of a block.
        recording: keep the numbers of every sample; for one run.
    """
    w = LoopWriter(layout, lanes)
    _write_blocks(w, f"for base in range(first, last, {lanes}):", recording=recording)
    w.line("return k")
    decorator = f'@numba.njit("int64({TYPES})", error_model="numpy", nogil=True, cache=CACHE)'
    return _module(HEADER, decorator, w), tuple(w.settings)


def gpu_source(layout: Layout) -> tuple[str, tuple[str, ...]]:
    """The same for a GPU: each of its threads takes one run after the other."""
    w = LoopWriter(layout, 1)
    _write_blocks(w, "for base in range(first + cuda.grid(1), last, cuda.gridsize(1)):", recording=False)
    return _module(GPU_HEADER, "@cuda.jit(cache=CACHE)", w), tuple(w.settings)


def _module(header: str, decorator: str, w: LoopWriter) -> str:
    lines = [decorator, f"def loop({ARGUMENTS}):", *(f"    {text}" for text in _first_lines(w)), *w.finished()]
    return header + "\n".join(lines) + "\n"


def _write_blocks(w: LoopWriter, head: str, *, recording: bool) -> None:
    """The runs block after block, each over all samples."""
    w.depth = 1
    with w.block(head):
        _write_start(w)
        with w.block("for k in range(count + 1):"):
            _write_sample(w, recording=recording)
        time = w.at("time") if w.layout.jittered else "time"
        with w.each(), w.block(f"if {w.at('alive')} == 1.0:"):
            write_results(w, "0.0", time)


def _first_lines(w: LoopWriter) -> list[str]:
    lines = ["k = 0", "l = 0", "time = 0.0"]
    if w.lanes > 1:
        lines += [f"s = np.zeros({w.size()})", f"g = np.zeros({w.lanes}, dtype=np.uint64)"]
    lines += [f"f_{name} = settings[{place}]" for place, name in enumerate(w.settings)]
    return lines + [f"b{place} = held[{place}]" for place in sorted(w.constants)]


def _write_start(w: LoopWriter) -> None:
    """Everything as it is before the first sample."""
    layout = w.layout
    wiring = layout.wiring
    w.reset()
    w.line("ended = 0")
    for k in range(len(wiring.others)):
        w.line(f"other{k} = others[0, {2 * k}]")
    with w.runs():
        # The last block is filled up with copies of the last run, which nobody asks for.
        w.line("run = base + l if base + l < last else last - 1")
        w.line(f"{w.seed} = scrambled(seeds[run])")
        for k in range(layout.states):
            w.store(f"x{k}", f"initial[run, {k}]")
        for k in range(layout.memory):
            w.store(f"z{k}", f"memory[run, {k}]")
        names = {name: w.new(f"parameters[run, {k}]") for k, name in _places("p", wiring.plant.before.inputs)}
        for k, value in enumerate(w.kernel(wiring.plant.before, names)):
            w.store(f"p{k}", value)
        for k in range(len(wiring.references)):
            w.store(f"r{k}", f"own_references[run, {k}]")
        for k in range(len(wiring.others)):
            w.store(f"d{k}", f"own_others[run, {k}]")
        w.store("alive", "1.0")
        time = "0.0"
        if layout.jittered:
            time = w.new(f"{w.setting('jitter')} * uniform({w.seed}, np.uint64({layout.channels - 2}))")
            w.store("next", time)
        d = [w.new(f"other{k} + {w.load(f'd{k}')}") for k in range(len(wiring.others))]
        for k, value in enumerate(outputs_at(w, "o", time, d)):
            target = w.new(f"targets[run, {k}]")
            w.store(f"target{k}", target)
            w.store(f"band{k}", f"{w.setting('band')} * abs({target} - {value})")
            for name in ("first", "last", "least", "most"):
                w.store(f"{name}{k}", value)


def _places(stem: str, names: tuple[str, ...]) -> list[tuple[int, str]]:
    return [(int(name[len(stem) :]), name) for name in names]


def _write_sample(w: LoopWriter, *, recording: bool) -> None:
    layout = w.layout
    w.line(f"time = k * {w.setting('period')}")
    w.line(f"earlier = (k - 1) * {w.setting('period')}")
    w.line("entered = 0")
    for k in range(len(layout.wiring.references)):
        w.line(f"reference{k} = references[k, {k}]")
        w.line(f"older{k} = references[k - 1 if k > 0 else 0, {k}]")
    for k in range(len(layout.wiring.others)):
        w.line(f"other{k} = others[k, {2 * k}]")
        if layout.ramps:
            w.line(f"slope{k} = others[k, {2 * k + 1}]")
    write_noise(w)
    with w.runs():
        write_measurement(w)
        if layout.memory:
            write_update(w)
    # Two loops: in one the compiler runs out of registers.
    with w.runs():
        write_command(w)
    write_entries(w)
    if recording:
        for name, column in layout.columns().items():
            # Without jitter all runs share their time.
            w.line(f"record[{column}, k] = {'time' if name == 'time' and not layout.jittered else w.at(name)}")
    with w.block("if k == count:"):
        w.line("break")
    write_period(w)
    write_ends(w)
