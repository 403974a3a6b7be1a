"""Source of the plant from one sample to the next."""

from __future__ import annotations

from ulna.sim.sampled.control_source import combined, outputs_of, plant_names, pulse
from ulna.sim.sampled.loop_writer import LoopWriter


def write_period(w: LoopWriter) -> None:
    """Runge-Kutta steps over the stretches of constant input of one period."""
    layout = w.layout
    with w.runs():
        for k in range(layout.states):
            w.store(f"was{k}", w.load(f"x{k}"))
        span = w.new(f"{w.at('next')} - {w.at('time')}") if layout.jittered else w.setting("period")
        w.store("span", span)
        w.store("now", w.load("time"))
        for k in range(len(layout.end_stops)):
            w.store(f"hit{k}", "0.0")
        _write_effort(w)
        if not layout.switched:
            parts = [("early", w.setting("fraction")), ("late", f"(1.0 - {w.setting('fraction')})")]
            for name, part in parts if layout.split else [("late", "1.0")]:
                w.store(name, f"{span} * {part} / {float(layout.plant_steps)}")
    if layout.switched:
        _write_pulses(w)
        return
    for name, inputs in (("early", "ua"), ("late", "ub")) if layout.split else (("late", "ub"),):
        _write_steps(w, name, [f"{inputs}{k}" for k in range(len(layout.wiring.driven))])


def _write_effort(w: LoopWriter) -> None:
    """Largest |u| and the integral of u² over the period, of what the plant gets (with pulses: of what is asked)."""
    layout = w.layout
    alive, span = w.load("alive"), w.load("span")
    for k in range(len(layout.wiring.driven)):
        peak = w.load(f"peak{k}")
        late, early = w.load(f"ub{k}"), w.load(f"ua{k}")
        square = w.new(f"{late} * {late}")
        if layout.split:
            square = w.new(f"{square} + {w.setting('fraction')} * ({early} * {early} - {square})")
            peak = w.new(f"abs({early}) if abs({early}) > {peak} and {alive} == 1.0 else {peak}")
        w.store(f"peak{k}", f"abs({late}) if abs({late}) > {peak} and {alive} == 1.0 else {peak}")
        w.store(f"square{k}", f"{w.at(f'square{k}')} + {alive} * {square} * {span}")


def _write_pulses(w: LoopWriter) -> None:
    """Carrier periods of one pulse and one pause; the bridge takes a new command at the start of a period."""
    layout = w.layout
    with w.block(f"for c in range(int({w.setting('carriers')})):"):
        with w.runs():
            value = w.load("ub0")
            if layout.split:
                value = w.new(f"{w.at('ua0')} if c < {w.setting('old_carriers')} else {value}")
            height, part = pulse(w, 0, value)
            length = w.new(f"{w.at('span')} / {w.setting('carriers')}")
            w.store("height", height)
            w.store("on", f"{length} * {part} / {float(layout.plant_steps)}")
            w.store("off", f"{length} * (1.0 - {part}) / {float(layout.plant_steps)}")
            w.store("zero", "0.0")
        _write_steps(w, "on", ["height"])
        _write_steps(w, "off", ["zero"])


def _write_steps(w: LoopWriter, length: str, inputs: list[str]) -> None:
    steps = w.layout.plant_steps
    with w.block(f"for j in range({steps}):"), w.runs():
        _write_step(w, length, inputs)


def _write_step(w: LoopWriter, length: str, inputs: list[str]) -> None:
    """One classical Runge-Kutta step with the input held, then the walls."""
    layout, wiring = w.layout, w.layout.wiring
    kernel = outputs_of(wiring.plant.main, "x'")
    h = w.load(length)
    half, sixth = w.new(f"0.5 * {h}"), w.new(f"{h} / 6.0")
    x, u = w.loads("x", layout.states), [w.load(name) for name in inputs]
    p = w.loads("p", len(wiring.plant.before.outputs))
    now, begun = w.load("now"), w.load("time")
    times = [now, w.new(f"{now} + {half}"), w.new(f"{now} + {h}")]
    own = w.loads("d", len(wiring.others))
    d = []
    for time in times:
        row = [w.new(f"other{k} + {text}") for k, text in enumerate(own)]
        if layout.ramps:
            row = [w.new(f"{text} + slope{k} * ({time} - {begun})") for k, text in enumerate(row)]
        d.append(row)

    def rates(at: list[str], stage: int) -> list[str]:
        return w.kernel(kernel, plant_names(at, u, d[stage], times[stage], p))

    def moved(step: str, slopes: list[str]) -> list[str]:
        return [w.new(f"fused({step}, {b}, {a})") for a, b in zip(x, slopes, strict=True)]

    k1 = rates(x, 0)
    k2 = rates(moved(half, k1), 1)
    k3 = rates(moved(half, k2), 1)
    k4 = rates(moved(h, k3), 2)
    x_new = combined(w, x, sixth, (k1, k2, k3, k4))
    _write_walls(w, x_new)
    for k, value in enumerate(x_new):
        w.store(f"x{k}", value)
    w.store("now", times[2])


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
        w.store(f"hit{k}", f"1.0 if {above} + {below} > 0.0 else {w.at(f'hit{k}')}")


def write_check(w: LoopWriter) -> None:
    """End a run whose state passed the bound or is no number: it stands still from here, other runs go on."""
    layout = w.layout
    with w.runs():
        alive, code, faulty = w.load("alive"), w.load("code"), w.load("faulty")
        x, was = w.loads("x", layout.states), w.loads("was", layout.states)
        norm = w.new(" + ".join(f"{value} * {value}" for value in x) or "0.0")
        # Written so that a NaN is outside.
        inside = w.new(f"1.0 if {norm} < {w.setting('bound_square')} else 0.0")
        finite = w.new(f"1.0 - {faulty} if {norm} - {norm} == 0.0 else 0.0")
        moves = w.new(f"{alive} * {finite}")
        for k, value in enumerate(x):
            w.store(f"x{k}", f"{value} if {moves} == 1.0 else {was[k]}")
        blown = w.new(f"1.0 if {inside} == 0.0 else {code}")
        ended = w.new(f"2.0 if {finite} == 0.0 else {blown}")
        w.store("code", f"{ended} if {alive} == 1.0 else {code}")
        time = w.load("span")
        stop = w.new(f"{w.at('time')} + {time}")
        w.store("end", f"{stop} if {moves} == 1.0 else {w.at('end')}")
        w.store("alive", f"{moves} * {inside}")
