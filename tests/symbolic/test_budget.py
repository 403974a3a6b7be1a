"""Time budgets fire inside their block, never outside, in any thread."""

from __future__ import annotations

import contextlib
import gc
import signal
import threading
import time
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import UlnaError
from ulna.symbolic.exact.budget import Attempt, BudgetExceeded, attempt, time_budget


def spin(seconds: float = 5.0) -> str:
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass
    return "done"


def in_thread(function: Callable[[], object]) -> object:
    results: list[object] = []
    worker = threading.Thread(target=lambda: results.append(function()))
    worker.start()
    worker.join(20)
    return results[0]


def here(function: Callable[[], object]) -> object:
    return function()


@pytest.fixture(params=[here, in_thread], ids=["main thread", "other thread"])
def run(request: pytest.FixtureRequest) -> Callable[[Callable[[], object]], object]:
    return request.param


def test_a_spent_budget_interrupts_the_block(run: Callable) -> None:
    def work() -> bool:
        try:
            with time_budget(0.05):
                spin()
        except BudgetExceeded:
            return True
        return False

    assert run(work)


def test_waiting_costs_nothing_so_a_busy_machine_changes_no_answer(run: Callable) -> None:
    def work() -> str:
        with time_budget(0.05):
            time.sleep(0.4)
        return "done"

    assert run(work) == "done"


def test_nothing_fires_after_the_block(run: Callable) -> None:
    def work() -> str:
        with time_budget(0.05):
            pass
        return spin(0.2)

    assert run(work) == "done"


def test_the_tightest_of_nested_budgets_fires_and_the_outer_one_counts_on(run: Callable) -> None:
    def work() -> list[str]:
        seen: list[str] = []
        try:
            with time_budget(0.3):
                try:
                    with time_budget(0.05):
                        spin()
                except BudgetExceeded:
                    seen.append("inner")
                spin()
        except BudgetExceeded:
            seen.append("outer")
        return seen

    assert run(work) == ["inner", "outer"]


def test_an_outer_budget_interrupts_a_longer_inner_one(run: Callable) -> None:
    def work() -> float:
        start = time.thread_time()
        with pytest.raises(BudgetExceeded), time_budget(0.05), time_budget(5):
            spin()
        return time.thread_time() - start

    taken = run(work)
    assert isinstance(taken, float)
    assert taken < 2


def test_an_outer_budget_passes_through_an_inner_attempt(run: Callable) -> None:
    def work() -> str:
        try:
            with time_budget(0.05):
                attempt(5, "spin", spin)
        except BudgetExceeded:
            return "outer"
        return "swallowed"

    assert run(work) == "outer"


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
        try:
            with time_budget(seconds):
                spin(seconds)
        except BudgetExceeded:
            pass
    spin(0.003)
