"""The page of the paper's loop: a step of it beside the C loop, its size, its time to ready, its share of a core.

The loop is that of `sampled_loop.py`: 1 kHz, ±24 V, 12-bit encoder, in `Plain()` arithmetic. The C loop is the one in
`sampled_peers.py`, written by hand. Node runs the engine of the page; Chromium (Debian's, headless, through Playwright)
opens the page itself. What is missing on the machine is left out.

    python benchmarks/studio.py [--rounds 5] [--seconds 5]
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sampled_peers import SAMPLES, compiled_c

import ulna
from ulna import Hardware, Loop, Plain, Quantiser, Saturation
from ulna.page import json_text, loop_script, runtime_script


def paper_loop() -> Loop:
    plant = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(plant), ulna.Poles(-2 + 3.46j, -2 - 3.46j, -8))
    observer = ulna.exact_observer(ulna.observer_form(plant), ulna.Poles(-9, -10, -11))
    hardware = Hardware(
        period=1e-3,
        sensors=Quantiser.encoder(bits=12),
        saturation=Saturation(lower=-24, upper=24),
        arithmetic=Plain(),
    )
    return Loop(plant=plant, controller=ulna.compensator(law, observer), hardware=hardware)


def node_steps(loop: Loop, folder: Path) -> Callable[[], float]:
    """A function that answers how many µs a sample takes in node: the median of 9 rounds, after 3 to warm up."""
    made = loop_script(loop, check=0)
    script = folder / "steps.js"
    script.write_text(
        f"""{runtime_script()}
const loop = ulnaLoop({made.script}, {json_text(made.facts)}), found = [];
for (let round = 0; round < 12; round++) {{
  loop.start();
  const began = process.cpuUsage();
  loop.step({10 * SAMPLES});
  const spent = process.cpuUsage(began);
  if (round >= 3) found.push(spent.user / {10 * SAMPLES});
}}
console.log(found.sort((a, b) => a - b)[4]);
""",
        encoding="utf-8",
    )
    program = str(shutil.which("node"))
    return lambda: float(subprocess.run([program, script], check=True, capture_output=True, text=True).stdout)  # noqa: S603


def c_steps(folder: Path) -> Callable[[], float]:
    """A function that answers how many µs a sample takes in C."""
    run = compiled_c(folder, 1)
    ends, peaks, record = np.zeros((1, 3)), np.zeros(1), np.zeros((SAMPLES + 1, 4))
    nominal = [np.ones(1)] * 3  # the start, and the plant's gravity and torque beside those of its own load

    def once() -> float:
        begun = time.process_time()
        for _ in range(100):
            run(*nominal, SAMPLES, ends, peaks, record.ctypes.data)
        return (time.process_time() - begun) / (100 * SAMPLES) * 1e6

    return once


WATCH = """() => {
  globalThis.gaps = []; globalThis.work = [];
  const frame = ulnaPage._frame.bind(ulnaPage);
  let last = null;
  ulnaPage._frame = (now) => {
    const began = performance.now();
    frame(now);
    work.push(performance.now() - began);
    if (last !== null) gaps.push(now - last);
    last = now;
  };
}"""
"""Notes the time between frames and the time that each one computes, ms."""


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A page in Chromium: ms to ready; CPU time of its process as a share of a core; frames a second; ms of the longest
    time between two frames and of the longest computing in one, after the first second."""

    ready: float
    share: float
    frames: float
    gap: float
    work: float

    def __str__(self) -> str:
        return (
            f"ready after {self.ready:.0f} ms, {100 * self.share:.0f} % of a core, {self.frames:.0f} frames a second, "
            f"at most {self.gap:.0f} ms between two frames and {self.work:.0f} ms of computing in one"
        )


def in_chromium(path: Path, seconds: float) -> Shown:
    """A page opened five times, the last time watched in motion."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        waits, page = [], browser.new_page(viewport={"width": 1280, "height": 900})
        for _ in range(5):
            page.goto("about:blank")
            begun = time.perf_counter()
            page.goto(path.as_uri())
            page.wait_for_selector("body.ready")
            waits.append((time.perf_counter() - begun) * 1e3)
        page.evaluate(WATCH)
        devtools = page.context.new_cdp_session(page)
        devtools.send("Performance.enable")
        page.wait_for_timeout(1000)
        page.evaluate("() => { gaps.length = work.length = 0; }")

        def busy() -> float:
            rows: list[dict[str, Any]] = devtools.send("Performance.getMetrics")["metrics"]
            return next(row["value"] for row in rows if row["name"] == "ProcessTime")

        before, begun = busy(), time.perf_counter()
        page.wait_for_timeout(seconds * 1e3)
        share, lasted = busy() - before, time.perf_counter() - begun
        gaps, work = page.evaluate("[gaps, work]")
        browser.close()
    return Shown(
        ready=statistics.median(waits), share=share / lasted, frames=len(gaps) / lasted, gap=max(gaps), work=max(work)
    )


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    asked.add_argument("--rounds", type=int, default=5)
    asked.add_argument("--seconds", type=float, default=5.0)
    given = asked.parse_args()
    loop = paper_loop()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if shutil.which("node"):
            page, c = node_steps(loop, folder), c_steps(folder)
            pairs = [(page(), c()) for _ in range(given.rounds)]
            ours, theirs = (statistics.median(each) for each in zip(*pairs, strict=True))
            ratio = statistics.median(one / other for one, other in pairs)
            print(f"a sample in node {ours:.3f} us, in C {theirs:.3f} us, ratio {ratio:.2f}")
        path = ulna.studio(loop, out=folder / "arm.html")
        print(f"page of the paper's loop: {path.stat().st_size / 1000:.0f} kB")
        if shutil.which("chromium") or shutil.which("google-chrome"):
            print(f"Chromium, one arm: {in_chromium(path, given.seconds)}")
            eight = ulna.studio(*[loop] * 8, names=[f"arm {k}" for k in range(1, 9)], out=folder / "eight.html")
            print(f"Chromium, eight side by side: {in_chromium(eight, given.seconds)}")


if __name__ == "__main__":
    main()
