"""Many runs of the paper's closed loop with observer, 5 s, random load and resistance: time of a run beside its error.

Contenders are interleaved, each on one core. Each gets the loosest tolerance (in decades) with which the states of all
runs stay within 1e-6 of the reference at 0.2, 1 and 5 s. The reference is our engine at 1e-15, itself compared with
SciPy at 1e-12. The C program is written for this loop: Dormand-Prince 8(5,3), eight runs in lockstep, sine and cosine
from the vector library, -ffast-math. "With peaks" also finds the largest |u|; its error is relative.

    python benchmarks/continuous_ensemble.py [--runs 10000] [--rounds 10] [--large 1000000]
"""

from __future__ import annotations

import argparse
import ctypes
import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import heyoka as hy
import numpy as np
from scipy.integrate import DOP853, solve_ivp

import ulna
from ulna import Ends, Figures, Taylor, simulate
from ulna.program import Hoisted, hoist, to_numpy, to_python, to_python_source
from ulna.program.lowering.heyoka import to_heyoka
from ulna.symbolic.compiling import kernel
from ulna.system import System

GOAL = 1e-6
END = 5.0
INITIAL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
LANES = 8
GRID = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Ensemble:
    """The loop with random parameters: (N,) each, and what the rates need of them: (c, N)."""

    loop: System
    parameters: dict[str, np.ndarray]
    split: Hoisted
    constants: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """A way to run all of it: end → (N, 6) states then, or (N,) peaks of |u| until then; `count` of the N runs."""

    name: str
    run: Callable[[float], np.ndarray]
    count: int


def ensemble(runs: int) -> Ensemble:
    arm = ulna.model("one_link_arm")
    fixed = arm.with_values()
    law = ulna.state_feedback(ulna.controller_form(fixed), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(fixed), ulna.Poles(-9, -10, -11))
    loop = ulna.close_loop(arm, ulna.compensator(law, observer)).system
    u = [(s, e) for s, e in zip(loop.outputs, loop.readouts, strict=True) if s.name == "u"]
    loop = replace(loop, outputs=tuple(s for s, _ in u), readouts=tuple(e for _, e in u))
    random = np.random.default_rng(0)
    given = {"m2": random.uniform(4, 6, runs), "Ra": random.uniform(0.9, 1.1, runs)}
    held = loop.parameter_symbols
    outputs = {f"{s.name}'": e for s, e in zip(loop.states, loop.inline(loop.rates), strict=True)}
    outputs["u"] = loop.inline(loop.readouts)[0]
    split = hoist(kernel("loop", [*loop.state_symbols, *held], outputs, held=held), [s.name for s in held])
    values = {p.name: given.get(p.name, float(p.si_value or 0)) for p in loop.parameters}
    found = to_numpy(split.before)(*(values[name] for name in split.before.inputs))
    constants = np.array([np.broadcast_to(row, runs) for row in found])
    return Ensemble(loop=loop, parameters=given, split=split, constants=constants)


def ours(all_: Ensemble, tolerance: float, *, peaks: bool) -> Contender:
    runs = all_.constants.shape[1]

    def run(end: float) -> np.ndarray:
        found = simulate(
            all_.loop,
            INITIAL,
            end,
            engine=Taylor(tolerance=tolerance),
            parameters=all_.parameters,
            record=Figures(samples=1) if peaks else Ends(),
            threads=1,
        )
        return found.peak_error[:, 0] if peaks else found.final_state

    return Contender(name=_label("ulna.simulate", tolerance, peaks), run=run, count=runs)


