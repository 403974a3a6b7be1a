"""Source of what happens at a sample: measure, advance the controller, compute and limit the command."""

from __future__ import annotations

from ulna.sim.sampled.discretisation import Euler, ExactHold, RungeKutta4
from ulna.sim.sampled.loop_writer import LoopWriter
from ulna.symbolic.program.hoist import HOISTED
from ulna.symbolic.program.kernel import Kernel, restricted


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
    return names | {f"{HOISTED}{k}": f"held[{k}]" for k in range(count)}


def write_measurement(w: LoopWriter) -> None:
    """Time of the sample, the plant's outputs and their figures, measured values with noise and steps."""
    layout, wiring = w.layout, w.layout.wiring
    for k, noisy in enumerate(layout.noisy):
        if noisy:
            with w.runs():
                counter = f"np.uint64(k) * np.uint64({layout.channels}) + np.uint64({2 * k})"
                w.store(f"noise{k}", f"{w.setting(f'std{k}')} * normal(g[l], {counter})")
    with w.runs():
        if layout.jittered:
            w.store("time", w.load("next"))
            counter = f"np.uint64(k + 1) * np.uint64({layout.channels}) + np.uint64({layout.channels - 2})"
            w.store("next", f"(k + 1) * {w.setting('period')} + {w.setting('jitter')} * uniform(g[l], {counter})")
        else:
            w.store("time", "time")
        if layout.missing:
            counter = f"np.uint64(k) * np.uint64({layout.channels}) + np.uint64({layout.channels - 1})"
            # The first sample is never missed: the controller has to start.
            lost = f"uniform(g[l], {counter}) < {w.setting('missed')} and k > 0"
            w.store("missed", f"1.0 if {lost} else 0.0")
    with w.runs():
        x, u = w.loads("x", layout.states), w.loads("ub", len(wiring.driven))
        d = [w.new(f"other{k} + {w.at(f'd{k}')}") for k in range(len(wiring.others))]
        p = w.loads("p", len(wiring.plant.before.outputs))
        names = plant_names(x, u, d, w.load("time"), p)
        missed = w.load("missed") if layout.missing else None
        kernel = restricted(wiring.plant.main, [label for label in wiring.plant.main.outputs if label[0] in "yo"])
        values = dict(zip(kernel.outputs, w.kernel(kernel, names), strict=True))
        for k in range(len(wiring.measured)):
            value = _read(w, k, values[f"y{k}"])
            older = w.load(f"yn{k}")
            w.store(f"yo{k}", older)
            w.store(f"yn{k}", value if missed is None else f"{older} if {missed} == 1.0 else {value}")
        _write_figures(w, [values[f"o{k}"] for k in range(layout.outputs)])


def _read(w: LoopWriter, k: int, value: str) -> str:
    layout = w.layout
    if layout.noisy[k]:
        value = w.new(f"{value} + {w.at(f'noise{k}')}")
    if layout.quantised[k]:
        step = w.setting(f"step{k}")
        code = w.floor(w.new(f"{value} * {w.setting(f'codes{k}')} + 0.5"))
        value = w.new(f"{step} * {code}")
        low, high = w.setting(f"code_low{k}"), w.setting(f"code_high{k}")
        value = w.new(f"{high} if {value} > {high} else {value}")
        value = w.new(f"{low} if {value} < {low} else {value}")
    return value


def _write_figures(w: LoopWriter, outputs: list[str]) -> None:
    """Start, last, least and most of each output, and the last time at which it came into its band."""
    alive, time, before = w.load("alive"), w.load("time"), w.load("older_time")
    for k, value in enumerate(outputs):
        target = w.load(f"target{k}")
        first = w.new(f"{value} if k == 0 else {w.at(f'first{k}')}")
        distance = w.new(f"abs({value} - {target})")
        band = w.new(f"{w.setting('band')} * abs({target} - {first})")
        older, outside, settled = w.load(f"distance{k}"), w.load(f"outside{k}"), w.load(f"settled{k}")
        least, most = w.load(f"least{k}"), w.load(f"most{k}")
        inside = w.new(f"1.0 if {distance} <= {band} else 0.0")
        # Where the straight line between the samples enters the band.
        crossing = w.new(f"{before} + ({band} - {older}) / ({distance} - {older}) * ({time} - {before})")
        entered = w.new(f"{crossing} if {inside} * {outside} == 1.0 else {settled}")
        w.store(f"first{k}", first)
        w.store(f"settled{k}", f"{entered} if {alive} == 1.0 else {settled}")
        w.store(f"outside{k}", f"1.0 - {inside} if {alive} == 1.0 else {outside}")
        w.store(f"distance{k}", distance)
        # A run that ended keeps its figures, however long others of its block go on.
        lower = w.new(f"{least} if {least} < {value} and k > 0 else {value}")
        upper = w.new(f"{most} if {most} > {value} and k > 0 else {value}")
        for name, now in (("last", value), ("least", lower), ("most", upper)):
            w.store(f"{name}{k}", f"{now} if {alive} == 1.0 else {w.at(f'{name}{k}')}")
    w.store("older_time", time)
    w.store("end", f"{time} if {alive} == 1.0 else {w.at('end')}")


