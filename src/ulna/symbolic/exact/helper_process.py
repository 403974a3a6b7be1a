"""The other side of `helper`: a process that forks a worker, which answers questions until one of them ends it.

The parent of the worker never computes, so a new worker costs milliseconds and no import. Each question sets a timer
of CPU time whose signal ends the worker even inside compiled code; memory is limited by the system. A worker that is
left alone reads the end of its questions and goes; nothing here outlives the process that asked.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import pickle
import resource
import signal
import sys
import time
from typing import Any

from ulna.symbolic.exact.helper import answer_here
from ulna.symbolic.exact.helper_messages import read, write

MEMORY = 700_000_000
"""Bytes of address space of the worker."""


def serve() -> None:
    """Answer questions from standard input on standard output until it ends."""
    _die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # nothing that a library prints may mix with answers
    spent = time.process_time()
    write(answers, ("ready", None, spent))
    while True:
        before = _of_children()
        worker = os.fork()
        if not worker:
            _work(answers)
            os._exit(0)
        _, status = os.waitpid(worker, 0)
        if not os.WIFSIGNALED(status):
            return
        kind = "time" if os.WTERMSIG(status) == signal.SIGPROF else "memory"
        try:
            write(answers, (kind, None, _of_children() - before))
        except OSError:
            return


def _work(answers: int) -> None:
    _die_with_parent()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    while (question := read(0)) is not None:
        start = time.process_time()
        seconds, times, call = question
        signal.setitimer(signal.ITIMER_PROF, max(seconds, 1e-3))
        answer_here(times)
        kind, value = _answer(call)
        spent = time.process_time() - start
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        write(answers, (kind, value, spent))


def _answer(call: bytes) -> tuple[str, Any]:
    """What the function returns or raises, as bytes."""
    try:
        function, arguments, keywords = pickle.loads(call)  # noqa: S301 - from the process that started this one
        return "value", pickle.dumps(function(*arguments, **keywords))
    except MemoryError:
        return "memory", None
    except Exception as error:  # noqa: BLE001 - whatever it is belongs to who asked
        with contextlib.suppress(Exception):
            text = pickle.dumps(error)
            pickle.loads(text)  # noqa: S301 - our own bytes; many exceptions are written but not read back
            return "raised", text
        return "raised", pickle.dumps(RuntimeError(f"{type(error).__name__}: {error}"))


def _of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _die_with_parent() -> None:
    """End with the parent, however it ends, where the system offers that (Linux); elsewhere the pipe's end does it."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() == 1:
            os._exit(0)
