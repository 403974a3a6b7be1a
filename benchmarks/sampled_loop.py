"""The paper's loop on a processor at 1 kHz, 5 s, ±24 V, 12-bit encoder: time and error, all contenders interleaved.

Peers: the same loop by hand in C (system compiler, -O3 -march=native), one run and 16 runs side by side, and CasADi's
`mapaccum`. Errors are against the C loop up to the first encoder code that differs, after which two engines part.

    python benchmarks/sampled_loop.py [--rounds 10] [--runs 10000]
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import ulna
from ulna.sim import Continuous, Pwm, Quantiser, Sampled, Saturation, run_ensemble, simulate

PERIOD, SAMPLES, END = 1e-3, 5000, 5.0
STEP = 2 * np.pi / 4096

C_SOURCE = r"""
#include <math.h>
#define LANES %d
static const double h = 1e-3, st = 2*M_PI/4096;
#define EACH for (int l = 0; l < LANES; l++)
#define F(x0,x1,x2,d0,d1,d2) d0=x1; d1=(17.64/0.51)*cos(x0)*gm+x2*(1/0.51)*jm; d2=-10*(x1)-10*(x2)+10*u;
#define O(z0,z1,z2,y,cy,d0,d1,d2) { double e=(y)-(z0); d0=(z1)+20*e; \
  d1=(z2)*(1/0.51)+34.588235294117645*(cy)+79.3921568627451*e; d2=10*ub-10*(z1)-10*(z2)-100*e; }
