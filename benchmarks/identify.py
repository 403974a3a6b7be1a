"""Parameters from logs: `identify` beside SciPy's least squares over `solve_ivp` and CasADi with IPOPT.

An arm with its drive, five parameters (load, resistance, torque and back-EMF constants, viscous friction) and the
starts of two logs at 1 kHz, the encoder alone, quantised, with noise; the input is held between samples. All begin at
the same parameters, 10 to 30 % off, and stop by the same relative change of the unknowns.

* scipy: residuals by `solve_ivp` (DOP853, rtol 1e-9) from one change of the input to the next, slopes by its own finite
  differences; an evaluation costs a run of each log for each unknown.
* casadi: multiple shooting in every sample, Runge-Kutta of order four, exact derivatives, IPOPT.

CPU time without imports; the first fit of a plant, which compiles, and a further one. The error is the largest distance
of an estimate from the truth in standard errors; the distance that of a peer's estimate from `identify`'s.

    python benchmarks/identify.py [--seconds 10] [--without scipy]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import ulna
from ulna.plants import arm_with_drive, preset
from ulna.sim import Held, simulate
from ulna.system import System

FREE = ("m2", "Ra", "km", "kb", "B")
OFF = (1.2, 0.9, 1.1, 0.9, 1.3)
STEP = 2 * np.pi / 2**14
NOISE = float(np.hypot(1e-4, STEP / np.sqrt(12)))
PERIOD = 1e-3


def truth() -> System:
    return arm_with_drive(preset("paper")).with_parameters({"B": 0.5})


def log(plant: System, seed: int, seconds: float) -> ulna.Record:
    random, times = np.random.default_rng(seed), PERIOD * np.arange(round(seconds / PERIOD))
    drive = sum(
        size * np.sin(2 * np.pi * pace * times + phase)
        for size, pace, phase in zip(*(random.uniform(a, b, 6) for a, b in ((2, 6), (0.1, 4), (0, 6))), strict=True)
    )
    y = simulate(plant, [1.5, 0.0, 0.0], times, inputs={"u": Held(times=times, values=drive)})["theta"]
    y = np.round((y + 1e-4 * random.normal(size=len(times))) / STEP) * STEP
    return ulna.Record(times=times, columns={"y": y, "u": drive})


def by_scipy(plant: System, start: np.ndarray, logs: list[ulna.Record]) -> np.ndarray:
    """(5,) estimates; unknowns are factors of the start, then the starts of the logs."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import least_squares

    rates, rest = _rates(plant, np), _rest(plant)

    def residual(unknowns: np.ndarray) -> np.ndarray:
        found = []
        for k, each in enumerate(logs):
            state = unknowns[5 + 3 * k : 8 + 3 * k]
            rows = [state[0]]
            for t, u in zip(each.times[:-1], each.columns["u"], strict=False):
                args = (u, unknowns[:5] * start, rest)
                state = solve_ivp(
                    lambda _, x, u, p, r: rates(x, u, p, r), (t, t + PERIOD), state, "DOP853", args=args, rtol=1e-9
                ).y[:, -1]
                rows.append(state[0])
            found.append((np.array(rows) - each.columns["y"]) / NOISE)
        return np.concatenate(found)

    begin = np.concatenate([np.ones(5), *([each.columns["y"][0], 0.0, 0.0] for each in logs)])
    return least_squares(residual, begin, x_scale="jac", xtol=1e-9, ftol=1e-9).x[:5] * start


