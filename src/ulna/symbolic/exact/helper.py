"""A warm helper process for computations that nothing else can end: `apart(function, ...)`.

Compiled code holds no time budget, and a library that finds no memory ends its process. What may do either runs in a
process of its own, one for each process that asks, started at the first question.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import IO, Any, ParamSpec, TypeVar

from ulna.base import HAS_FORK
from ulna.symbolic.exact.budget import charge, patience, set_patience, spend, time_left
from ulna.symbolic.exact.helper_messages import read, write

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_LONGEST = 20.0
"""s of CPU time of a question that no budget bounds."""

_PROGRAM = "from ulna.symbolic.exact.helper_process import serve; serve()"


class NoHelperError(Exception):
    """No process could be started here."""


class HelperMemoryError(MemoryError):
    """A computation needed more memory than the helper may take."""


def apart(function: Callable[Arguments, Result], *arguments: Arguments.args, **keywords: Arguments.kwargs) -> Result:
    """`function(*arguments, **keywords)`, computed in the helper within what is left of the open budgets.

    Raises:
        HelperMemoryError: if memory ran out.
        NoHelperError: if this system starts no process, or what is asked cannot be sent.
        Exception: whatever the function raises.
    """
    if _inside:
        return function(*arguments, **keywords)
    try:
        question = pickle.dumps((function, arguments, keywords))
    except Exception as error:
        raise NoHelperError(f"{type(error).__name__}: {error}") from error
    with _lock:
        kind, value, seconds, starting = _helper.ask(question)
    charge(seconds, starting=starting)
    if kind == "time":
        spend()
    if kind == "memory":
        raise HelperMemoryError("more memory was needed than a helper process may take")
    found = pickle.loads(value)  # noqa: S301 - from our own process
    if kind == "raised":
        raise found
    return found


class _Helper:
    """The process, started when it is first asked, and again after it was ended."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._ended: list[subprocess.Popen[bytes]] = []

    def ask(self, question: bytes) -> tuple[str, Any, float, float]:
        """(kind, value, s of CPU time for the answer, s for starting the process)."""
        for _ in range(2):
            process, spent = self._running()
            try:
                answer = self._asked(process, question)
            except BaseException:
                self.stop()  # an answer that comes late must not be taken for the next one's
                raise
            if answer is not None:
                return *answer, spent
            self.stop()  # it was ended from outside while it waited
        raise NoHelperError("the helper process does not stay")

    def _asked(self, process: subprocess.Popen[bytes], question: bytes) -> Any:
        try:
            write(_handle(process.stdin), (min(time_left(), _LONGEST * patience()), patience(), question))
            return read(_handle(process.stdout))
        except BrokenPipeError:
            return None

    def _running(self) -> tuple[subprocess.Popen[bytes], float]:
        """The process and the CPU time that starting it took just now."""
        if self._process is not None and self._owner == os.getpid():
            return self._process, 0.0
        if not HAS_FORK:
            raise NoHelperError("this system has no fork")
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p), "OMP_NUM_THREADS": "1"}
        try:
            process = subprocess.Popen(  # noqa: S603 - Python itself, with a text of ours
                [sys.executable, "-c", _PROGRAM],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                env=environment | {"OPENBLAS_NUM_THREADS": "1"},
            )
        except OSError as error:
            raise NoHelperError(str(error)) from error
        self._process, self._owner = process, os.getpid()
        try:
            ready = read(_handle(process.stdout))
        except BaseException:
            self.stop()
            raise
        if ready is None:
            self.stop()
            raise NoHelperError("the helper process does not start")
        return process, ready[2]

    def stop(self) -> None:
        """End the process, whatever it does."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        # A budget that is spent may interrupt the waiting: who has not been waited for then is at the next end.
        self._ended.append(process)
        while self._ended:
            self._ended[-1].wait()
            self._ended.pop()


def _handle(pipe: IO[bytes] | None) -> int:
    return -1 if pipe is None else pipe.fileno()


_helper = _Helper()
_lock = threading.Lock()
_inside = False


def _start_anew() -> None:
    """In a process that was forked off: the helper belongs to the other one."""
    global _helper, _lock
    _helper, _lock = _Helper(), threading.Lock()


def answer_here(times: float) -> None:
    """From now on this process is the helper's worker: it asks nobody, and has the patience of who asks it."""
    global _inside  # noqa: PLW0603
    _inside = True
    set_patience(times)


def stop_helper() -> None:
    """End the helper process of this process, if there is one."""
    _helper.stop()


atexit.register(stop_helper)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_start_anew)