void run(const double *start, const double *gm_, const double *jm_, int count,
         double *final, double *peak, double *record) {
  double X0[LANES],X1[LANES],X2[LANES],Z0[LANES],Z1[LANES],Z2[LANES],YO[LANES],U[LANES],PK[LANES];
  EACH { X0[l]=start[l]; X1[l]=X2[l]=Z0[l]=Z1[l]=Z2[l]=YO[l]=U[l]=PK[l]=0; }
  for (int k = 0; k <= count; k++) {
    EACH {
      double x0=X0[l],x1=X1[l],x2=X2[l],z0=Z0[l],z1=Z1[l],z2=Z2[l],ub=U[l],yo=YO[l],gm=gm_[l],jm=jm_[l];
      double y = st*floor(x0/st+0.5);
      if (k > 0) {
        double a0,a1,a2,b0,b1,b2,c0,c1,c2,d0,d1,d2,ym=yo+0.5*(y-yo),co=cos(yo),cm=cos(ym),cn=cos(y);
        O(z0,z1,z2,yo,co,a0,a1,a2)
        O(z0+.5*h*a0,z1+.5*h*a1,z2+.5*h*a2,ym,cm,b0,b1,b2)
        O(z0+.5*h*b0,z1+.5*h*b1,z2+.5*h*b2,ym,cm,c0,c1,c2)
        O(z0+h*c0,z1+h*c1,z2+h*c2,y,cn,d0,d1,d2)
        z0+=h/6*(a0+2*b0+2*c0+d0); z1+=h/6*(a1+2*b1+2*c1+d1); z2+=h/6*(a2+2*b2+2*c2+d2);
      }
      double u = 1.764*z1*sin(z0)-21.168*cos(z0)-6.528*z0-1.448*z1-.2*z2;
      u = u <= 24 ? u : 24; u = u >= -24 ? u : -24;
      PK[l] = fabs(u) > PK[l] ? fabs(u) : PK[l];
      if (record) { double *r = record + 4*k; r[0]=x0; r[1]=x1; r[2]=x2; r[3]=y; }
      U[l]=u; YO[l]=y; Z0[l]=z0; Z1[l]=z1; Z2[l]=z2;
      if (k < count) {
        double a0,a1,a2,b0,b1,b2,c0,c1,c2,d0,d1,d2;
        F(x0,x1,x2,a0,a1,a2)
        F((x0+.5*h*a0),(x1+.5*h*a1),(x2+.5*h*a2),b0,b1,b2)
        F((x0+.5*h*b0),(x1+.5*h*b1),(x2+.5*h*b2),c0,c1,c2)
        F((x0+h*c0),(x1+h*c1),(x2+h*c2),d0,d1,d2)
        X0[l]=x0+h/6*(a0+2*b0+2*c0+d0); X1[l]=x1+h/6*(a1+2*b1+2*c1+d1); X2[l]=x2+h/6*(a2+2*b2+2*c2+d2);
      }
    }
  }
  EACH { final[3*l]=X0[l]; final[3*l+1]=X1[l]; final[3*l+2]=X2[l]; peak[l]=PK[l]; }
}
"""


def compiled_c(folder: Path, lanes: int) -> Callable[..., None]:
    source, library = folder / f"loop{lanes}.c", folder / f"loop{lanes}.so"
    source.write_text(C_SOURCE % lanes, encoding="utf-8")
    # -ffast-math lets the compiler take the vector sine of the mathematical library; the lone run does without.
    fast = ["-ffast-math"] if lanes > 1 else []
    command = ["cc", "-O3", "-march=native", *fast, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
    subprocess.run(command, check=True)  # noqa: S603 - our own source
    loaded = ctypes.CDLL(str(library))
    pointer = np.ctypeslib.ndpointer(dtype=float, flags="C")
    loaded.run.argtypes = [pointer, pointer, pointer, ctypes.c_int, pointer, pointer, ctypes.c_void_p]
    loaded.run.restype = None
    return loaded.run


def casadi_loop() -> ca.Function:
    """One sample of the loop, repeated by `mapaccum`: (x, z, y, u) → (x, z, y, u)."""
    s = ca.SX.sym("s", 8)
    x, z, y_old, u_old = s[:3], s[3:6], s[6], s[7]
    h = PERIOD

    def rk4(f: Callable[..., Any], v: Any) -> Any:
        k1 = f(v, 0.0)
        k2 = f(v + h / 2 * k1, 0.5)
        k3 = f(v + h / 2 * k2, 0.5)
        k4 = f(v + h * k3, 1.0)
        return v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def observer(v: Any, part: float) -> Any:
        at = y_old + part * (y - y_old)
        e = at - v[0]
        return ca.vertcat(
            v[1] + 20 * e,
            v[2] / 0.51 + 34.588235294117645 * ca.cos(at) + 79.3921568627451 * e,
            10 * u_old - 10 * v[1] - 10 * v[2] - 100 * e,
        )

    y = STEP * ca.floor(x[0] / STEP + 0.5)
    z = rk4(observer, z)
    u = 1.764 * z[1] * ca.sin(z[0]) - 21.168 * ca.cos(z[0]) - 6.528 * z[0] - 1.448 * z[1] - 0.2 * z[2]
    u = ca.fmin(24, ca.fmax(-24, u))
    x = rk4(lambda v, _: ca.vertcat(v[1], (17.64 * ca.cos(v[0]) + v[2]) / 0.51, -10 * v[1] - 10 * v[2] + 10 * u), x)
    return ca.Function("sample", [s], [ca.vertcat(x, z, y, u)]).mapaccum("loop", SAMPLES)


def interleaved(tasks: dict[str, Callable[[], Any]], rounds: int) -> dict[str, np.ndarray]:
    """(rounds,) seconds of each task; every round times all of them."""
    for task in tasks.values():
        task()
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            begun = time.perf_counter()
            task()
            seconds[name].append(time.perf_counter() - begun)
    return {name: np.array(times) for name, times in seconds.items()}


def shown(title: str, seconds: dict[str, np.ndarray], runs: int, errors: dict[str, str]) -> None:
    base = next(iter(seconds.values()))
    print(f"\n{title:44} {'us a run':>10} {'best':>10} {'ratio':>8}  error")
    for name, spent in seconds.items():
        ratio = np.median(spent / base)
        each = spent / runs * 1e6
        print(f"{name:44} {np.median(each):10.1f} {each.min():10.1f} {ratio:7.2f}x  {errors.get(name, '')}")


def until_flip(mine: np.ndarray, reference: np.ndarray, states: np.ndarray, truth: np.ndarray) -> str:
    same = np.rint(mine / STEP) == np.rint(reference / STEP)
    last = len(same) if same.all() else int(np.argmin(same))
    worst = np.abs(states[:last] - truth[:last]).max()
    return f"{worst:.1e} up to {last * PERIOD:.3f} s (first flipped code), {np.abs(states - truth).max():.1e} over all"


def continuous_table(whole: ulna.System, initial: np.ndarray, carried: np.ndarray, rounds: int) -> None:
    """The same loop without sampling, many runs, with and without figures along the way."""
    begin = np.hstack([initial, np.zeros_like(initial)])
    settings, values = Continuous(tolerance=1e-7), {"m2": carried}
    continuous = interleaved(
        {
            "run_ensemble, one core": lambda: run_ensemble(
                whole, begin, END, time=settings, parameters=values, threads=1
            ),
            "run_ensemble, figures on 100 intervals": lambda: run_ensemble(
                whole, begin, END, time=settings, parameters=values, threads=1, samples=100
            ),
        },
        rounds,
    )
    ended = run_ensemble(whole, begin[:50], END, time=settings, parameters={"m2": carried[:50]})
    worst = max(
        np.abs(simulate(whole, begin[k], END, parameters={"m2": carried[k]}).final_state - ended.final_state[k]).max()
        for k in range(50)
    )
    shown(
        f"{len(initial)} runs, continuous",
        continuous,
        len(initial),
        {"run_ensemble, one core": f"{worst:.1e} at the end"},
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--runs", type=int, default=10_000)
    options = parser.parse_args()
    runs = options.runs
    arm = ulna.model("one_link_arm")
    exact = arm.with_values()
    law = ulna.state_feedback(ulna.controller_form(exact), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(exact), ulna.Poles(-9, -10, -11))
    common: dict[str, Any] = {
        "controller": law.system,
        "estimator": observer.system,
        "period": PERIOD,
        "saturation": Saturation(lower=-24.0, upper=24.0),
        "sensors": Quantiser(step=STEP),
    }
    loop = Sampled(**common)
    pulses = Sampled(**common, drive=Pwm(frequency=20e3, supply=24.0, switched=True))
    x0, one = np.array([1.0, 0.0, 0.0]), np.ones(16)
    with tempfile.TemporaryDirectory() as folder:
        alone, lanes = compiled_c(Path(folder), 1), compiled_c(Path(folder), 16)
        record, final, peak = np.zeros((SAMPLES + 1, 4)), np.zeros((16, 3)), np.zeros(16)
        repeated = casadi_loop()
        start = np.concatenate([x0, np.zeros(5)])

        def single() -> Any:
            alone(np.ones(1), one, one, SAMPLES, final, peak, record.ctypes.data)

        tasks = {
            "C, one run, every sample kept": single,
            "ulna.simulate": lambda: simulate(arm, x0, END, time=loop),
            "CasADi mapaccum": lambda: repeated(start),
            "ulna.simulate, 20 kHz pulses": lambda: simulate(arm, x0, END, time=pulses),
        }
        seconds = interleaved(tasks, options.rounds)
        ours = simulate(arm, x0, END, time=loop)
        path = np.asarray(repeated(start)).T
        errors = {
            "ulna.simulate": until_flip(ours["y_measured"], record[:, 3], ours.states, record[:, :3]),
            "CasADi mapaccum": until_flip(path[1:, 6], record[1:-1, 3], path[:-1, :3], record[1:-1, :3]),
        }
        shown("one run", seconds, 1, errors)
        random = np.random.default_rng(0)
        initial = np.zeros((runs, 3))
        initial[:, 0] = random.uniform(-1.0, 1.0, runs)
        carried = random.uniform(4.5, 5.5, runs)
        inertia = 0.09 * carried + 0.06
        gravity, torque = (carried + 1.0) / 6.0 * 0.51 / inertia, 0.51 / inertia
        blocks = runs // 16 * 16

        def c_lanes() -> None:
            for first in range(0, blocks, 16):
                chosen = slice(first, first + 16)
                angles = np.ascontiguousarray(initial[chosen, 0])
                lanes(angles, gravity[chosen], torque[chosen], SAMPLES, ends[chosen], peaks[chosen], None)

        ends, peaks = np.zeros((runs, 3)), np.zeros(runs)
        ensemble = interleaved(
            {
                "C, 16 runs side by side, one core": c_lanes,
                "run_ensemble, one core": lambda: run_ensemble(
                    arm, initial, END, time=loop, parameters={"m2": carried}, threads=1
                ),
                "run_ensemble, all cores": lambda: run_ensemble(
                    arm, initial, END, time=loop, parameters={"m2": carried}
                ),
            },
            max(2, options.rounds // 4),
        )
        mine = run_ensemble(arm, initial, END, time=loop, parameters={"m2": carried})
        gap = np.abs(mine.peak_input[:blocks, 0] - peaks[:blocks])
        text = f"peak input: median {np.median(gap):.1e} V, largest {gap.max():.1e} V"
        shown(f"{runs} runs, sampled", ensemble, runs, {"run_ensemble, one core": text})
    whole = ulna.close_loop(arm, ulna.compensator(law, observer)).system
    continuous_table(whole, initial, carried, max(2, options.rounds // 4))


if __name__ == "__main__":
    main()
