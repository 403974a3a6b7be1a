"""A light parent of every command: it ends the process that works whatever that does, and says what is kept.

Forked before anything large is loaded. The kernel ends the working process when its CPU time is over, even inside
compiled code, and bounds its memory; Ctrl-C is answered by the parent within a second.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import pickle
import select
import signal
import struct
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, NoReturn

import typer

from ulna.base import HAS_FORK

GRACE = 0.2
"""s of CPU time by which a command may work longer than it was given, before it is ended from outside."""

_MEMORY = 1_250_000_000
"""Bytes of address space of a command that computes with formulas; its helper process has its own."""

_PATIENCE = 1.0
"""s from Ctrl-C until the working process is ended from outside."""

_INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it."""

_HEADER = struct.Struct("!Q")

_to_parent: list[int] = []
"""The writing end of the pipe, in the process that works."""


def supervised(work: Callable[[], Any]) -> Any:
    """`work()` in a process of its own where this one has loaded nothing yet, else here; the parent never returns."""
    fresh = not sys.modules.keys() & {"numpy", "sympy"} and threading.active_count() == 1
    if not HAS_FORK or not fresh:
        return work()
    reading, writing = os.pipe()
    sys.stdout.flush()
    told = {signal.SIGINT, signal.SIGUSR1}
    signal.pthread_sigmask(signal.SIG_BLOCK, told)  # until both know what to do
    working = os.fork()
    if working:
        os.close(writing)
        watch = _Watch(working, reading)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, told)
        sys.exit(watch.status())
    os.close(reading)
    _to_parent.append(writing)
    _die_with_parent()
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        # The terminal sends Ctrl-C to both; once, from the parent, is enough.
        signal.signal(signal.SIGINT, lambda *_: None)
        signal.signal(signal.SIGUSR1, signal.default_int_handler)
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, told)
        return work()
    except KeyboardInterrupt:
        end_interrupted()


def limit(seconds: float) -> None:
    """From now on the working process is ended when it has worked this long in all, or takes too much memory."""
    if not _to_parent:
        return
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, max(seconds + GRACE - time.process_time(), 0.05))


def finished() -> None:
    """The answers are there: showing them is not limited any more, and nothing else is shown in their place."""
    if _to_parent:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        keep(_nothing)


def _nothing() -> None:
    pass


def keep(show: Callable[..., None], *arguments: Any) -> None:
    """What the parent does if this process is ended from now on: `show(*arguments)`, a function of a module."""
    _send(("show", show, arguments))


def kept(line: str) -> None:
    """What is said to be kept when the command is interrupted from now on."""
    _kept[0] = line
    _send(("line", line))


_kept = ["nothing was written"]


def end_interrupted() -> NoReturn:
    """Say what is kept, with exit status 130; the working process leaves that to its parent and goes at once."""
    if _to_parent:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
        os._exit(_INTERRUPTED)
    _say_interrupted()
    raise typer.Exit(_INTERRUPTED) from None


def _say_interrupted() -> None:
    typer.secho(f"interrupted: {_kept[0]}.", err=True)


def _send(message: Any) -> None:
    if _to_parent:
        text = pickle.dumps(message)
        with contextlib.suppress(OSError):
            os.write(_to_parent[0], _HEADER.pack(len(text)) + text)


class _Watch:
    """The parent: it waits for the working process and keeps its last messages."""

    def __init__(self, working: int, reading: int) -> None:
        self._working = working
        self._reading = reading
        self._text = b""
        self._show: Callable[[], None] | None = None
        self._interrupted = 0.0
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._on_interrupt)
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_end)

    def status(self) -> int:
        """Wait; the exit status of the command."""
        while True:
            ready, _, _ = select.select([self._reading], [], [], 0.05) if self._reading >= 0 else ([], [], [])
            if ready:
                self._receive()
            done, status = os.waitpid(self._working, 0 if self._reading < 0 else os.WNOHANG)
            if done:
                self._receive_rest()
                return self._ended(status)
            if self._interrupted and time.monotonic() - self._interrupted > _PATIENCE:
                os.kill(self._working, signal.SIGKILL)

    def _on_interrupt(self, *_: Any) -> None:
        with contextlib.suppress(OSError):
            os.kill(self._working, signal.SIGUSR1 if not self._interrupted else signal.SIGKILL)
        self._interrupted = self._interrupted or time.monotonic()

    def _on_end(self, number: int, *_: Any) -> None:
        with contextlib.suppress(OSError):
            os.kill(self._working, signal.SIGTERM)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    def _receive(self) -> bool:
        part = os.read(self._reading, 1 << 16)
        self._text += part
        while len(self._text) >= _HEADER.size:
            size = _HEADER.size + _HEADER.unpack(self._text[: _HEADER.size])[0]
            if len(self._text) < size:
                break
            kind, *content = pickle.loads(self._text[_HEADER.size : size])  # noqa: S301 - from our own process
            self._text = self._text[size:]
            if kind == "line":
                _kept[0] = content[0]
            else:
                self._show = lambda content=content: content[0](*content[1])
        return bool(part)

    def _receive_rest(self) -> None:
        while select.select([self._reading], [], [], 0)[0] and self._receive():
            pass

    def _ended(self, status: int) -> int:
        if os.WIFEXITED(status) and os.WEXITSTATUS(status) != _INTERRUPTED:
            return os.WEXITSTATUS(status)
        if sys.stderr.isatty():
            sys.stderr.write("\r\x1b[K\x1b[?25h")  # what a progress line leaves behind
        if self._interrupted or os.WIFEXITED(status):
            _say_interrupted()
            return _INTERRUPTED
        number = os.WTERMSIG(status)
        if number == signal.SIGPROF:
            why = "the time ran out; --seconds gives more"
        elif number in (signal.SIGABRT, signal.SIGKILL, signal.SIGSEGV, signal.SIGBUS):
            why = "the memory ran out"
        else:
            return 128 + number
        if self._show is None:
            typer.secho(f"error: no answer: {why}.", fg=typer.colors.RED, err=True)
            return 1
        self._show()
        typer.secho(f"note: {why}; what was not answered by then is undecided.", fg=typer.colors.YELLOW, err=True)
        return 0


def _die_with_parent() -> None:
    """End with the parent, however that ends, where the system offers it."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