def bare_heyoka(all_: Ensemble, tolerance: float, *, peaks: bool) -> Contender:
    main, constants = all_.split.main, all_.constants
    variables = [hy.expression(f"s{k}") for k in range(6)]
    sources = dict(zip((s.name for s in all_.loop.states), variables, strict=True))
    sources |= {name: hy.par[k] for k, name in enumerate(all_.split.before.outputs)}
    rates = list(to_heyoka(main, sources).values())[:6]
    batch = hy.taylor_adaptive_batch(list(zip(variables, rates, strict=True)), np.zeros((6, LANES)), tol=tolerance)
    runs, used = constants.shape[1], len(batch.pars)
    evaluate = to_numpy(main)

    def run(end: float) -> np.ndarray:
        found = np.empty(runs) if peaks else np.empty((runs, 6))
        state, pars = batch.state, batch.pars
        times = np.repeat(np.linspace(0, end, GRID + 1)[:, None], LANES, axis=1)
        for first in range(0, runs, LANES):
            lanes = slice(first, first + LANES)
            batch.set_time(0.0)
            state[:] = INITIAL[:, None]
            pars[:] = constants[:used, lanes]
            if peaks:
                path = batch.propagate_grid(times)[1]
                u = evaluate(*np.moveaxis(path, 1, 0), *constants[:, lanes])[6]
                found[lanes] = np.abs(u).max(axis=0)
            else:
                batch.propagate_until(end)
                found[lanes] = state.T
        return found

    return Contender(name=_label("bare heyoka batch", tolerance, peaks, grid=True), run=run, count=runs)


def scipy(all_: Ensemble, tolerance: float, runs: int) -> Contender:
    evaluate = to_python(all_.split.main)

    def run(end: float) -> np.ndarray:
        found = np.empty((runs, 6))
        for k in range(runs):
            fixed = all_.constants[:, k].tolist()
            path = solve_ivp(
                lambda _, x, fixed=fixed: evaluate(*x.tolist(), *fixed)[:6],
                (0, end),
                INITIAL,
                "DOP853",
                rtol=tolerance,
                atol=tolerance,
            )
            found[k] = path.y[:, -1]
        return found

    return Contender(name=_label("SciPy DOP853", tolerance, peaks=False), run=run, count=runs)


