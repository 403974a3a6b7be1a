"""The source of a sampled loop: samples outside, runs of a block inside, one text for one run and for many."""

from __future__ import annotations

from ulna.sim.sampled.control_source import write_command, write_measurement, write_update
from ulna.sim.sampled.layout import Layout
from ulna.sim.sampled.loop_writer import LoopWriter
from ulna.sim.sampled.plant_source import write_check, write_period

HEADER = '''"""Written by ulna; safe to delete."""

import math

import numba
import numpy as np
from numba.extending import intrinsic


@intrinsic
def fused(typing, a, b, c):
    """a·b + c rounded once, written where it is meant, so that one run and many are rounded alike."""

    def code(context, builder, signature, arguments):
        return builder.fma(*arguments)

    return numba.float64(numba.float64, numba.float64, numba.float64), code


@numba.njit(error_model="numpy", cache=CACHE)
def uniform(seed, counter):
    """Counter-based: splitmix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014), 53 bits in [0, 1)."""
    z = seed + np.uint64(0x9E3779B97F4A7C15) * (counter + np.uint64(1))
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * 1.1102230246251565e-16


@numba.njit(error_model="numpy", cache=CACHE)
def normal(seed, counter):
    """Box and Muller's transform of two neighbouring uniform numbers."""
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(seed, counter)))
    return radius * math.cos(6.283185307179586 * uniform(seed, counter + np.uint64(1)))


@numba.njit(error_model="numpy", cache=CACHE)
def scrambled(seed):
    """Neighbouring seeds to distant streams."""
    z = (seed ^ (seed >> np.uint64(33))) * np.uint64(0xFF51AFD7ED558CCD)
    z = (z ^ (z >> np.uint64(33))) * np.uint64(0xC4CEB9FE1A85EC53)
    return z ^ (z >> np.uint64(33))


'''

SIGNATURE = (
    "int64(int64, int64, int64, float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], uint64[::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1])"
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
    w.depth = 1
    with w.block(f"for base in range(first, last, {lanes}):"):
        _write_start(w)
        with w.block("for k in range(count + 1):"):
            _write_sample(w, recording=recording)
        _write_end(w)
    w.line("return k")
    head = [
        f'@numba.njit("{SIGNATURE}", error_model="numpy", nogil=True, cache=CACHE)',
        f"def loop({ARGUMENTS}):",
        f"    s = np.zeros({len(w.slots) * lanes})",
        f"    g = np.zeros({lanes}, dtype=np.uint64)",
        "    k = 0",
        "    l = 0",
        *(f"    f_{name} = settings[{place}]" for place, name in enumerate(w.settings)),
    ]
    return HEADER + "\n".join(head + w.lines) + "\n", tuple(w.settings)


def _write_start(w: LoopWriter) -> None:
    layout = w.layout
    wiring = layout.wiring
    w.line("s[:] = 0.0")
    with w.block(f"for l in range({w.lanes}):"):
        # The last block is filled up with copies of the last run, which nobody asks for.
        w.line("run = min(base + l, last - 1)")
        w.line("g[l] = scrambled(seeds[run])")
        for k in range(layout.states):
            w.store(f"x{k}", f"initial[run, {k}]")
        for k in range(layout.memory):
            w.store(f"z{k}", f"memory[{k}]")
        names = {name: w.new(f"parameters[run, {k}]") for k, name in _places("p", wiring.plant.before.inputs)}
        for k, value in enumerate(w.kernel(wiring.plant.before, names)):
            w.store(f"p{k}", value)
        for k in range(len(wiring.references)):
            w.store(f"r{k}", f"own_references[run, {k}]")
        for k in range(len(wiring.others)):
            w.store(f"d{k}", f"own_others[run, {k}]")
        for k in range(layout.outputs):
            w.store(f"target{k}", f"targets[run, {k}]")
            w.store(f"settled{k}", "0.0")
        w.store("alive", "1.0")
        if layout.jittered:
            w.store("next", f"{w.setting('jitter')} * uniform(g[l], np.uint64({layout.channels - 2}))")


def _places(stem: str, names: tuple[str, ...]) -> list[tuple[int, str]]:
    return [(int(name[len(stem) :]), name) for name in names]


def _write_sample(w: LoopWriter, *, recording: bool) -> None:
    layout = w.layout
    w.line(f"time = k * {w.setting('period')}")
    for k in range(len(layout.wiring.references)):
        w.line(f"reference{k} = references[k, {k}]")
        w.line(f"older{k} = references[max(k - 1, 0), {k}]")
    for k in range(len(layout.wiring.others)):
        w.line(f"other{k} = others[k, {2 * k}]")
        if layout.ramps:
            w.line(f"slope{k} = others[k, {2 * k + 1}]")
    write_measurement(w)
    if layout.memory:
        with w.block("if k > 0:"):
            write_update(w)
    write_command(w)
    if recording:
        for name, column in layout.columns().items():
            w.line(f"record[{column}, k] = {w.at(name)}")
    with w.block("if k == count:"):
        w.line("break")
    write_period(w)
    write_check(w)
    if recording:
        with w.block(f"if {w.at('alive')} == 0.0:"):
            w.line("break")
    else:
        with w.block("if k % 64 == 63:"):
            w.line("living = 0.0")
            with w.block(f"for l in range({w.lanes}):"):
                w.line(f"living += {w.at('alive')}")
            with w.block("if living == 0.0:"):
                w.line("break")


def _write_end(w: LoopWriter) -> None:
    with w.block(f"for l in range({w.lanes}):"), w.block("if base + l < last:"):
        for name, column in w.layout.results().items():
            w.line(f"results[base + l, {column}] = {w.at(name)}")
