"""One run of the paper's closed loop with observer, 5 s: time beside error, all contenders interleaved.

Every contender gets the loosest tolerance (in decades) with which its error along the path stays below 1e-9; ours is
also shown with its default. The reference is the same kernel integrated in quadruple precision.

    python benchmarks/single_run.py [--rounds 30]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import control
import heyoka as hy
import numpy as np
from scipy.integrate import solve_ivp

import ulna
from ulna import Taylor, simulate
from ulna.program import Kernel, to_python
from ulna.program.lowering.heyoka import to_heyoka
from ulna.symbolic.compiling import kernel
from ulna.system import System

GOAL = 1e-9
INITIAL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
END = 5.0
GRID = np.linspace(0.0, END, 501)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """A way to run the loop. final(): to the last state; path(): (N, 6) states on the grid."""

    name: str
    final: Callable[[], Any]
    path: Callable[[], np.ndarray]


def paper_loop() -> System:
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8))
    observer = ulna.exact_observer(ulna.observer_form(arm), ulna.Poles(-9, -10, -11))
    return ulna.close_loop(arm, ulna.compensator(law, observer)).system


def rates(loop: System) -> Kernel:
    names = {f"{s.name}'": rate for s, rate in zip(loop.states, loop.inline(loop.rates), strict=True)}
    return kernel(loop.name, loop.state_symbols, names)


def taylor(loop: System, **options: Any) -> Any:
    lowered = rates(loop)
    variables = [hy.expression(name) for name in lowered.inputs]
    return hy.taylor_adaptive(list(zip(variables, to_heyoka(lowered).values(), strict=True)), **options)


def reference(loop: System) -> np.ndarray:
    state = np.array([hy.real128(value) for value in INITIAL])
    integrator = taylor(loop, state=state, fp_type=hy.real128)
    return np.array(integrator.propagate_grid(np.array([hy.real128(t) for t in GRID]))[5], dtype=float)


def bare_heyoka(loop: System, tolerance: float) -> Contender:
    integrator = taylor(loop, state=INITIAL, tol=tolerance)

    def start() -> None:
        integrator.time = 0.0
        integrator.state[:] = INITIAL

    def final() -> Any:
        start()
        integrator.propagate_until(END)
        return integrator.state.copy()

    def path() -> np.ndarray:
        start()
        return integrator.propagate_grid(GRID)[5]

    return Contender(name=f"bare heyoka, tol {tolerance:.0e}", final=final, path=path)


def ours(loop: System, tolerance: float | None = None) -> Contender:
    settings = Taylor() if tolerance is None else Taylor(tolerance=tolerance)
    label = "default" if tolerance is None else f"tol {tolerance:.0e}"
    return Contender(
        name=f"ulna.simulate, {label}",
        final=lambda: simulate(loop, INITIAL, END, engine=settings).final_state,
        path=lambda: simulate(loop, INITIAL, GRID, engine=settings).states,
    )


def scipy(loop: System, method: str, tolerance: float) -> Contender:
    evaluate = to_python(rates(loop))

    def solved(**options: Any) -> np.ndarray:
        # Plain floats: NumPy scalars would slow SciPy's right-hand side down by half.
        result = solve_ivp(
            lambda _, x: evaluate(*x.tolist()), (0, END), INITIAL, method, rtol=tolerance, atol=tolerance, **options
        )
        return result.y.T

    return Contender(
        name=f"SciPy {method}, tol {tolerance:.0e}", final=lambda: solved()[-1], path=lambda: solved(t_eval=GRID)
    )


def python_control(loop: System, method: str, tolerance: float) -> Contender:
    evaluate = to_python(rates(loop))
    system = control.NonlinearIOSystem(
        lambda _, x, __, ___: np.array(evaluate(*x.tolist())), None, inputs=0, states=6, name="loop"
    )

    def run(times: np.ndarray) -> np.ndarray:
        response = control.input_output_response(
            system,
            times,
            0,
            INITIAL,
            solve_ivp_method=method,
            solve_ivp_kwargs={"rtol": tolerance, "atol": tolerance},
            return_x=True,
        )
        return np.asarray(response.states).T

    return Contender(
        name=f"python-control {method}, tol {tolerance:.0e}",
        final=lambda: run(np.array([0.0, END]))[-1],
        path=lambda: run(GRID),
    )


def error(contender: Contender, exact: np.ndarray) -> float:
    return float(np.abs(contender.path() - exact).max())


def loosest(make: Callable[[float], Contender], exact: np.ndarray) -> Contender:
    """The first of the tolerances 1e-7, 1e-8, … whose error along the path is below the goal, else the last."""
    contender = make(1e-7)
    for exponent in range(8, 14):
        if error(contender, exact) <= GOAL:
            break
        contender = make(10.0**-exponent)
    return contender


def interleaved(tasks: dict[str, Callable[[], Any]], rounds: int) -> dict[str, np.ndarray]:
    """(rounds,) seconds of each task; every round times all of them, fast ones often enough to be seen."""
    repeats = {}
    for name, task in tasks.items():
        begun = time.perf_counter()
        task()
        repeats[name] = max(1, min(200, int(2e-3 / (time.perf_counter() - begun))))
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            begun = time.perf_counter()
            for _ in range(repeats[name]):
                task()
            seconds[name].append((time.perf_counter() - begun) / repeats[name])
    return {name: np.array(times) for name, times in seconds.items()}


def lines(contenders: list[Contender], exact: np.ndarray, seconds: dict[str, np.ndarray]) -> Iterator[str]:
    """Median time, and the median over the rounds of the ratio to the first contender."""
    base = seconds[contenders[0].name]
    yield f"{'final state':40} {'time':>12} {'ratio':>9} {'error along the path':>22}"
    for each in contenders:
        spent = seconds[each.name]
        ratio = np.median(spent / base)
        yield f"{each.name:40} {np.median(spent) * 1e6:9.1f} us {ratio:8.1f}x {error(each, exact):22.1e}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=30)
    rounds = parser.parse_args().rounds
    loop = paper_loop()
    exact = reference(loop)
    contenders = [
        loosest(lambda tolerance: bare_heyoka(loop, tolerance), exact),
        bare_heyoka(loop, Taylor().tolerance),
        loosest(lambda tolerance: ours(loop, tolerance), exact),
        ours(loop),
        loosest(lambda tolerance: scipy(loop, "LSODA", tolerance), exact),
        loosest(lambda tolerance: scipy(loop, "DOP853", tolerance), exact),
        loosest(lambda tolerance: python_control(loop, "LSODA", tolerance), exact),
        loosest(lambda tolerance: python_control(loop, "RK45", tolerance), exact),
    ]
    for line in lines(contenders, exact, interleaved({each.name: each.final for each in contenders}, rounds)):
        print(line)
    samples = {
        "501 samples, states": lambda: simulate(loop, INITIAL, GRID).states,
        "501 samples, states and outputs": lambda: simulate(loop, INITIAL, GRID).outputs,
        "501 samples, labelled (xarray)": lambda: simulate(loop, INITIAL, GRID).to_xarray(),
    }
    print()
    for name, spent in interleaved(samples, rounds).items():
        print(f"{name:40} {np.median(spent) * 1e6:9.1f} us")


if __name__ == "__main__":
    main()
