"""Source of the plant from one sample to the next."""

from __future__ import annotations

from ulna.sim.sampled.control_source import combined, moved, outputs_of, plant_names, pulse
from ulna.sim.sampled.loop_writer import LoopWriter


def write_period(w: LoopWriter) -> None:
    """Runge-Kutta steps over the stretches of constant input of one period; `trouble` counts the runs that end."""
    layout = w.layout
    driven = range(len(layout.wiring.driven))
    names = [("early", "ua"), ("late", "ub")] if layout.split else [("late", "ub")]
    inline = layout.plant_steps == 1 and not layout.pulsed
    w.line("trouble = 0")
    with w.runs():
        _write_start(w)
        _write_effort(w)
        if inline:
            for length, inputs in names:
                _write_step(w, length, [("", [f"{inputs}{k}" for k in driven])])
            _write_check(w)
    if inline:
        return
    if layout.pulsed:
        _write_pulses(w, [inputs for _, inputs in names])
    else:
        for length, inputs in names:
            _write_steps(w, [(length, [f"{inputs}{k}" for k in driven])])
    with w.runs():
        _write_check(w)


def _write_start(w: LoopWriter) -> None:
    """Lengths of the stretches, what the state was, and nothing hit yet."""
    layout = w.layout
    for k in range(layout.states):
        w.store(f"was{k}", w.load(f"x{k}"))
    span = w.new(f"{w.load('next')} - {w.load('time')}") if layout.jittered else w.setting("period")
    w.store("span", span)
    w.store("now", w.load("time") if layout.jittered else "time")
    for k in range(len(layout.end_stops)):
        w.store(f"hit{k}", "0.0")
    fraction = w.setting("fraction")
    parts = [("early", fraction), ("late", f"(1.0 - {fraction})")] if layout.split else [("late", "1.0")]
    for name, part in parts:
        w.store(name, f"{span} * {part} / {float(layout.plant_steps)}")


def _write_effort(w: LoopWriter) -> None:
    """Largest |u| and the integral of u² over the period, of what the plant gets (with pulses: of what is asked)."""
    layout = w.layout
    for k in range(len(layout.wiring.driven)):
        late, peak = w.load(f"ub{k}"), w.load(f"peak{k}")
        square = w.new(f"{late} * {late}")
        if layout.split:
            early = w.load(f"ua{k}")
            square = w.new(f"fused({w.setting('fraction')}, {early} * {early} - {square}, {square})")
            peak = w.new(f"abs({early}) if abs({early}) > {peak} else {peak}")
        w.store(f"peak{k}", f"abs({late}) if abs({late}) > {peak} else {peak}")
        w.store(f"square{k}", f"fused({square}, {w.load('span')}, {w.load(f'square{k}')})")


Stretch = tuple[str, list[str]]
"""Slots of a length, or of a part of a carrier's period, and of the inputs over it."""


def _write_pulses(w: LoopWriter, phases: list[str]) -> None:
    """Carrier periods cut at the ends of their pulses; the bridge takes a new command at the start of one."""
    layout = w.layout
    driven = range(len(layout.wiring.driven))
    count = sum(layout.switched) + 1
    stretches = [(f"part{i}", [f"pulse{i}_{k}" for k in driven]) for i in range(count)]
    edges = ["0", f"int({w.setting('old_carriers')})"] if layout.split else ["0"]
    for first, last, inputs in zip(edges, [*edges[1:], f"int({w.setting('carriers')})"], phases, strict=True):
        if layout.rippled:
            w.line(f"periods = float({last} - {first})")
            with w.runs():
                _write_stretches(w, inputs)
                carrier = w.new(f"{w.load('span')} / {w.setting('carriers')}")
                w.store("late", f"{carrier} * periods / {float(layout.plant_steps)}")
                w.store("carrier", f"{carrier} if periods > 0.0 else 0.0")
                _write_shift(w, stretches, back=False)
            with w.block(f"for j in range({layout.plant_steps}):"), w.runs():
                _write_step(w, "late", stretches)
            with w.runs():
                _write_shift(w, stretches, back=True)
            continue
        with w.runs():
            _write_stretches(w, inputs)
            length = w.new(f"{w.load('span')} / ({w.setting('carriers')} * {float(layout.plant_steps)})")
            for i in range(count):
                w.store(f"length{i}", f"{length} * {w.load(f'part{i}')}")
        with w.block(f"for c in range({first}, {last}):"):
            _write_steps(w, [(f"length{i}", stretch[1]) for i, stretch in enumerate(stretches)])


