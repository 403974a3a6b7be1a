"""The paper's sampled loop written by hand for C (one run, runs side by side), CasADi, SciPy and python-control.

All of them do the same: at each millisecond the encoder is read, the observer goes one Runge-Kutta step on from the
last sample with y on a straight line, the command is limited and held, and the plant takes one Runge-Kutta step, or one
for each pulse and each pause of a bridge at 20 kHz. SciPy moves the plant by `odeint` instead.
"""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import control
import numpy as np
from scipy.integrate import odeint

PERIOD, SAMPLES, END = 1e-3, 5000, 5.0
STEP = 2 * np.pi / 4096
LANES = 32

C_SOURCE = r"""
#include <math.h>
#include <string.h>
static const double h = 1e-3, st = 2*M_PI/4096;
#define EACH for (int l = 0; l < LANES; l++)
#if LANES > 1
/* The compiler makes vector code of arithmetic only. These are faster than the vector functions of the C library. */
#define R 6755399441055744.0
static inline double reduced(double x, double n) {
  double r = x - 3.141592653589793*n - 1.2246467991473532e-16*n, w = r*r, q = w*w;
  double e = ((-7.64304346538988e-13*q - 2.5052106921615934e-08)*q - 0.00019841269841213368)*q - 0.16666666666666666;
  double o = ((2.7216780035058983e-15*q + 1.605894190347732e-10)*q + 2.7557319211744394e-06)*q + 0.008333333333333208;
  return r + r*w*(w*o + e);
}
static inline double signed_by(double value, double turns, long flip) {
  long v, t;
  memcpy(&v, &value, 8); memcpy(&t, &turns, 8);
  v ^= (t ^ flip) << 63;
  memcpy(&value, &v, 8);
  return value;
}
static inline double sine(double x) { double t = x*0.3183098861837907 + R; return signed_by(reduced(x, t-R), t, 0); }
static inline double cosine(double x) {
  double t = (x*0.3183098861837907 - 0.5) + R;
  return signed_by(reduced(x, (t-R) + 0.5), t, 1);
}
#else
#define sine sin
#define cosine cos
#endif
#define F(x0,x1,x2,d0,d1,d2) d0=x1; d1=(17.64/0.51)*cosine(x0)*gm+x2*(1/0.51)*jm; d2=-10*(x1)-10*(x2)+10*u;
#define O(z0,z1,z2,y,cy,d0,d1,d2) { double e=(y)-(z0); d0=(z1)+20*e; \
  d1=(z2)*(1/0.51)+34.588235294117645*(cy)+79.3921568627451*e; d2=10*ub-10*(z1)-10*(z2)-100*e; }
#define PLANT(volts, span) { double u=volts,d_=span,a0,a1,a2,b0,b1,b2,c0,c1,c2,d0,d1,d2; \
  F(x0,x1,x2,a0,a1,a2) \
  F((x0+.5*d_*a0),(x1+.5*d_*a1),(x2+.5*d_*a2),b0,b1,b2) \
  F((x0+.5*d_*b0),(x1+.5*d_*b1),(x2+.5*d_*b2),c0,c1,c2) \
  F((x0+d_*c0),(x1+d_*c1),(x2+d_*c2),d0,d1,d2) \
  x0+=d_/6*(a0+2*b0+2*c0+d0); x1+=d_/6*(a1+2*b1+2*c1+d1); x2+=d_/6*(a2+2*b2+2*c2+d2); }
#define MEASURE double y = st*floor(x0*(1/st)+0.5);
#define COMMAND double u = 1.764*z1*sine(z0)-21.168*cosine(z0)-6.528*z0-1.448*z1-.2*z2; \
  u = u <= 24 ? u : 24; u = u >= -24 ? u : -24; U[l]=u; YO[l]=y; PK[l] = fabs(u) > PK[l] ? fabs(u) : PK[l];
void run(const double *restrict start, const double *restrict gm_, const double *restrict jm_, int count,
         double *restrict final, double *restrict peak, double *restrict record) {
  double X0[LANES],X1[LANES],X2[LANES],Z0[LANES],Z1[LANES],Z2[LANES],YO[LANES],U[LANES],PK[LANES],GM[LANES],JM[LANES];
  EACH { X0[l]=start[l]; X1[l]=X2[l]=Z0[l]=Z1[l]=Z2[l]=PK[l]=0; GM[l]=gm_[l]; JM[l]=jm_[l]; }
  EACH { double x0=X0[l],z0=Z0[l],z1=Z1[l],z2=Z2[l]; MEASURE COMMAND }
  for (int k = 0; k < count; k++) {
    if (LANES == 1) { double *r = record + 4*k; r[0]=X0[0]; r[1]=X1[0]; r[2]=X2[0]; r[3]=YO[0]; }
#ifdef PULSES
    double ON[LANES], HI[LANES];
    EACH { double d = fabs(U[l])/24; d = d <= 1 ? d : 1; ON[l] = d*h/PULSES; HI[l] = U[l] >= 0 ? 24 : -24; }
    for (int c = 0; c < PULSES; c++) EACH {
      double x0=X0[l],x1=X1[l],x2=X2[l],gm=GM[l],jm=JM[l];
      PLANT(HI[l], ON[l])
      PLANT(0.0, h/PULSES - ON[l])
      X0[l]=x0; X1[l]=x1; X2[l]=x2;
    }
#endif
    EACH {
      double x0=X0[l],x1=X1[l],x2=X2[l],z0=Z0[l],z1=Z1[l],z2=Z2[l],ub=U[l],yo=YO[l];
#ifndef PULSES
      double gm=GM[l],jm=JM[l];
      PLANT(ub, h)
      X0[l]=x0; X1[l]=x1; X2[l]=x2;
#endif
      MEASURE
      { double a0,a1,a2,b0,b1,b2,c0,c1,c2,d0,d1,d2,ym=yo+0.5*(y-yo),co=cosine(yo),cm=cosine(ym),cn=cosine(y);
        O(z0,z1,z2,yo,co,a0,a1,a2)
        O(z0+.5*h*a0,z1+.5*h*a1,z2+.5*h*a2,ym,cm,b0,b1,b2)
        O(z0+.5*h*b0,z1+.5*h*b1,z2+.5*h*b2,ym,cm,c0,c1,c2)
        O(z0+h*c0,z1+h*c1,z2+h*c2,y,cn,d0,d1,d2)
        z0+=h/6*(a0+2*b0+2*c0+d0); z1+=h/6*(a1+2*b1+2*c1+d1); z2+=h/6*(a2+2*b2+2*c2+d2); }
      Z0[l]=z0; Z1[l]=z1; Z2[l]=z2;
      COMMAND
    }
  }
  if (LANES == 1) { double *r = record + 4*count; r[0]=X0[0]; r[1]=X1[0]; r[2]=X2[0]; r[3]=YO[0]; }
  EACH { final[3*l]=X0[l]; final[3*l+1]=X1[l]; final[3*l+2]=X2[l]; peak[l]=PK[l]; }
}
"""


