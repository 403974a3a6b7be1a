"""The source of a sampled loop: samples outside, runs of a block inside, one text for one run and for many."""

from __future__ import annotations

from collections.abc import Sequence

from ulna.loop import Program, Repeat
from ulna.program import GPU_HEADER, HEADER, Kernel, restricted
from ulna.sim.sampled.blocks import TABLE, Blocks
from ulna.sim.sampled.foreign import ForeignStep
from ulna.sim.sampled.lanes import LaneWriter

TYPES = (
    "int64, int64, int64, float64[::1], float64[:, ::1], float64[:, ::1], float64[:, :, ::1], uint64[::1], "
    "float64[:, ::1], float64[:, :, ::1]"
)
PACED = 32
"""Samples between two looks at how fast the plant moves."""
ARGUMENTS = "first, last, count, numbers, table, shared, paths, seeds, results, record"


def loop_source(
    made: Blocks, results: Sequence[str], record: Sequence[str], *, lanes: int, gpu: bool = False
) -> tuple[str, tuple[str, ...]]:
    """The module of a loop and the names of its numbers, in order.

    Args:
        made: what a run does. results: slots that are handed back at the end of a run, after its code and its time.
        record: slots that are kept at every sample. lanes: runs of a block.
        gpu: for a GPU, each of whose threads takes one run after the other.
    """
    writer = _LoopWriter(made, results, record, lanes, gpu=gpu)
    head = f"for base in range(first, last, {lanes}):"
    if gpu:
        head = "for base in range(first + cuda.grid(1), last, cuda.gridsize(1)):"
    writer.write(head)
    if gpu:
        return writer.module(GPU_HEADER, "@cuda.jit(cache=CACHE)", answer=False), tuple(writer.w.numbers)
    decorator = f'@numba.njit("int64({TYPES})", error_model="numpy", nogil=True, cache=CACHE)'
    return writer.module(HEADER, decorator, answer=True), tuple(writer.w.numbers)


class _LoopWriter:
    """Writes the text around the kernels: samples, random numbers, ends of runs, results."""

    def __init__(self, made: Blocks, results: Sequence[str], record: Sequence[str], lanes: int, *, gpu: bool) -> None:
        self.made, self.results, self.record = made, tuple(results), tuple(record)
        clock = {"begun", "clock"} if made.jittered else {"begun", "clock", "time", "earlier", "span"}
        shared = clock | set(made.tables)
        self.alike = _alike(made, {*shared, *made.numbers}) if lanes > 1 else set()
        self.w = LaneWriter(
            lanes=lanes,
            gpu=gpu,
            same=_same(made),
            read=_read(made) | {*self.results, *self.record, "alive"},
            numbers=made.numbers,
            shared=shared,
            paths=made.paths,
            alike=self.alike,
        )
        self.seed = "g[l]" if lanes > 1 else "g"

    def module(self, header: str, decorator: str, *, answer: bool) -> str:
        """The whole text."""
        w = self.w
        first = ["k = 0", "l = 0", "v_time = 0.0"]
        if w.lanes > 1:
            # From the start of a line of the processor's cache: a vector that lies across two costs twice.
            first += [f"room = np.zeros({w.size() + 7})", "s = room[-(room.ctypes.data // 8) % 8 :]"]
            first += [f"g = np.zeros({w.lanes}, dtype=np.uint64)"]
        for each in self.made.samples:
            if isinstance(each, ForeignStep):
                first += [f"given = np.zeros({len(each.inputs)})", f"told = np.zeros({len(each.outputs)})"]
        first += [f"f_{name} = numbers[{place}]" for place, name in enumerate(w.numbers)]
        body = []
        for line in w.lines:
            indent = line[: len(line) - len(line.lstrip())]
            body += [indent + each for each in w.cleared()] if line.strip() == "CLEARED" else [line]
        end = ["    return k"] if answer else []
        lines = [decorator, f"def loop({ARGUMENTS}):", *(f"    {t}" for t in first), *body, *end, ""]
        return header + "".join(w.functions) + "\n".join(lines)

    def write(self, head: str) -> None:
        """The runs block after block, each over all samples."""
        w = self.w
        w.depth = 1
        with w.block(head):
            self._begin()
            with w.block("for k in range(count + 1):"):
                self._sample()
            with w.runs(), w.block(f"if {w.at('alive')} == 1.0:"):
                self._results("0.0", w.at("time"))

    def _begin(self) -> None:
        w, made = self.w, self.made
        w.line("CLEARED")
        w.line("ended = 0")
        w.line("k = 0")
        w.line("v_time = 0.0")
        for name in sorted(self.alike):
            w.line(f"v_{name} = 0.0")
        self._shared("0")
        with w.runs():
            # The last block is filled up with copies of the last run, which nobody asks for.
            w.line("run = base + l if base + l < last else last - 1")
            w.line(f"{self.seed} = scrambled(seeds[run])")
            if made.jittered:
                stream = made.draws["uniform_jitter"].stream
                w.line(f"{w.at('uniform_jitter')} = uniform({self.seed}, np.uint64({stream}))")
            given = {
                f"{TABLE}{each.stem}{k}": f"table[run, {column}]"
                for each in made.columns
                for k, column in enumerate(range(each.begin, each.end), each.first)
            }
            w.inline(restricted(made.begin, w.kept(made.begin)), given)

    def _shared(self, k: str) -> None:
        for column, name in enumerate(self.made.tables):
            self.w.line(f"v_{name} = shared[{k}, {column}]")

    def _sample(self) -> None:
        w, made = self.w, self.made
        w.line(f"v_clock = (k + 1) * {w.at('period')}")
        w.line("v_begun = 1.0 if k > 0 else 0.0")
        if not made.jittered:
            w.line(f"v_time = k * {w.at('period')}")
            w.line(f"v_earlier = (k - 1) * {w.at('period')}")
            w.line(f"v_span = {w.at('period')}")
        self._shared("k")
        w.line("entered = 0")
        for slot, draw in made.draws.items():
            counter = f"np.uint64(k + {draw.ahead}) * np.uint64({made.streams}) + np.uint64({draw.stream})"
            w.random(slot, f"{draw.kind}({self.seed}, {counter})")
        # Two loops: in one the compiler runs out of registers.
        for each in made.samples:
            if isinstance(each, ForeignStep):
                w.foreign(each)
            else:
                w.work(each, counted="entered")
        if made.entries.outputs:
            with w.block("if entered != 0:"):
                w.work(made.entries)
        with w.block(f"if k % {PACED} == 0:"):
            w.work(made.pace)
        self._record()
        with w.block("if k == count:"):
            w.line("break")
        w.line("trouble = 0")
        self._motion(made.motion)
        self._ends()

    def _record(self) -> None:
        w = self.w
        if not self.record:
            return
        with w.runs(), w.block("if base + l < last:"):
            for row, name in enumerate(self.record):
                w.line(f"record[{row}, base + l, k] = {w.at(name)}")

    def _motion(self, program: Program) -> None:
        w = self.w
        for each in program:
            if isinstance(each, Repeat):
                with w.block(f"for _{w.depth} in range(int({w.at(each.times)})):"):
                    self._motion(each.body)
            else:
                w.work(each, counted="trouble")

    def _ends(self) -> None:
        """End the runs in trouble, one after the other: their results are written here and now."""
        w = self.w
        # A state that is no number stays one: a run that ended is counted at every later sample.
        with w.block(f"if trouble > {'ended' if self.made.states else '0'}:"):
            with w.runs():
                found = w.evaluated(self.made.check)
                with w.block(f"if {w.at('alive')} == 1.0 and {found['trouble']} != 0.0:"):
                    w.line("code = 1.0")
                    w.line(f"end = {w.at('time')} + {w.at('span')}")
                    with w.block(f"if {found['norm']} - {found['norm']} != 0.0:"):
                        w.line("code = 2.0")
                        w.line(f"end = {w.at('time')}")
                        for k in range(self.made.states):
                            w.line(f"{w.at(f'x{k}')} = {w.at(f'was{k}')}")
                    self._results("code", "end")
                    w.line(f"{w.at('alive')} = 0.0")
                    w.line("ended += 1")
                    for k in range(self.made.states):
                        w.line(f"{w.at(f'x{k}')} = math.nan")
            with w.block(f"if ended == {w.lanes}:"):
                w.line("break")

    def _results(self, code: str, end: str) -> None:
        """One row of the results; the last block is filled up with copies of a run, which have none."""
        w = self.w
        with w.block("if base + l < last:"):
            w.line(f"results[base + l, 0] = {code}")
            w.line(f"results[base + l, 1] = {end}")
            for column, name in enumerate(self.results, 2):
                w.line(f"results[base + l, {column}] = {w.at(name)}")


