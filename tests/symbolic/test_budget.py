"""Time budgets fire inside their block, never outside, in any thread, and say whose time ran out."""

from __future__ import annotations

import contextlib
import gc
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ulna
from ulna.base import UlnaError
from ulna.symbolic.exact import Attempt, attempt, time_budget

SOURCE = Path(ulna.__file__).parent


class HandClock:
    """A clock that stands still until it is told the time: no test depends on how busy the machine is."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> HandClock:
    hand = HandClock()
    monkeypatch.setattr(sys.modules["ulna.symbolic.exact.budget"], "_thread_clock", lambda _thread: hand)
    return hand


@pytest.fixture
def interrupt_key() -> Iterator[None]:
    """Python's own handler of SIGINT: a job that a shell put into the background inherits that it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def wait(seconds: float = 60.0) -> str:
    """Real seconds of work in which an interruption that is due must arrive; it mostly takes 20 ms."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pass
    return "never interrupted"


def spin(seconds: float = 60.0) -> str:
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass
    return "done"


def in_thread(function: Callable[[], object]) -> object:
    results: list[object] = []
    worker = threading.Thread(target=lambda: results.append(function()))
    worker.start()
    worker.join()
    return results[0]


def here(function: Callable[[], object]) -> object:
    return function()


@pytest.fixture(params=[here, in_thread], ids=["main thread", "other thread"])
def run(request: pytest.FixtureRequest) -> Callable[[Callable[[], object]], object]:
    return request.param


def test_a_spent_budget_leaves_the_block_and_says_so(run: Callable) -> None:
    def work() -> bool:
        with time_budget(0.02) as budget:
            spin()
        return budget.ran_out

    assert run(work)


def test_a_block_that_ends_in_time_says_so(run: Callable) -> None:
    def work() -> bool:
        with time_budget(60) as budget:
            pass
        return budget.ran_out

    assert not run(work)


def test_waiting_costs_nothing_so_a_busy_machine_changes_no_answer(run: Callable) -> None:
    def work() -> str:
        with time_budget(0.05):
            time.sleep(0.4)
            return "done"
        return "interrupted"

    assert run(work) == "done"


def test_nothing_fires_after_the_block(run: Callable) -> None:
    def work() -> str:
        with time_budget(0.05):
            pass
        return spin(0.2)

    assert run(work) == "done"


def test_no_budget_fires_early(run: Callable, clock: HandClock) -> None:
    def work() -> str:
        now = clock.now
        with time_budget(0.01) as budget:
            clock.now = now + budget.seconds - 0.0005
            return wait(0.2)
        return "interrupted"

    assert run(work) == "never interrupted"


def test_the_tightest_of_nested_budgets_fires_and_the_outer_one_counts_on(run: Callable, clock: HandClock) -> None:
    def work() -> list[str]:
        seen: list[str] = []
        with time_budget(0.3) as outer:
            with time_budget(0.05) as inner:
                clock.now += inner.seconds
                wait()
            seen.append("inner" if inner.ran_out else "nothing")
            clock.now += outer.seconds
            wait()
            seen.append("swallowed")
        seen.append("outer" if outer.ran_out else "nothing")
        return seen

    assert run(work) == ["inner", "outer"]


def test_an_outer_budget_interrupts_a_longer_inner_one(run: Callable, clock: HandClock) -> None:
    def work() -> tuple[bool, bool]:
        with time_budget(0.05) as outer, time_budget(5) as inner:
            clock.now += outer.seconds
            wait()
        return outer.ran_out, inner.ran_out

    assert run(work) == (True, False)


def test_an_outer_budget_passes_through_an_inner_attempt(run: Callable, clock: HandClock) -> None:
    """Also where the clock, read again, stands before the end: that is what another thread may see."""

    def work() -> str:
        def late() -> str:
            try:
                clock.now = 1.0
                return wait()
            finally:
                clock.now = 0.0

        def inside() -> str:
            attempt(50, "late", late)
            return "swallowed"

        return "outer" if attempt(0.05, "inside", inside).ran_out else "swallowed"

    assert run(work) == "outer"


def test_an_outer_budget_passes_through_an_inner_one_that_is_spent_as_well(run: Callable, clock: HandClock) -> None:
    def work() -> bool:
        with time_budget(0.05) as outer:
            with time_budget(0.05):
                clock.now += 2 * outer.seconds
                wait()
            wait()  # reached only where the inner one was seen first
        return outer.ran_out

    assert run(work)


def test_nobody_catches_the_interruption_but_the_budgets_themselves() -> None:
    """Whoever writes `except BudgetExceeded` swallows the budgets around his own: `ran_out` says whose it was."""

    def naming(text: str) -> bool:
        return "BudgetExceeded" in text

    assert naming("try:\n    pass\nexcept BudgetExceeded:\n    pass\n")
    found = {str(path.relative_to(SOURCE)) for path in SOURCE.rglob("*.py") if naming(path.read_text(encoding="utf-8"))}
    assert found == {"symbolic/exact/budget.py"}


def test_except_exception_does_not_swallow_the_interruption() -> None:
    def stubborn() -> None:
        while True:
            with contextlib.suppress(Exception):  # what SymPy does in places
                spin(0.01)

    assert attempt(0.05, "stubborn", stubborn).ran_out


def test_finalisers_and_collector_callbacks_are_not_interrupted() -> None:
    class Slow:
        def __del__(self) -> None:
            spin(0.02)

    def callback(_phase: str, _info: dict) -> None:
        spin(0.01)

    def work() -> None:
        while True:
            Slow()
            gc.collect(0)
            spin(0.01)

    gc.callbacks.append(callback)
    try:
        # Warnings are errors in this test run: a swallowed interruption would be one.
        assert all(attempt(0.03, "finalisers", work).ran_out for _ in range(5))
    finally:
        gc.callbacks.remove(callback)


def test_a_foreign_alarm_handler_is_left_alone() -> None:
    calls: list[int] = []
    before = signal.signal(signal.SIGALRM, lambda number, _frame: calls.append(number))
    try:
        assert attempt(0.05, "spin", spin).ran_out
        handler = signal.getsignal(signal.SIGALRM)
        assert handler is not signal.SIG_DFL
        signal.raise_signal(signal.SIGALRM)
        assert calls == [signal.SIGALRM]
    finally:
        signal.signal(signal.SIGALRM, before)


def test_the_alarm_is_given_back() -> None:
    with time_budget(1):
        pass
    assert signal.getsignal(signal.SIGALRM) is signal.SIG_DFL
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


@pytest.mark.usefixtures("interrupt_key")
def test_keyboard_interrupt_passes_through() -> None:
    def interrupted() -> None:
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        attempt(1, "interrupted", interrupted)


def test_an_attempt_returns_the_value() -> None:
    assert attempt(1, "sum", sum, [1, 2, 3]) == Attempt(value=6, ran_out=False, reason="")
    assert attempt(1, "sum", sum, [1, 2, 3]).succeeded


def test_an_attempt_names_the_failure() -> None:
    failed = attempt(1, "division", divmod, 1, 0)
    assert failed.value is None
    assert not failed.ran_out
    assert "ZeroDivisionError" in failed.reason
    assert "division" in failed.reason


def test_an_attempt_lets_the_users_mistakes_through() -> None:
    def mistaken() -> None:
        raise UlnaError("a", "b")

    with pytest.raises(UlnaError):
        attempt(1, "mistaken", mistaken)


def test_an_infinite_budget_sets_no_timer() -> None:
    with time_budget(float("inf")):
        assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(1e-4, 2e-3), min_size=1, max_size=6))
def test_short_budgets_left_at_any_moment_never_fire_later(lengths: list[float]) -> None:
    for seconds in lengths:
        with time_budget(seconds):
            spin(seconds)
    spin(0.003)