def by_casadi(plant: System, start: np.ndarray, logs: list[ulna.Record]) -> np.ndarray:
    import casadi as ca

    rates, rest = _rates(plant, ca), _rest(plant)
    x, u, p = ca.MX.sym("x", 3), ca.MX.sym("u"), ca.MX.sym("p", 5)
    rate = lambda z: ca.vertcat(*rates(ca.vertsplit(z), u, ca.vertsplit(p * start), rest))  # noqa: E731
    k1 = rate(x)
    k2 = rate(x + PERIOD / 2 * k1)
    k3 = rate(x + PERIOD / 2 * k2)
    k4 = rate(x + PERIOD * k3)
    step = ca.Function("step", [x, u, p], [x + PERIOD / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    cost, ties, unknowns, begin = ca.MX(0), [], [p], [np.ones(5)]
    for number, each in enumerate(logs):
        count = len(each.times)
        path = ca.MX.sym(f"X{number}", 3, count)
        ends = step.map(count - 1)(path[:, :-1], ca.DM(each.columns["u"][:-1]).T, ca.repmat(p, 1, count - 1))
        ties.append(ca.vec(ends - path[:, 1:]))
        cost += ca.sumsqr((path[0, :].T - each.columns["y"]) / NOISE) / 2
        unknowns.append(ca.vec(path))
        guess = np.zeros((3, count))
        guess[0], guess[1] = each.columns["y"], np.gradient(each.columns["y"], PERIOD)
        begin.append(guess.ravel(order="F"))
    problem = {"x": ca.vertcat(*unknowns), "f": cost, "g": ca.vertcat(*ties)}
    quiet = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-9}
    solver = ca.nlpsol("fit", "ipopt", problem, quiet)
    found = solver(x0=np.concatenate(begin), lbg=0, ubg=0)
    return np.asarray(found["x"]).ravel()[:5] * start


def _rest(plant: System) -> dict[str, float]:
    return {p.name: float(p.si_value or 0) for p in plant.parameters}


def _rates(plant: System, library: Any) -> Callable[..., list[Any]]:
    """The plant's equations by hand, as somebody without a modelling tool writes them; checked against the plant."""

    def rates(x: Any, u: Any, p: Any, r: dict[str, float]) -> list[Any]:
        m2, resistance, km, kb, drag = (p[k] for k in range(5))
        inertia = r["b"] ** 2 * (r["m1"] / 3 + m2) + r["N"] ** 2 * r["Jm"]
        weight = r["b"] * r["g"] * (r["m1"] / 2 + m2)
        speedup = (weight * library.cos(x[0]) - drag * x[1] + r["N"] * r["eta"] * km * x[2]) / inertia
        return [x[1], speedup, (u - resistance * x[2] - r["N"] * kb * x[1]) / r["La"]]

    point = [0.3, -0.7, 2.0]
    values = dict(zip((*plant.state_symbols, *plant.input_symbols), (*point, 4.0), strict=True))
    due = [float(e.subs(plant.values).subs(values)) for e in plant.inline(plant.rates)]
    own = _rest(plant)
    if not np.allclose(due, [float(e) for e in _numbers(rates, point, own)]):
        raise SystemExit("the equations written by hand are not those of the plant")
    return rates


def _numbers(rates: Callable[..., list[Any]], point: list[float], own: dict[str, float]) -> list[Any]:
    return rates(point, 4.0, [own[name] for name in FREE], own)


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.process_time()
    found = work()
    return time.process_time() - begin, found


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--seconds", type=float, default=10.0, help="length of each of the two logs")
    asked.add_argument("--without", default="", help="peers that are left out: scipy,casadi")
    options = asked.parse_args()
    plant = truth()
    logs = [log(plant, seed, options.seconds) for seed in (1, 2)]
    true = np.array([_rest(plant)[name] for name in FREE])
    start = true * OFF
    begun = plant.with_parameters(dict(zip(FREE, start, strict=True)))
    fit = lambda: ulna.identify(begun, logs, free=FREE, noise={"y": NOISE})  # noqa: E731
    (first, _), (again, found) = timed(fit), timed(fit)
    values, errors = (np.array([getattr(e, key) for e in found.estimates]) for key in ("value", "std"))
    wrong = float(np.abs((values - true) / errors).max())
    print(f"| ulna identify, first | {first:.2f} | | {wrong:.2f} | |")
    print(f"| ulna identify, again | {again:.2f} | 1 | {wrong:.2f} | |")
    for name, peer in (("casadi", by_casadi), ("scipy", by_scipy)):
        if name in options.without:
            continue
        took, other = timed(lambda peer=peer: peer(plant, start, logs))
        off, apart = (float(np.abs((other - to) / errors).max()) for to in (true, values))
        print(f"| {name} | {took:.1f} | {took / again:.0f} | {off:.2f} | {apart:.2g} |", flush=True)


if __name__ == "__main__":
    main()