def _same(made: Blocks) -> dict[str, str]:
    """Of slots that begin alike and are always written together with one number, the first one."""
    kernels = [made.begin, *made.samples, made.entries, *_kernels(made.motion)]
    written: dict[str, list[tuple[int, int]]] = {}
    for place, each in enumerate(kernels):
        for name, result in zip(each.outputs, each.results, strict=True):
            written.setdefault(name, []).append((place, result))
    first: dict[tuple[tuple[int, int], ...], str] = {}
    return {name: first.setdefault(tuple(places), name) for name, places in written.items()}


def _alike(made: Blocks, known: set[str]) -> set[str]:
    """Slots that are the same for all runs: the kernels of the motion make them of `known` and of each other alone."""
    others = [made.begin, *made.samples, made.entries]
    kernels = _kernels(made.motion)
    found = {name for each in kernels for name in each.outputs} - {name for each in others for name in each.outputs}
    while True:
        wrong = {
            name
            for each in kernels
            for name in found.intersection(each.outputs)
            if not {each.inputs[k] for k in _needed(each, name)} <= found | known
        }
        if not wrong:
            return found
        found -= wrong


def _needed(kernel: Kernel, output: str) -> set[int]:
    """Which inputs an output depends on."""
    first = len(kernel.inputs)
    open_, seen = [kernel.results[kernel.outputs.index(output)]], set[int]()
    while open_:
        value = open_.pop()
        if value not in seen:
            seen.add(value)
            open_ += kernel.instructions[value - first].operands if value >= first else ()
    return {value for value in seen if value < first}


def _kernels(program: Program) -> list[Kernel]:
    """All kernels of a program."""
    found: list[Kernel] = []
    for each in program:
        found += _kernels(each.body) if isinstance(each, Repeat) else [each]
    return found


def _read(made: Blocks) -> set[str]:
    """Slots that a later kernel or the text around them reads."""
    states = range(made.states)
    found = {"fault", "time", "span", *(f"x{k}" for k in states), *(f"was{k}" for k in states)}
    for each in (*made.samples, made.entries, made.pace, made.check, *_kernels(made.motion)):
        found.update(each.inputs)
    return found
