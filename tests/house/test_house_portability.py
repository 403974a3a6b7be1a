"""A system without heyoka and without what only POSIX has does all that the base install does."""

from __future__ import annotations

import subprocess
import sys

HIDDEN = """
import importlib.util, os, signal, sys, time
MODULES = ("heyoka", "fcntl", "resource")
for name in MODULES:
    sys.modules[name] = None
for name in ("fork", "sched_getaffinity", "register_at_fork", "killpg"):
    delattr(os, name)
for name in "SIGALRM setitimer getitimer ITIMER_PROF ITIMER_REAL SIGPROF SIGUSR1 SIGHUP SIGKILL".split():
    delattr(signal, name)
del signal.pthread_sigmask, time.pthread_getcpuclockid
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name in MODULES else found(name, *more)
"""

LOOP = """
import numpy as np, ulna
arm = ulna.model("one_link_arm").with_values()
made = ulna.controller_for(arm, law="-2+2*sqrt(3)*j, -2-2*sqrt(3)*j, -8", observer=[-9, -10, -11])
run = ulna.simulate(ulna.close_loop(arm, made), [1, 0, 0], np.linspace(0, 5, 11))
print(*run["y"])
"""

COMMANDS = """
from ulna.cli.main import app
for line in ("analyse duffing --seconds 5", "simulate duffing --best --initial x1=0.1 --horizon 1"):
    try:
        app(line.split())
    except SystemExit as end:
        assert not end.code, line
"""


def _run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_a_loop_is_designed_and_simulated() -> None:
    here, there = _run(LOOP), _run(HIDDEN + LOOP)
    assert there.returncode == 0, there.stderr
    assert there.stderr.count("heyoka is not installed") == 1
    pairs = zip(map(float, here.stdout.split()), map(float, there.stdout.split()), strict=True)
    assert max(abs(a - b) for a, b in pairs) < 1e-9


def test_commands_answer() -> None:
    done = _run(HIDDEN + COMMANDS)
    assert done.returncode == 0, done.stderr
    assert "proved" in done.stdout
    assert "x1" in done.stdout


def test_what_is_hidden_is_missing() -> None:
    assert "heyoka" in _run(HIDDEN + "import heyoka").stderr