def _write_stretches(w: LoopWriter, inputs: str) -> None:
    """Parts of a carrier's period between the ends of pulses, and every input over each of them."""
    driven = range(len(w.layout.wiring.driven))
    given = [w.load(f"{inputs}{k}") for k in driven]
    pulses = {k: pulse(w, k, given[k]) for k in driven if w.layout.switched[k]}
    ends = _sorted(w, [part for _, part in pulses.values()])
    for i, (begin, end) in enumerate(zip(["0.0", *ends], [*ends, "1.0"], strict=True)):
        w.store(f"part{i}", f"{end} - {begin}")
        for k in driven:
            value = given[k]
            if k in pulses:
                height, part = pulses[k]
                value = w.new(f"{height} if {part} >= {end} else 0.0")
            w.store(f"pulse{i}_{k}", value)


def _write_shift(w: LoopWriter, stretches: list[Stretch], *, back: bool) -> None:
    """From the state at the start of a carrier's period to the one without ripple, v = x + T m(v), or back.

    T m is the mean over the period of the integral of f − mean(f), which begins at 0 with the period.
    """
    x, carrier = w.loads("x", w.layout.states), w.load("carrier")
    parts = [w.load(name) for name, _ in stretches]

    def ripple(at: list[str]) -> list[str]:
        rows = [_rates(w, at, w.load("now"), inputs) for _, inputs in stretches]
        areas = []
        for mean, *values in zip(_mean(w, parts, rows), *rows, strict=True):
            height, area = "0.0", "0.0"
            for part, value in zip(parts, values, strict=True):
                rise = w.new(f"{part} * ({value} - {mean})")
                area = w.new(f"fused({part}, fused(0.5, {rise}, {height}), {area})")
                height = w.new(f"{height} + {rise}")
            areas.append(area)
        return areas

    first = ripple(x)
    # One iteration: without it the way there and back would leave a trace of second order at every sample.
    x_new = moved(w, x, f"-{carrier}", first) if back else moved(w, x, carrier, ripple(moved(w, x, carrier, first)))
    for k, value in enumerate(x_new):
        w.store(f"x{k}", value)


def _sorted(w: LoopWriter, values: list[str]) -> list[str]:
    """The values in increasing order."""
    row: list[str] = []
    for value in values:
        rest = value
        for place, smaller in enumerate(row):
            row[place] = w.new(f"{smaller} if {smaller} <= {rest} else {rest}")
            rest = w.new(f"{rest} if {smaller} <= {rest} else {smaller}")
        row.append(rest)
    return row


def _write_steps(w: LoopWriter, stretches: list[Stretch]) -> None:
    """The steps of some stretches: those of one stretch after those of the one before."""
    if w.layout.plant_steps == 1:
        with w.runs():
            for length, inputs in stretches:
                _write_step(w, length, [("", inputs)])
        return
    for length, inputs in stretches:
        with w.block(f"for j in range({w.layout.plant_steps}):"), w.runs():
            _write_step(w, length, [("", inputs)])


def _write_step(w: LoopWriter, length: str, fields: list[Stretch]) -> None:
    """One Runge-Kutta step with the input held, or with the mean over parts of a period, then the walls."""
    h = w.load(length)
    half = w.new(f"0.5 * {h}")
    now = w.load("now")
    times = [now, w.new(f"{now} + {half}"), w.new(f"{now} + {h}")]
    x = w.loads("x", w.layout.states)

    def rates(at: list[str], stage: int) -> list[str]:
        rows = [_rates(w, at, times[stage], inputs) for _, inputs in fields]
        return rows[0] if len(rows) == 1 else _mean(w, [w.load(part) for part, _ in fields], rows)

    k1 = rates(x, 0)
    k2 = rates(moved(w, x, half, k1), 1)
    if w.layout.plant_order == 2:
        x_new = moved(w, x, h, k2)
    else:
        k3 = rates(moved(w, x, half, k2), 1)
        k4 = rates(moved(w, x, h, k3), 2)
        x_new = combined(w, x, w.new(f"{h} / 6.0"), (k1, k2, k3, k4))
    _write_walls(w, x_new)
    for k, value in enumerate(x_new):
        w.store(f"x{k}", value)
    w.store("now", times[2])


