"""Source of what happens at a sample: measure, advance the controller, compute and limit the command."""

from __future__ import annotations

from ulna.program import HOISTED, Kernel, restricted
from ulna.sim.sampled.carried import CARRIED, carried
from ulna.sim.sampled.discretisation import Euler, ExactHold, RungeKutta4
from ulna.sim.sampled.loop_writer import LoopWriter


def outputs_of(kernel: Kernel, stem: str) -> Kernel:
    """The kernel of the outputs stem0, stem1, … only."""
    return restricted(kernel, [label for label in kernel.outputs if label.rstrip("0123456789") == stem])


def plant_names(x: list[str], u: list[str], d: list[str], time: str, p: list[str]) -> dict[str, str]:
    """What the inputs of the plant's kernel are called in the source."""
    names = {f"x{k}": text for k, text in enumerate(x)} | {f"u{k}": text for k, text in enumerate(u)}
    names |= {f"d{k}": text for k, text in enumerate(d)} | {"t": time}
    return names | {f"{HOISTED}{k}": text for k, text in enumerate(p)}


def _controller_names(w: LoopWriter, z: list[str], y: list[str], u: list[str], r: list[str]) -> dict[str, str]:
    rows = {"z": z, "y": y, "u": u, "r": r}
    names = {f"{stem}{k}": text for stem, row in rows.items() for k, text in enumerate(row)}
    count = len(w.layout.wiring.controller.before.outputs)
    return names | {f"{HOISTED}{k}": w.constant(k) for k in range(count)}


def outputs_at(w: LoopWriter, stem: str, time: str, disturbances: list[str]) -> list[str]:
    """The plant's outputs (stem "o") or what is measured of it (stem "y") at the present state."""
    layout, wiring = w.layout, w.layout.wiring
    x, u = w.loads("x", layout.states), w.loads("ub", len(wiring.driven))
    p = w.loads("p", len(wiring.plant.before.outputs))
    return w.kernel(outputs_of(wiring.plant.main, stem), plant_names(x, u, disturbances, time, p))


def write_noise(w: LoopWriter) -> None:
    """The noise of a sample, in blocks of its own: it calls the mathematical library."""
    for k, noisy in enumerate(w.layout.noisy):
        if noisy:
            with w.runs():
                counter = f"np.uint64(k) * np.uint64({w.layout.channels}) + np.uint64({2 * k})"
                w.store(f"noise{k}", f"{w.setting(f'std{k}')} * normal({w.seed}, {counter})")


def write_measurement(w: LoopWriter) -> None:
    """Time of the sample, the plant's outputs and their figures, measured values with noise and steps."""
    layout, wiring = w.layout, w.layout.wiring
    time = "time"
    if layout.jittered:
        w.store("older_time", w.load("time"))
        time = w.load("next")
        w.store("time", time)
        counter = f"np.uint64(k + 1) * np.uint64({layout.channels}) + np.uint64({layout.channels - 2})"
        w.store("next", f"(k + 1) * {w.setting('period')} + {w.setting('jitter')} * uniform({w.seed}, {counter})")
    if layout.missing:
        counter = f"np.uint64(k) * np.uint64({layout.channels}) + np.uint64({layout.channels - 1})"
        # The first sample is never missed: the controller has to start.
        lost = f"uniform({w.seed}, {counter}) < {w.setting('missed')} and k > 0"
        w.store("missed", f"1.0 if {lost} else 0.0")
    d = [w.new(f"other{k} + {w.load(f'd{k}')}") for k in range(len(wiring.others))]
    missed = w.load("missed") if layout.missing else None
    for k, measured in enumerate(outputs_at(w, "y", time, d)):
        value = _read(w, k, measured)
        older = w.load(f"yn{k}")
        w.store(f"yo{k}", older)
        w.store(f"yn{k}", value if missed is None else f"{older} if {missed} == 1.0 else {value}")
    _write_figures(w, outputs_at(w, "o", time, d))


def _read(w: LoopWriter, k: int, value: str) -> str:
    layout = w.layout
    if layout.noisy[k]:
        value = w.new(f"{value} + {w.load(f'noise{k}')}")
    if layout.quantised[k]:
        step = w.setting(f"step{k}")
        code = w.floor(w.new(f"{value} * {w.setting(f'codes{k}')} + 0.5"))
        value = w.new(f"{step} * {code}")
        low, high = w.setting(f"code_low{k}"), w.setting(f"code_high{k}")
        value = w.new(f"{high} if {value} > {high} else {value}")
        value = w.new(f"{low} if {value} < {low} else {value}")
    return value


