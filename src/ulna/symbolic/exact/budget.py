"""Time budgets for computer algebra: a step that takes too long is given up, nothing else is touched.

`BudgetExceeded` derives from `BaseException`, because SymPy answers many of its own troubles with
`except Exception` and would otherwise swallow the interruption and go on. Nobody catches it but the budgets themselves:
each knows whether it was its own time that ran out, so that an inner one never swallows an outer one.
"""

from __future__ import annotations

import ctypes
import gc
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from types import FrameType, TracebackType
from typing import Self

from ulna.base import HAS_TIMER

_REPEAT = 0.02
"""s between two interruptions of one budget: the first can be lost or put off (see `_would_be_lost`)."""

_OWN_DEPTH = 3
"""Frames from the innermost in which entering and leaving a budget can be."""

_SHORTEST = 1e-3
"""s: a timer is never armed for less, so that it cannot fire before the block is entered."""


class BudgetExceeded(BaseException):
    """The time of a `time_budget` is spent: on its way to the outermost one that is marked `spent`."""


class _Stack(threading.local):
    """The budgets that are open in one thread, outermost first."""

    def __init__(self) -> None:
        self.open: list[time_budget] = []
        self.charged = [0.0]
        """s of CPU time that other processes worked for this thread; a list, which other threads can read."""


_stack = _Stack()
_patience = [float(os.environ.get("ULNA_PATIENCE", "1"))]


def patience() -> float:
    """The factor of every time budget: machines differ, and so do people. `ULNA_PATIENCE`, 1 where it is not set."""
    return _patience[0]


def set_patience(times: float) -> None:
    """Let every time budget from now on be this many times as long."""
    _patience[0] = times


def worked() -> float:
    """s of CPU time of this thread, and of other processes for it."""
    return time.thread_time() + _stack.charged[0]


def time_left() -> float:
    """s of CPU time until the first open budget of this thread is spent; infinity without one."""
    return min((one.left for one in _stack.open), default=math.inf)


def charge(seconds: float, *, starting: float = 0.0) -> None:
    """Count CPU time that another process worked for this thread, and for a timer that bounds the whole process.

    What it took to start belongs to no question: only the timer counts it. Else the first question, whose budget is
    shorter than a start, would be given up, and so would the one after it.
    """
    _stack.charged[0] += seconds
    seconds += starting
    if hasattr(signal, "ITIMER_PROF"):
        left, _ = signal.getitimer(signal.ITIMER_PROF)
        if left > 0.0:
            signal.setitimer(signal.ITIMER_PROF, max(left - seconds, _SHORTEST))


def spend() -> None:
    """Leave the block of the tightest open budget: another process has worked until its end."""
    tightest = min(_stack.open, key=lambda one: one.left, default=None)
    if tightest is None:
        raise TimeoutError("no answer in the time that a question without a budget may take")
    for one in _stack.open:
        one.spent = one.spent or one is tightest or one.left <= 0.0
    raise BudgetExceeded