def written_c(all_: Ensemble, tolerance: float, folder: Path, *, peaks: bool) -> Contender | None:
    """The program, compiled; None without a compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    source, library = folder / "loop.c", folder / "loop.so"
    if not library.exists():
        source.write_text(c_source(all_), encoding="utf-8")
        flags = ["-O3", "-march=native", "-ffast-math", "-fopenmp-simd", "-shared", "-fPIC"]
        subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lmvec", "-lm"], check=True)  # noqa: S603
    program = ctypes.CDLL(str(library))
    pointer = ctypes.POINTER(ctypes.c_double)
    program.run.argtypes = [ctypes.c_long, ctypes.c_double, ctypes.c_double, ctypes.c_int, *(pointer,) * 4]
    runs = all_.constants.shape[1]
    constants = np.ascontiguousarray(all_.constants)

    def run(end: float) -> np.ndarray:
        final, peak = np.empty((runs, 6)), np.empty(runs)
        arrays = (a.ctypes.data_as(pointer) for a in (INITIAL, constants, final, peak))
        program.run(runs, end, tolerance, int(peaks), *arrays)
        return peak if peaks else final

    return Contender(name=_label("C, eight lanes", tolerance, peaks), run=run, count=runs)


def c_source(all_: Ensemble) -> str:
    """Dormand-Prince 8(5,3) for this loop, all coefficients and formulas written out."""
    main, n = all_.split.main, 6
    body = to_python_source(main, function_name="f").splitlines()[1:]
    names = dict(zip(main.inputs, main.identifiers, strict=True))
    fields = [f"double {names[s.name]} = x[{k}][l];" for k, s in enumerate(all_.loop.states)]
    fields += [f"double {names[name]} = c[{k}][l];" for k, name in enumerate(all_.split.before.outputs)]
    for line in body:
        text = line.strip().replace("math.", "")
        if text.startswith("return"):
            values = text.removeprefix("return").strip().strip("()").split(",")
            fields += [f"k[{j}][l] = {value.strip()};" for j, value in enumerate(values[:n])]
            fields.append(f"u[l] = {values[n].strip()};")
        elif text:
            fields.append(f"double {text};")
    stages = []
    for s in range(1, 12):
        terms = " + ".join(f"{a!r} * k[{j}][i][l]" for j, a in enumerate(DOP853.A[s, :s].tolist()) if a)
        stages.append(f"EACH y[i][l] = x[i][l] + h * ({terms});\nfield(y, c, k[{s}], u);")
    sums = {
        name: " + ".join(f"{a!r} * k[{j}][i][l]" for j, a in enumerate(row.tolist()) if a)
        for name, row in (("b", DOP853.B), ("e5", DOP853.E5), ("e3", DOP853.E3))
    }
    return _C.format(field="\n    ".join(fields), stages="\n".join(stages), **sums, c=len(all_.constants))


_C = """
#include <math.h>
#define L 8
#define N 6
#define C {c}
#define EACH for (int i = 0; i < N; i++) _Pragma("omp simd") for (int l = 0; l < L; l++)
/* Sine and cosine of one angle would become one call, for which the vector library has no function. */
#define cos(a) sin((a) + M_PI_2)
typedef double Rows[L];
static inline void field(Rows *restrict x, Rows *restrict c, Rows *restrict k, double *restrict u) {{
  #pragma omp simd
  for (int l = 0; l < L; l++) {{
    {field}
  }}
}}
static void look(Rows *x, Rows *c, double *u, double *peak) {{
  Rows k[N];
  field(x, c, k, u);
  for (int l = 0; l < L; l++) peak[l] = fmax(peak[l], fabs(u[l]));
}}
void run(long runs, double end, double tol, int peaks, double *initial, double *constants, double *final,
         double *top) {{
  for (long first = 0; first < runs; first += L) {{
    Rows x[N], y[N], c[C], k[13][N];
    double u[L], peak[L] = {{0}}, t = 0, h = 1e-3;
    for (int l = 0; l < L; l++) {{
      long r = first + l < runs ? first + l : runs - 1;
      for (int i = 0; i < N; i++) x[i][l] = initial[i];
      for (int i = 0; i < C; i++) c[i][l] = constants[i * runs + r];
    }}
    field(x, c, k[0], u);
    if (peaks) look(x, c, u, peak);
    while (t < end) {{
      if (t + h > end) h = end - t;
{stages}
      double worst = 0;
      double e5[L] = {{0}}, e3[L] = {{0}};
      EACH {{
        y[i][l] = x[i][l] + h * ({b});
        double scale = tol + tol * fmax(fabs(x[i][l]), fabs(y[i][l]));
        double a = ({e5}) / scale, b = ({e3}) / scale;
        e5[l] += a * a;
        e3[l] += b * b;
      }}
      for (int l = 0; l < L; l++) {{
        double whole = e5[l] > 0 ? h * e5[l] / sqrt((e5[l] + 0.01 * e3[l]) * N) : 0;
        worst = fmax(worst, whole);
      }}
      double factor = worst > 0 ? 0.9 * pow(worst, -0.125) : 10;
      if (worst < 1) {{
        field(y, c, k[12], u);
        if (peaks) {{
          for (int part = 1; part <= 8; part++) {{
            double s = part / 8.0;
            Rows z[N];
            EACH {{
              double d = y[i][l] - x[i][l];
              double bent = (1 - 2 * s) * d + (s - 1) * h * k[0][i][l] + s * h * k[12][i][l];
              z[i][l] = x[i][l] + s * d + s * (s - 1) * bent;
            }}
            look(z, c, u, peak);
          }}
        }}
        t = t + h < end ? t + h : end;
        EACH {{ x[i][l] = y[i][l]; k[0][i][l] = k[12][i][l]; }}
        h *= fmin(10, fmax(0.2, factor));
      }} else h *= fmin(1, fmax(0.2, factor));
    }}
    for (int l = 0; l < L && first + l < runs; l++) {{
      for (int i = 0; i < N; i++) final[(first + l) * N + i] = x[i][l];
      top[first + l] = peak[l];
    }}
  }}
}}
"""


def _label(name: str, tolerance: float, peaks: bool, *, grid: bool = False) -> str:
    on_grid = f" on {GRID} intervals" if grid else ""
    return f"{name}, tol {tolerance:.0e}" + (f", with peaks{on_grid}" if peaks else "")


def state_error(contender: Contender, exact: dict[float, np.ndarray]) -> float:
    return max(float(np.abs(contender.run(end) - states[: contender.count]).max()) for end, states in exact.items())


def loosest(
    make: Callable[[float], Contender | None], exact: dict[float, np.ndarray]
) -> tuple[Contender, float, float] | None:
    """(contender, its error, its tolerance): the first of 1e-4, 1e-5, … whose error is below the goal."""
    for exponent in range(4, 13):
        contender = make(10.0**-exponent)
        if contender is None:
            return None
        error = state_error(contender, exact)
        if error <= GOAL:
            return contender, error, 10.0**-exponent
    return None


def interleaved(contenders: list[Contender], rounds: int) -> dict[str, float]:
    """Least CPU seconds of a run of each contender."""
    best = {each.name: math.inf for each in contenders}
    for _ in range(rounds):
        for each in contenders:
            begun = time.process_time()
            each.run(END)
            best[each.name] = min(best[each.name], (time.process_time() - begun) / each.count)
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--large", type=int, default=1_000_000, help="runs of one last, large ensemble; 0: none")
    given = parser.parse_args()
    runs = -(-given.runs // LANES) * LANES
    all_ = ensemble(runs)
    exact = {end: ours(all_, 1e-15, peaks=False).run(end) for end in (0.2, 1.0, END)}
    highest = ours(all_, 1e-15, peaks=True).run(END)
    print(f"reference beside SciPy at 1e-12: {state_error(scipy(all_, 1e-12, 3), exact):.1e}")
    with tempfile.TemporaryDirectory() as folder:
        makers: list[Callable[[float, bool], Contender | None]] = [
            lambda tolerance, peaks: ours(all_, tolerance, peaks=peaks),
            lambda tolerance, peaks: bare_heyoka(all_, tolerance, peaks=peaks),
            lambda tolerance, peaks: written_c(all_, tolerance, Path(folder), peaks=peaks),
            lambda tolerance, peaks: None if peaks else scipy(all_, tolerance, 20),
        ]
        ends: list[Contender] = []
        tops: list[Contender] = []
        errors: dict[str, float] = {}
        for make in makers:
            found = loosest(lambda tolerance, make=make: make(tolerance, False), exact)
            if found is None:
                continue
            ends.append(found[0])
            errors[found[0].name] = found[1]
            with_peaks = make(found[2], True)
            if with_peaks is not None:
                tops.append(with_peaks)
                errors[with_peaks.name] = float(np.abs(with_peaks.run(END) / highest - 1.0).max())
        spent = interleaved(ends + tops, given.rounds)
    for title, group in (("final states", ends), ("peak of |u|", tops)):
        print(f"\n{title:52} {'time of a run':>14} {'ratio':>8} {'error':>9}")
        for each in group:
            ratio = spent[each.name] / spent[group[0].name]
            print(f"{each.name:52} {spent[each.name] * 1e6:11.2f} us {ratio:7.2f}x {errors[each.name]:9.1e}")
    if given.large:
        print(
            f"\n{large(given.large, float(ends[0].name.split()[-1])):.2f} us a run in an ensemble of {given.large} runs"
        )


def large(runs: int, tolerance: float) -> Any:
    """CPU microseconds of a run in a large ensemble."""
    contender = ours(ensemble(runs), tolerance, peaks=False)
    contender.run(END)
    begun = time.process_time()
    contender.run(END)
    return (time.process_time() - begun) / runs * 1e6


if __name__ == "__main__":
    main()