def _write_figures(w: LoopWriter, outputs: list[str]) -> None:
    """Last, least and most of each output; `entered` counts the runs that came into a band."""
    for k, value in enumerate(outputs):
        target, band, last = w.load(f"target{k}"), w.load(f"band{k}"), w.load(f"last{k}")
        now, then = w.new(f"abs({value} - {target})"), w.new(f"abs({last} - {target})")
        w.line(f"entered += 1 if {now} <= {band} and not {then} <= {band} else 0")
        least, most = w.load(f"least{k}"), w.load(f"most{k}")
        w.store(f"before{k}", last)
        w.store(f"last{k}", value)
        w.store(f"least{k}", f"{least} if {least} < {value} else {value}")
        w.store(f"most{k}", f"{most} if {most} > {value} else {value}")


def write_entries(w: LoopWriter) -> None:
    """Where the straight line between the samples enters the band: seldom, one run after the other."""
    if not w.layout.outputs:
        return
    with w.block("if entered != 0:"), w.each():
        for k in range(w.layout.outputs):
            target, band = w.at(f"target{k}"), w.at(f"band{k}")
            w.line(f"now = abs({w.at(f'last{k}')} - {target})")
            w.line(f"then = abs({w.at(f'before{k}')} - {target})")
            with w.block(f"if now <= {band} and not then <= {band}:"):
                time, earlier = "time", "earlier"
                if w.layout.jittered:
                    time, earlier = w.at("time"), w.at("older_time")
                crossing = f"{earlier} + ({band} - then) / (now - then) * ({time} - {earlier})"
                w.line(f"{w.at(f'settled{k}')} = {crossing}")


def write_update(w: LoopWriter) -> None:
    """The controller's states from the last sample to this one; at the first they stay."""
    layout, wiring = w.layout, w.layout.wiring
    z = w.loads("z", layout.memory)
    samples = w.loads("yo", len(wiring.measured)), w.loads("yn", len(wiring.measured))
    u = w.loads("believed", len(wiring.driven))
    own = w.loads("r", len(wiring.references))
    before = [w.new(f"older{k} + {text}") for k, text in enumerate(own)]
    after = [w.new(f"reference{k} + {text}") for k, text in enumerate(own)]
    match layout.discretisation:
        case Euler(substeps=steps, interpolate=interpolate):
            z_new = _euler(w, _Row(w, "z'", samples, u, interpolate=interpolate), z, (before, before), steps)
        case RungeKutta4(substeps=steps, interpolate=interpolate):
            z_new = _runge_kutta(w, _Row(w, "z'", samples, u, interpolate=interpolate), z, (before, after), steps)
        case ExactHold(interpolate=interpolate):
            z_new = _exact(w, z, samples, u, (before, after), interpolate=interpolate)
    missed = f" and {w.load('missed')} == 0.0" if layout.missing else ""
    for k, advanced in enumerate(z_new):
        w.store(f"z{k}", f"{advanced} if k > 0{missed} else {z[k]}")
        if k in layout.frozen:
            w.store(f"kept{k}", z[k])


Pair = tuple[list[str], list[str]]


class _Row:
    """A row of the controller's kernel between two samples of y, with u held.

    What is costly and depends on y alone is computed at each sample and handed on to the next one.
    """

    def __init__(self, w: LoopWriter, stem: str, samples: Pair, u: list[str], *, interpolate: bool) -> None:
        wiring = w.layout.wiring
        self.w, self.samples, self.u, self.interpolate = w, samples, u, interpolate
        fixed = [f"y{k}" for k in range(len(wiring.measured))]
        fixed += [f"{HOISTED}{k}" for k in range(len(wiring.controller.before.outputs))]
        self.parts = carried(outputs_of(wiring.controller.main, stem), fixed)
        slots = f"carried_{stem[0]}"
        older = w.loads(slots, len(self.parts.before.outputs))
        newer = self._costly(samples[1])
        for k, value in enumerate(newer):
            w.store(f"{slots}{k}", value)
        self.known = {0.0: older, 1.0: newer}

    def __call__(self, z: list[str], r: list[str], fraction: float) -> list[str]:
        """The row for states z and references r, this part of a period after the older sample."""
        at = fraction if self.interpolate else 0.0
        y = _between(self.w, self.samples, at)
        if at not in self.known:
            self.known[at] = self._costly(y)
        names = {f"{CARRIED}{k}": text for k, text in enumerate(self.known[at])}
        return self.w.kernel(self.parts.main, names | _controller_names(self.w, z, y, self.u, r))

    def _costly(self, y: list[str]) -> list[str]:
        unused = dict.fromkeys(self.parts.before.inputs, "0.0")
        return self.w.kernel(self.parts.before, unused | _controller_names(self.w, [], y, [], []))