class time_budget:  # noqa: N801 - read as a verb: `with time_budget(0.5) as budget:`
    """Leave the block once `seconds` have been worked in it; `ran_out` tells so afterwards. Never acts outside.

    The clock is the thread's own CPU time (wall time on systems that do not show it to other threads), so that a busy
    machine makes an answer late but not another one. Waiting costs nothing: algebra never waits. Budgets nest: where an
    outer one is spent, the inner ones are left as well and the outer one reports it.
    A main thread whose SIGALRM is free uses the interval timer of the process, any other thread a watcher that raises
    asynchronously. Both act between two Python instructions: one long call into compiled code is interrupted only when
    it returns. SIGINT is not touched.

    Args:
        seconds: s of CPU time of this thread; infinity for no limit.

    Attributes:
        ran_out: True once the block was left because this budget's own time was spent.
        spent: True once an interruption was sent because of this budget. Whose time ran out is read from this mark,
            never from the clock: another reading a moment later, by another thread, may differ.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = float(seconds) * patience()
        self.deadline = math.inf
        self.spent = False
        self.ran_out = False
        self._clock = _thread_clock(threading.get_ident())
        self._charged = _stack.charged
        self._watcher: _Watcher | None = None

    @property
    def left(self) -> float:
        """s of CPU time until the time is spent."""
        return self.deadline - self._now()

    def _now(self) -> float:
        return self._clock() + self._charged[0]

    def __enter__(self) -> Self:
        self.deadline = self._now() + self.seconds
        _stack.open.append(self)
        if math.isinf(self.deadline):
            return self
        if _signal_is_free():
            _arm_signal()
        else:
            self._watcher = _Watcher(self, thread=threading.get_ident())
            self._watcher.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        while True:
            try:
                return self._leave(interrupted=isinstance(error, BudgetExceeded))
            except BudgetExceeded:
                # It arrived while the block was being left: the work is done, so it must not come out.
                continue

    def _leave(self, *, interrupted: bool) -> bool:
        if self._watcher is not None:
            self._watcher.stop()
        if self in _stack.open:
            del _stack.open[_stack.open.index(self) :]
        outer = any(one.spent for one in _stack.open)
        if self._watcher is None and not math.isinf(self.deadline):
            # An outer budget that is spent too is already on its way out with this exception.
            _arm_signal(quiet=interrupted and outer)
        self.ran_out = interrupted and self.spent and not outer
        return self.ran_out


def _thread_clock(thread: int) -> Callable[[], float]:
    """s of CPU time of a running thread, readable from any thread; the wall clock where there is none."""
    if not hasattr(time, "pthread_getcpuclockid"):
        return time.monotonic
    return partial(time.clock_gettime, time.pthread_getcpuclockid(thread))


def _signal_is_free() -> bool:
    if not HAS_TIMER or threading.current_thread() is not threading.main_thread():
        return False
    handler = signal.getsignal(signal.SIGALRM)
    return handler is _on_alarm or handler in (signal.SIG_DFL, signal.SIG_IGN)


def _arm_signal(*, quiet: bool = False) -> None:
    """Set the process timer for the tightest open budget of the main thread, or give the signal back."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    left = min((one.left for one in _stack.open if one._watcher is None), default=math.inf)
    if math.isinf(left):
        if signal.getsignal(signal.SIGALRM) is _on_alarm:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
        return
    signal.signal(signal.SIGALRM, _on_alarm)
    # Real seconds, never fewer than those worked: an alarm that comes too early is repeated.
    first = _REPEAT if quiet else max(left, _SHORTEST)
    signal.setitimer(signal.ITIMER_REAL, first, _REPEAT)


def _on_alarm(_number: int, frame: FrameType | None) -> None:
    due = [one for one in _stack.open if one.left <= 0.0]
    if not due or _is_own(frame):
        return
    if not _would_be_lost(frame):
        for one in due:
            one.spent = True
        raise BudgetExceeded
    signal.setitimer(signal.ITIMER_REAL, _SHORTEST, _REPEAT)


def _is_own(frame: FrameType | None) -> bool:
    """True while a budget is entered or left: this must run to its end, or a timer would outlive its block."""
    for _ in range(_OWN_DEPTH):
        if frame is None:
            return False
        if frame.f_code in _PROTECTED:
            return True
        frame = frame.f_back
    return False


def _would_be_lost(frame: FrameType | None) -> bool:
    """True inside finalisers and callbacks of the garbage collector: they swallow every exception, with a warning."""
    collector = {getattr(callback, "__code__", None) for callback in gc.callbacks}
    depth = 0
    while frame is not None:
        code = frame.f_code
        if code in collector or code.co_name == "__del__":
            return True
        # Callbacks of weak references look like any call; those met so far: the library's own, Numba's, pytest's.
        if depth < _CALLBACK_DEPTH and (code.co_filename.endswith(_CALLBACK_FILES) or "disposal" in code.co_name):
            return True
        frame = frame.f_back
        depth += 1
    return False


_CALLBACK_DEPTH = 15
_CALLBACK_FILES = ("weakref.py", "_weakrefset.py", "unraisableexception.py")


_PROTECTED = frozenset(
    function.__code__ for function in (time_budget.__enter__, time_budget.__exit__, time_budget._leave, _arm_signal)
)


class _Watcher(threading.Thread):
    """Interrupts another thread once the time of its budget is spent, until it is stopped."""

    def __init__(self, budget: time_budget, *, thread: int) -> None:
        super().__init__(name="ulna time budget", daemon=True)
        self._budget = budget
        self._target_thread = ctypes.c_ulong(thread)
        self._stopped = threading.Event()
        self._lock = threading.Lock()

    def run(self) -> None:
        delay = _SHORTEST
        while not self._stopped.wait(delay):
            with self._lock:
                if self._stopped.is_set():
                    return
                left = self._budget.left
                delay = max(left, _SHORTEST)
                frame = sys._current_frames().get(self._target_thread.value)
                if left > 0.0 or _is_own(frame) or _would_be_lost(frame):
                    continue
                self._budget.spent = True
                ctypes.pythonapi.PyThreadState_SetAsyncExc(self._target_thread, ctypes.py_object(BudgetExceeded))
                delay = _REPEAT

    def stop(self) -> None:
        """No interruption arrives after this returns; one that is on its way is taken back, an outer one repeats it."""
        self._stopped.set()
        with self._lock:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(self._target_thread, None)
