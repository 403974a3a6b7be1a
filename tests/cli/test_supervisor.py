"""A command that hangs, aborts or is interrupted ends with what it has and one line, whatever library it is in."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the supervisor forks")

BEGIN = """
import os, sys, time
from ulna.cli.supervisor import finished, keep, kept, limit, supervised

def busy():  # one call into compiled code that nothing interrupts
    return sum(range(10**13))

def work():
"""
END = """
    return 0

sys.exit(supervised(work))
"""
HARD = """
[states]
x = "u - x - 5*exp(-8751/(2*(x + 3))) + exp(38.68*x)*tanh(x/0.0259)"
v = "x - v*exp(-v/0.93) + log(1 + exp(x*17.3))"
[inputs]
u = {}
[outputs]
y = "v"
"""


def program(*lines: str) -> list[str]:
    return [sys.executable, "-c", BEGIN + "\n".join(f"    {line}" for line in lines) + END]


def run(*lines: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(program(*lines), check=False, capture_output=True, text=True)


def ulna(*words: str) -> list[str]:
    return [sys.executable, "-c", "from ulna.cli.main import app; app()", *words]


def test_exit_status_and_output_of_a_command_pass_through() -> None:
    done = run("print('out')", "print('err', file=sys.stderr)", "sys.exit(2)")
    assert (done.returncode, done.stdout, done.stderr) == (2, "out\n", "err\n")


def test_time_ends_a_call_that_nothing_interrupts_and_what_was_kept_is_shown() -> None:
    done = run("keep(print, 'the first answer')", "limit(0.1)", "busy()")
    assert done.returncode == 0
    assert done.stdout == "the first answer\n"
    assert "--seconds" in done.stderr


def test_without_anything_kept_there_is_one_line_and_status_1() -> None:
    done = run("limit(0.1)", "busy()")
    assert done.returncode == 1
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1


def test_a_library_that_aborts_leaves_what_was_kept() -> None:
    done = run("keep(print, 'the first answer')", "os.abort()")
    assert (done.returncode, done.stdout) == (0, "the first answer\n")
    assert "memory" in done.stderr


def test_memory_is_bounded() -> None:
    done = run("limit(60)", "bytearray(4 * 10**9)")
    assert "MemoryError" in done.stderr


@pytest.mark.parametrize("all_of_them", [True, False], ids=["from a terminal", "to the command alone"])
def test_an_interrupt_ends_a_call_that_nothing_interrupts(all_of_them: bool) -> None:
    lines = ("kept('three runs are kept')", "print('begun', flush=True)", "busy()", "time.sleep(600)")
    command = program(*lines)
    begin = [command[0], "-c", "import signal; signal.signal(2, signal.default_int_handler)\n" + command[2]]
    process = subprocess.Popen(begin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    (os.killpg if all_of_them else os.kill)(process.pid, signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 130
    assert said == "interrupted: three runs are kept.\n"


@pytest.mark.skipif(sys.platform != "linux", reason="Linux ends the child with its parent")
def test_a_killed_command_leaves_nobody_behind() -> None:
    process = subprocess.Popen(program("print(os.getpid(), flush=True)", "time.sleep(600)"), stdout=subprocess.PIPE)
    assert process.stdout is not None
    working = int(process.stdout.readline())
    process.kill()
    process.communicate()
    end = time.monotonic() + 30
    while Path(f"/proc/{working}").exists() and time.monotonic() < end:
        time.sleep(0.02)
    assert not Path(f"/proc/{working}").exists()


def test_a_command_answers_in_its_seconds_and_names_what_ran_out(tmp_path: Path) -> None:
    plant = tmp_path / "hard.toml"
    plant.write_text(HARD)
    done = subprocess.run(
        ulna("analyse", str(plant), "--seconds", "8", "--json", "--evidence"), check=False, capture_output=True
    )
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout)
    assert len(answers) > 15
    assert all(row["value"] is None for row in answers.values() if row["evidence"].get("ran_out"))


def test_answers_that_are_being_shown_are_not_shown_twice() -> None:
    done = run("keep(print, 'the first answer')", "limit(0.2)", "finished()", "print('all', flush=True)", "os.abort()")
    assert done.stdout == "all\n"
    spun = run("limit(0.05)", "finished()", "sum(range(10**7 * 3))", "print('all')")
    assert (spun.returncode, spun.stdout) == (0, "all\n")