def _between(w: LoopWriter, pair: Pair, fraction: float) -> list[str]:
    older, newer = pair
    if older is newer or fraction == 0.0:
        return older
    if fraction == 1.0:
        return newer
    return [w.new(f"{a} + {fraction!r} * ({b} - {a})") for a, b in zip(older, newer, strict=True)]


def _euler(w: LoopWriter, rates: _Row, z: list[str], r: Pair, steps: int) -> list[str]:
    h = w.new(f"{w.setting('period')} / {float(steps)}")
    for j in range(steps):
        z = moved(w, z, h, rates(z, _between(w, r, j / steps), j / steps))
    return z


def _runge_kutta(w: LoopWriter, rates: _Row, z: list[str], r: Pair, steps: int) -> list[str]:
    h = w.new(f"{w.setting('period')} / {float(steps)}")
    half, sixth = w.new(f"0.5 * {h}"), w.new(f"{h} / 6.0")
    for j in range(steps):
        at = [(j + c) / steps for c in (0.0, 0.5, 1.0)]
        r_at = [_between(w, r, c) for c in at]
        k1 = rates(z, r_at[0], at[0])
        k2 = rates(moved(w, z, half, k1), r_at[1], at[1])
        k3 = rates(moved(w, z, half, k2), r_at[1], at[1])
        k4 = rates(moved(w, z, h, k3), r_at[2], at[2])
        z = combined(w, z, sixth, (k1, k2, k3, k4))
    return z


def moved(w: LoopWriter, x: list[str], h: str, rates: list[str]) -> list[str]:
    """x + h x'."""
    return [w.new(f"fused({h}, {b}, {a})") for a, b in zip(x, rates, strict=True)]


def combined(w: LoopWriter, x: list[str], sixth: str, k: tuple[list[str], ...]) -> list[str]:
    """x + h/6 (k1 + 2 k2 + 2 k3 + k4)."""
    return [
        w.new(f"fused({sixth}, fused(2.0, {c} + {d}, {b} + {e}), {a})") for a, b, c, d, e in zip(x, *k, strict=True)
    ]


def _exact(w: LoopWriter, z: list[str], samples: Pair, u: list[str], r: Pair, *, interpolate: bool) -> list[str]:
    """Φ ẑ + G₀ w(y_k, u_k) + G₁ w(y_{k+1}, u_k); the law's states by the trapezoidal rule."""
    wiring = w.layout.wiring
    n = wiring.observed
    start = len(wiring.controller.before.outputs)
    injected = _Row(w, "w", samples, u, interpolate=interpolate)
    w0 = injected(z, r[0], 0.0)
    w1 = injected(z, r[0], 1.0) if interpolate else []
    z_new = []
    for i in range(n):
        value = "0.0"
        for block, row in enumerate((z[:n], w0, w1)):
            for j, text in enumerate(row):
                value = w.new(f"fused({w.constant(start + (block * n + i) * n + j)}, {text}, {value})")
        z_new.append(value)
    own = list(range(n, len(z)))
    if own:
        h = w.setting("period")
        rates = _Row(w, "z'", samples, u, interpolate=True)
        k1 = rates(z, r[0], 0.0)
        guess = z_new + [w.new(f"fused({h}, {k1[k]}, {z[k]})") for k in own]
        k2 = rates(guess, r[1], 1.0)
        z_new += [w.new(f"fused(0.5 * {h}, {k1[k]} + {k2[k]}, {z[k]})") for k in own]
    return z_new


def write_command(w: LoopWriter) -> None:
    """Estimates, commands, their limits, the delay, and what the drive will make of them."""
    layout, wiring = w.layout, w.layout.wiring
    z, y = w.loads("z", layout.memory), w.loads("yn", len(wiring.measured))
    u = w.loads("believed", len(wiring.driven))
    r = [w.new(f"reference{k} + {w.load(f'r{k}')}") for k in range(len(wiring.references))]
    missed = w.load("missed") if layout.missing else None
    commands = _commanded(w, z, y, u, r)
    estimates = w.kernel(outputs_of(wiring.controller.main, "e"), _controller_names(w, z, y, u, r))
    for k, value in enumerate(estimates):
        w.store(f"e{k}", value)
    faults = []
    for k, computed in enumerate(commands):
        command = computed
        if missed is not None:
            command = w.new(f"{w.load(f'c{k}')} if {missed} == 1.0 else {computed}")
        w.store(f"c{k}", command)
        # A NaN, an infinity: the difference is then no number, and no number is what it is added to.
        faults.append(w.new(f"{command} - {command}"))
        w.store(f"wanted{k}", limited(w, k, command, w.load(f"h{k}_0")))
    w.store("faulty", " + ".join(faults))
    _write_delay(w)


