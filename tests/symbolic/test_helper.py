"""What cannot be interrupted runs in a helper process: its time and its memory end, the process that asks goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import sympy as sp

from ulna.symbolic.exact import attempt, time_budget
from ulna.symbolic.exact.budget import charge, worked
from ulna.symbolic.exact.field import Field
from ulna.symbolic.exact.helper import HelperMemoryError, NoHelperError, apart, stop_helper
from ulna.symbolic.exact.high_powers import has_high_powers

x = sp.Symbol("x", real=True)
HARD = x**600 - x**37 - x + 1
"""Its factors take FLINT longer than anybody waits."""


def helpers() -> int:
    """Processes of this user that serve."""
    found = 0
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found += b"helper_process" in place.read_bytes() and int(place.parent.name) != os.getpid()
        except OSError:
            continue
    return found


def test_the_helper_answers_and_hands_over_what_is_raised() -> None:
    assert apart(sp.factor, x**2 - 1) == (x - 1) * (x + 1)
    with pytest.raises(ValueError, match="invalid literal"):
        apart(int, "x")


def test_compiled_code_is_ended_when_its_time_is_spent() -> None:
    assert attempt(0.1, "solve", sp.solve, HARD, x).ran_out
    assert apart(abs, -3) == 3


def test_time_in_the_helper_counts_for_the_outer_budget() -> None:
    with time_budget(0.1) as outer:
        attempt(50, "solve", sp.solve, HARD, x)
        pytest.fail("the outer budget was swallowed")
    assert outer.ran_out
    before = worked()
    charge(1.0)
    assert worked() - before >= 1.0


def test_starting_the_helper_counts_for_no_question() -> None:
    stop_helper()
    with time_budget(0.1) as budget:
        assert apart(abs, -3) == 3
        # Python alone takes longer than this to start.
        assert budget.left > 0.05
    assert not budget.ran_out


def test_a_computation_without_memory_ends_the_worker_only() -> None:
    assert "memory" in attempt(10, "bytes", apart, bytearray, 3 * 10**9).reason
    with pytest.raises(HelperMemoryError):
        apart(os.abort)
    assert apart(abs, -3) == 3


def test_a_helper_that_was_ended_from_outside_is_started_again() -> None:
    worker = apart(os.getpid)
    os.killpg(os.getpgid(worker), signal.SIGKILL)
    assert apart(abs, -4) == 4


def test_other_threads_ask_the_same_helper() -> None:
    seen: list[int] = []
    threads = [threading.Thread(target=lambda k=k: seen.append(apart(abs, -k))) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(seen) == [0, 1, 2, 3]


def test_where_no_process_starts_high_degrees_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_arguments: object, **_keywords: object) -> None:
        raise PermissionError("no processes here")

    stop_helper()
    monkeypatch.setattr(subprocess, "Popen", refused)
    found = attempt(1, "solve", sp.solve, HARD, x)
    assert not found.ran_out
    assert "NoHelperError" in found.reason
    assert attempt(1, "solve", sp.solve, x**2 - 4, x).value == [-2, 2]


def test_what_cannot_be_sent_is_refused() -> None:
    with pytest.raises(NoHelperError):
        apart(lambda: 1)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are counted through /proc")
@pytest.mark.parametrize("end", ["", "os.kill(os.getpid(), 9)"], ids=["exit", "killed"])
def test_no_helper_is_left_behind(end: str) -> None:
    program = f"import os\nfrom ulna.symbolic.exact.helper import apart\nprint(apart(os.getppid), flush=True)\n{end}"
    done = subprocess.run([sys.executable, "-c", program], check=False, capture_output=True, text=True)
    server = int(done.stdout)
    end_of_waiting = time.monotonic() + 30
    while Path(f"/proc/{server}").exists() and time.monotonic() < end_of_waiting:
        time.sleep(0.02)
    assert not Path(f"/proc/{server}").exists()


def test_large_factorisations_give_what_small_ones_give() -> None:
    ring = Field(4)
    a, b, c, _ = ring.variables
    factors = (a**70 + b * c + 10**40, a * b - c**90 + 3)
    content, found = ring.factors(factors[0] * factors[1] ** 2 * 6)
    assert content in (6, -6)
    assert {(str(p), e) for p, e in found} == {(str(factors[0]), 1), (str(-factors[1]), 2)} or len(found) == 2


@pytest.mark.parametrize("number", ["38.68", "0.0259", "1000"])
def test_high_powers_are_seen_before_they_are_built(number: str) -> None:
    high = sp.Rational(number)
    for expression in (sp.exp(high * x), sp.tanh(x * high), x ** (high + sp.Rational(1, 7)), x**1000):
        assert has_high_powers([{"one": sp.Matrix([expression, 1])}])
    for expression in (sp.exp(x / 2), x**4, sp.Rational(number) * x, sp.exp(-x * sp.Symbol("a"))):
        assert not has_high_powers([expression])