def compiled_c(folder: Path, lanes: int, pulses: int = 0) -> Callable[..., None]:
    """The function `run` with so many runs side by side; with pulses a period, each is integrated."""
    source, library = folder / f"loop{lanes}_{pulses}.c", folder / f"loop{lanes}_{pulses}.so"
    source.write_text(C_SOURCE, encoding="utf-8")
    # Not -ffast-math: it would undo the rounding in sine and cosine. These let the compiler fuse and make vector code.
    flags = ["-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math"]
    if "avx512" in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
        flags.append("-mprefer-vector-width=512")
    defines = [f"-DLANES={lanes}", *([f"-DPULSES={pulses}"] if pulses else [])]
    command = ["cc", *flags, *defines, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
    subprocess.run(command, check=True)  # noqa: S603 - our own source
    loaded = ctypes.CDLL(str(library))
    pointer = np.ctypeslib.ndpointer(dtype=float, flags="C")
    loaded.run.argtypes = [pointer, pointer, pointer, ctypes.c_int, pointer, pointer, ctypes.c_void_p]
    loaded.run.restype = None
    return loaded.run


def _rk4(f: Callable[..., Any], v: Any) -> Any:
    h = PERIOD
    k1 = f(v, 0.0)
    k2 = f(v + h / 2 * k1, 0.5)
    k3 = f(v + h / 2 * k2, 0.5)
    k4 = f(v + h * k3, 1.0)
    return v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _sample(s: Any, functions: Any, row: Callable[..., Any], clipped: Callable[[Any], Any], plant: Any) -> Any:
    """One sample of (x, z, y, u, 1 from the second sample on): measure, observe, command, move the plant."""
    x, z, y_old, u_old, later = s[:3], s[3:6], s[6], s[7], s[8]

    def observer(v: Any, part: float) -> Any:
        at = y_old + part * (y - y_old)
        e = at - v[0]
        return row(
            v[1] + 20 * e,
            v[2] / 0.51 + 34.588235294117645 * functions.cos(at) + 79.3921568627451 * e,
            10 * u_old - 10 * v[1] - 10 * v[2] - 100 * e,
        )

    y = STEP * functions.floor(x[0] / STEP + 0.5)
    z = z + later * (_rk4(observer, z) - z)
    u = 1.764 * z[1] * functions.sin(z[0]) - 21.168 * functions.cos(z[0]) - 6.528 * z[0] - 1.448 * z[1] - 0.2 * z[2]
    u = clipped(u)
    return x, z, y, u, plant(x, u)


def _field(v: Any, u: Any, functions: Any, row: Callable[..., Any]) -> Any:
    return row(v[1], (17.64 * functions.cos(v[0]) + v[2]) / 0.51, -10 * v[1] - 10 * v[2] + 10 * u)


def casadi_loop() -> Callable[[], np.ndarray]:
    """(samples, 4): state and reading at each sample, by `mapaccum` over one sample."""
    s = ca.SX.sym("s", 9)

    def plant(x: Any, u: Any) -> Any:
        return _rk4(lambda v, _: _field(v, u, ca, ca.vertcat), x)

    _, z, y, u, x = _sample(s, ca, ca.vertcat, lambda u: ca.fmin(24, ca.fmax(-24, u)), plant)
    repeated = ca.Function("sample", [s], [ca.vertcat(x, z, y, u, 1)]).mapaccum("loop", SAMPLES)
    start = np.array([1.0, *[0.0] * 8])

    def run() -> np.ndarray:
        after = np.asarray(repeated(start)).T
        # A row holds the state at the end of its period.
        return np.column_stack([np.vstack([start[:3], after[:-1, :3]]), after[:, 6]])

    return run


def scipy_loop() -> np.ndarray:
    """(samples, 4): `odeint` from sample to sample, tolerance 1e-10."""

    def plant(x: Any, u: Any) -> Any:
        return odeint(lambda v, _: _field(v, u, np, lambda *r: r), x, (0.0, PERIOD), rtol=1e-10, atol=1e-10)[1]

    return _stepped(plant)


def _stepped(plant: Callable[[Any, Any], Any]) -> np.ndarray:
    s = np.array([1.0, *[0.0] * 8])
    path = np.zeros((SAMPLES, 4))
    for k in range(SAMPLES):
        x, z, y, u, moved = _sample(s, np, lambda *r: np.array(r), lambda u: min(24.0, max(-24.0, u)), plant)
        path[k] = *x, y
        s = np.array([*moved, *z, y, u, 1.0])
    return path


def control_loop() -> Callable[[], np.ndarray]:
    """(samples, 4): a discrete-time `nlsys` of one sample, by `input_output_response`."""

    def row(*parts: float) -> np.ndarray:
        return np.array(parts)

    def plant(x: Any, u: Any) -> Any:
        return _rk4(lambda v, _: _field(v, u, np, row), x)

    def update(_t: float, s: np.ndarray, _u: np.ndarray, _p: dict[str, Any]) -> np.ndarray:
        _, z, y, u, moved = _sample(s, np, row, lambda u: min(24.0, max(-24.0, u)), plant)
        return np.array([*moved, *z, y, u, 1.0])

    system = control.nlsys(update, None, inputs=1, states=9, outputs=9, dt=PERIOD)
    times = PERIOD * np.arange(SAMPLES + 1)

    def run() -> np.ndarray:
        done = control.input_output_response(system, times, 0.0, np.array([1.0, *[0.0] * 8]))
        states = np.asarray(done.states)
        return np.column_stack([states[:3, :-1].T, states[6, 1:]])

    return run