def _rates(w: LoopWriter, x: list[str], time: str, inputs: list[str]) -> list[str]:
    """x' of the plant; `inputs` are slots."""
    layout, wiring = w.layout, w.layout.wiring
    begun = w.load("time") if layout.jittered else "time"
    d = [w.new(f"other{k} + {text}") for k, text in enumerate(w.loads("d", len(wiring.others)))]
    if layout.ramps:
        d = [w.new(f"{text} + slope{k} * ({time} - {begun})") for k, text in enumerate(d)]
    u = [w.load(name) for name in inputs]
    p = w.loads("p", len(wiring.plant.before.outputs))
    return w.kernel(outputs_of(wiring.plant.main, "x'"), plant_names(x, u, d, time, p))


def _mean(w: LoopWriter, parts: list[str], rows: list[list[str]]) -> list[str]:
    """The sum of the rows, each times its part."""
    total = ["0.0"] * len(rows[0])
    for part, row in zip(parts, rows, strict=True):
        total = [w.new(f"fused({part}, {value}, {before})") for value, before in zip(row, total, strict=True)]
    return total


def _write_walls(w: LoopWriter, x: list[str]) -> None:
    for k, wall in enumerate(w.layout.end_stops):
        low, high, bounce = (w.setting(f"{name}{k}") for name in ("wall_low", "wall_high", "bounce"))
        position, velocity = x[wall.position], x[wall.velocity]
        above = w.new(f"1.0 if {position} >= {high} else 0.0")
        below = w.new(f"1.0 if {position} <= {low} else 0.0")
        held = w.new(f"{high} if {above} == 1.0 else {position}")
        x[wall.position] = w.new(f"{low} if {below} == 1.0 else {held}")
        # Only a velocity into the wall is turned round.
        back = w.new(f"-{bounce} * {velocity}")
        slowed = w.new(f"{back} if {above} == 1.0 and {velocity} > 0.0 else {velocity}")
        x[wall.velocity] = w.new(f"{back} if {below} == 1.0 and {velocity} < 0.0 else {slowed}")
        w.store(f"hit{k}", f"1.0 if {above} + {below} > 0.0 else {w.load(f'hit{k}')}")


def _write_check(w: LoopWriter) -> None:
    """Count the runs whose state passed the bound or is no number; written so that a NaN is outside."""
    norm = w.new(_norm(w.loads("x", w.layout.states), w.load("faulty")))
    w.line(f"trouble += 0 if {norm} < {w.setting('bound_square')} else 1")


def _norm(x: list[str], faulty: str) -> str:
    """|x|², or no number where the command is none."""
    text = faulty
    for value in x:
        text = f"fused({value}, {value}, {text})"
    return text


def write_ends(w: LoopWriter) -> None:
    """End the runs in trouble, one after the other: their results are written here and now."""
    layout = w.layout
    # A state that is no number stays one: a run that ended is counted at every later sample.
    with w.block(f"if trouble > {'ended' if layout.states else '0'}:"):
        with w.each():
            w.line(f"norm = {_norm([w.at(f'x{k}') for k in range(layout.states)], w.at('faulty'))}")
            with w.block(f"if {w.at('alive')} == 1.0 and not norm < {w.setting('bound_square')}:"):
                time = w.at("time") if layout.jittered else "time"
                w.line("code = 1.0")
                w.line(f"end = {time} + {w.at('span')}")
                with w.block("if norm - norm != 0.0:"):
                    w.line("code = 2.0")
                    w.line(f"end = {time}")
                    for k in range(layout.states):
                        w.line(f"{w.at(f'x{k}')} = {w.at(f'was{k}')}")
                write_results(w, "code", "end")
                w.line(f"{w.at('alive')} = 0.0")
                w.line("ended += 1")
                for k in range(layout.states):
                    w.line(f"{w.at(f'x{k}')} = math.nan")
        with w.block(f"if ended == {w.lanes}:"):
            w.line("break")


def write_results(w: LoopWriter, code: str, end: str) -> None:
    """One row of the results; the last block is filled up with copies of a run, which have none."""
    with w.block("if base + l < last:"):
        for name, column in w.layout.results().items():
            value = {"code": code, "end": end}.get(name)
            if name.startswith("outside"):
                k = name.removeprefix("outside")
                distance = f"abs({w.at(f'last{k}')} - {w.at(f'target{k}')})"
                value = f"0.0 if {distance} <= {w.at(f'band{k}')} else 1.0"
            w.line(f"results[base + l, {column}] = {value or w.at(name)}")
