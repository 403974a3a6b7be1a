"""Nothing but what a program prints itself stands on standard output: no line of an integrator's own."""

from __future__ import annotations

import os
import subprocess
import sys

SCRIPT = """
import numpy as np, sympy as sp
from ulna.sim import Crossing, simulate
from ulna.system import Signal, System
import heyoka as hy
x = sp.Symbol("x", real=True)
def all_of_them():
    for rate in (-sp.sqrt(sp.Abs(x)), 1 / x, sp.exp(10 * x), -sp.log(sp.Abs(x)), -(x**-3)):
        plant = System(name="p", states=(Signal(name="x"),), rates=(rate,))
        for start in (0.0, 1.0, 1e-300, 700.0):
            for event in ((), (Crossing(name="c", expression=sp.log(x)),)):
                simulate(plant, [start], np.linspace(0.0, 5.0, 3), events=event, throw=False)
all_of_them()
print("now", flush=True)
hy.set_logger_level_warning()
all_of_them()
"""


def test_runs_that_fail_print_nothing_though_heyoka_would() -> None:
    found = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, check=True, env=dict(os.environ))
    before, after = found.stdout.decode().split("now\n")
    assert not before
    assert not found.stderr
    assert "heyoka" in after