def write_update(w: LoopWriter) -> None:
    """The controller's states from the last sample to this one."""
    layout, wiring = w.layout, w.layout.wiring
    with w.runs():
        z = w.loads("z", layout.memory)
        older, newer = w.loads("yo", len(wiring.measured)), w.loads("yn", len(wiring.measured))
        u = w.loads("believed", len(wiring.driven))
        own = w.loads("r", len(wiring.references))
        before = [w.new(f"older{k} + {text}") for k, text in enumerate(own)]
        after = [w.new(f"reference{k} + {text}") for k, text in enumerate(own)]
        missed = w.load("missed") if layout.missing else None
        alive = w.load("alive")
        match layout.discretisation:
            case Euler(substeps=steps, interpolate=interpolate):
                z_new = _euler(w, z, (older, newer if interpolate else older), u, (before, before), steps)
            case RungeKutta4(substeps=steps, interpolate=interpolate):
                z_new = _runge_kutta(w, z, (older, newer if interpolate else older), u, (before, after), steps)
            case ExactHold(interpolate=interpolate):
                z_new = _exact(w, z, (older, newer), u, (before, after), interpolate=interpolate)
        for k, advanced in enumerate(z_new):
            value = advanced
            if missed is not None:
                value = w.new(f"{z[k]} if {missed} == 1.0 else {advanced}")
            if k in layout.frozen:
                w.store(f"kept{k}", z[k])
            w.store(f"z{k}", f"{value} if {alive} == 1.0 else {z[k]}")


Pair = tuple[list[str], list[str]]


def _between(w: LoopWriter, pair: Pair, fraction: float) -> list[str]:
    older, newer = pair
    if older is newer or fraction == 0.0:
        return older
    if fraction == 1.0:
        return newer
    return [w.new(f"{a} + {fraction!r} * ({b} - {a})") for a, b in zip(older, newer, strict=True)]


def _rates(w: LoopWriter, z: list[str], y: list[str], u: list[str], r: list[str]) -> list[str]:
    return w.kernel(outputs_of(w.layout.wiring.controller.main, "z'"), _controller_names(w, z, y, u, r))


def _euler(w: LoopWriter, z: list[str], y: Pair, u: list[str], r: Pair, steps: int) -> list[str]:
    h = w.new(f"{w.setting('period')} / {float(steps)}")
    for j in range(steps):
        rates = _rates(w, z, _between(w, y, j / steps), u, _between(w, r, j / steps))
        z = [w.new(f"fused({h}, {b}, {a})") for a, b in zip(z, rates, strict=True)]
    return z


def _runge_kutta(w: LoopWriter, z: list[str], y: Pair, u: list[str], r: Pair, steps: int) -> list[str]:
    h = w.new(f"{w.setting('period')} / {float(steps)}")
    half, sixth = w.new(f"0.5 * {h}"), w.new(f"{h} / 6.0")
    for j in range(steps):
        y_at = [_between(w, y, (j + c) / steps) for c in (0.0, 0.5, 1.0)]
        r_at = [_between(w, r, (j + c) / steps) for c in (0.0, 0.5, 1.0)]
        k1 = _rates(w, z, y_at[0], u, r_at[0])
        k2 = _rates(w, _moved(w, z, half, k1), y_at[1], u, r_at[1])
        k3 = _rates(w, _moved(w, z, half, k2), y_at[1], u, r_at[1])
        k4 = _rates(w, _moved(w, z, h, k3), y_at[2], u, r_at[2])
        z = combined(w, z, sixth, (k1, k2, k3, k4))
    return z