def _commanded(w: LoopWriter, z: list[str], y: list[str], u: list[str], r: list[str]) -> list[str]:
    """The commands; integrals whose step pushed a saturated command farther out are put back."""
    layout = w.layout
    kernel = outputs_of(layout.wiring.controller.main, "c")
    commands = w.kernel(kernel, _controller_names(w, z, y, u, r))
    if not layout.frozen:
        return commands
    kept = list(z)
    for k in layout.frozen:
        kept[k] = w.load(f"kept{k}")
    others = w.kernel(kernel, _controller_names(w, kept, y, u, r))
    beyond, beyond_kept = _excess(w, commands), _excess(w, others)
    frozen = w.new(f"1.0 if {beyond} > {beyond_kept} else 0.0")
    for k in layout.frozen:
        w.store(f"z{k}", f"{kept[k]} if {frozen} == 1.0 else {z[k]}")
        z[k] = w.load(f"z{k}")
    return [w.new(f"{b} if {frozen} == 1.0 else {a}") for a, b in zip(commands, others, strict=True)]


def _excess(w: LoopWriter, commands: list[str]) -> str:
    """Sum over the inputs of how far a command lies outside its limits."""
    terms = []
    for k, command in enumerate(commands):
        if w.layout.saturated[k]:
            above, below = f"{command} - {w.setting(f'upper{k}')}", f"{w.setting(f'lower{k}')} - {command}"
            over = w.new(f"{above} if {above} > 0.0 else 0.0")
            terms.append(w.new(f"{below} if {below} > 0.0 else {over}"))
    return w.new(" + ".join(terms) or "0.0")


def limited(w: LoopWriter, k: int, command: str, before: str) -> str:
    """Slew limit, then saturation. A NaN fails every comparison and ends on a limit, never on the plant."""
    layout = w.layout
    value = command
    if layout.slewed[k]:
        change = w.setting(f"change{k}")
        value = w.new(f"{value} if {value} <= {before} + {change} else {before} + {change}")
        value = w.new(f"{value} if {value} >= {before} - {change} else {before} - {change}")
    if layout.saturated[k]:
        upper, lower = w.setting(f"upper{k}"), w.setting(f"lower{k}")
        value = w.new(f"{value} if {value} <= {upper} else {upper}")
        value = w.new(f"{value} if {value} >= {lower} else {lower}")
    return value


def _write_delay(w: LoopWriter) -> None:
    """h_0 is the newest limited command, h_j the one j samples older; the plant gets h_m, before that h_{m+1}."""
    layout = w.layout
    m = layout.whole_delay
    for k in range(len(layout.wiring.driven)):
        row = [w.load(f"wanted{k}"), *(w.load(f"h{k}_{j}") for j in range(m + layout.split))]
        for j, value in enumerate(row):
            w.store(f"h{k}_{j}", value)
        late, early = row[m], row[m + layout.split]
        believed = late
        if layout.split:
            believed = w.new(f"{late} + {w.setting('fraction')} * ({early} - {late})")
        w.store(f"believed{k}", believed)
        mean = layout.bridged[k] and not layout.switched[k]
        w.store(f"ua{k}", _bridge(w, k, early) if mean else early)
        w.store(f"ub{k}", _bridge(w, k, late) if mean else late)


def pulse(w: LoopWriter, k: int, value: str) -> tuple[str, str]:
    """(height, part of the period) of a pulse of the bridge."""
    supply = w.setting(f"supply{k}")
    asked = w.new(f"abs({value}) / {supply}")
    duty = w.new(f"{asked} if {asked} <= 1.0 else 1.0")
    height = w.new(f"{supply} * (1.0 - {w.setting(f'sag{k}')} * {duty})")
    short = w.new(f"{duty} - {w.setting(f'dead{k}')}")
    part = w.new(f"{short} if {short} > 0.0 else 0.0")
    return w.new(f"{height} if {value} >= 0.0 else -{height}"), part


def _bridge(w: LoopWriter, k: int, value: str) -> str:
    height, part = pulse(w, k, value)
    return w.new(f"{height} * {part}")