def _moved(w: LoopWriter, z: list[str], h: str, rates: list[str]) -> list[str]:
    return [w.new(f"fused({h}, {b}, {a})") for a, b in zip(z, rates, strict=True)]


def combined(w: LoopWriter, x: list[str], sixth: str, k: tuple[list[str], ...]) -> list[str]:
    """x + h/6 (k1 + 2 k2 + 2 k3 + k4)."""
    return [
        w.new(f"fused({sixth}, fused(2.0, {c} + {d}, {b} + {e}), {a})") for a, b, c, d, e in zip(x, *k, strict=True)
    ]


def _exact(w: LoopWriter, z: list[str], y: Pair, u: list[str], r: Pair, *, interpolate: bool) -> list[str]:
    """Φ ẑ + G₀ w(y_k, u_k) + G₁ w(y_{k+1}, u_k); the law's states by the trapezoidal rule."""
    wiring = w.layout.wiring
    n = wiring.observed
    start = len(wiring.controller.before.outputs)
    kernel = outputs_of(wiring.controller.main, "w")
    w0 = w.kernel(kernel, _controller_names(w, z, y[0], u, r[0]))
    w1 = w.kernel(kernel, _controller_names(w, z, y[1], u, r[0])) if interpolate else []
    z_new = []
    for i in range(n):
        terms = [f"held[{start + i * n + j}] * {z[j]}" for j in range(n)]
        terms += [f"held[{start + (n + i) * n + j}] * {w0[j]}" for j in range(n)]
        if interpolate:
            terms += [f"held[{start + (2 * n + i) * n + j}] * {w1[j]}" for j in range(n)]
        z_new.append(w.new(" + ".join(terms)))
    own = list(range(n, len(z)))
    if own:
        h = w.setting("period")
        k1 = _rates(w, z, y[0], u, r[0])
        guess = z_new + [w.new(f"{z[k]} + {h} * {k1[k]}") for k in own]
        k2 = _rates(w, guess, y[1], u, r[1])
        z_new += [w.new(f"{z[k]} + 0.5 * {h} * ({k1[k]} + {k2[k]})") for k in own]
    return z_new


def write_command(w: LoopWriter) -> None:
    """Estimates, commands, their limits, the delay, and what the drive will make of them."""
    layout, wiring = w.layout, w.layout.wiring
    with w.runs():
        z, y = w.loads("z", layout.memory), w.loads("yn", len(wiring.measured))
        u = w.loads("believed", len(wiring.driven))
        r = [w.new(f"reference{k} + {w.at(f'r{k}')}") for k in range(len(wiring.references))]
        missed = w.load("missed") if layout.missing else None
        commands = _commanded(w, z, y, u, r)
        estimates = w.kernel(outputs_of(wiring.controller.main, "e"), _controller_names(w, z, y, u, r))
        for k, value in enumerate(estimates):
            w.store(f"e{k}", value)
        faulty = "0.0"
        for k, computed in enumerate(commands):
            command = computed
            if missed is not None:
                command = w.new(f"{w.at(f'c{k}')} if {missed} == 1.0 else {computed}")
            w.store(f"c{k}", command)
            # A NaN, an infinity: the difference is then no number.
            faulty = w.new(f"{faulty} if {command} - {command} == 0.0 else 1.0")
            w.store(f"wanted{k}", limited(w, k, command, w.load(f"h{k}_0")))
        w.store("faulty", faulty)
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
        kept[k] = w.new(f"{w.at(f'kept{k}')} if k > 0 else {z[k]}")
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
    with w.runs():
        for k in range(len(layout.wiring.driven)):
            for j in range(m + layout.split, 0, -1):
                w.store(f"h{k}_{j}", w.load(f"h{k}_{j - 1}"))
            w.store(f"h{k}_0", w.load(f"wanted{k}"))
    with w.runs():
        for k in range(len(layout.wiring.driven)):
            late = w.load(f"h{k}_{m}")
            early = w.load(f"h{k}_{m + 1}") if layout.split else late
            believed = late
            if layout.split:
                believed = w.new(f"{late} + {w.setting('fraction')} * ({early} - {late})")
            w.store(f"believed{k}", believed)
            mean = layout.bridged[k] and not layout.switched
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
