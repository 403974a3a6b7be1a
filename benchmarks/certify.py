"""Time and volume of proved regions, beside sampling: what part of the region of attraction is proved, and of a box.

The peer is what is done without a proof: random states of a box are simulated by SciPy's LSODA (rtol 1e-8) to see which
converge. The box is that of `SIDES`, else `FACTOR` times the half-axes of the proved ellipsoid.
The share is (states in the proved set) ÷ (states that converge), of the same sample, ± its standard error; a state in
the proved set that does not converge would be an error of one of both and is counted. Exact equations within limits
for all; CPU time, without imports.

    python benchmarks/certify.py [--samples 400] [--boxes 60000]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import ulna
from ulna.certify import LevelSet, Region, check, level_set, prove
from ulna.loop import Hardware, Loop, Saturation
from ulna.system import system_from_mapping

FACTOR = 1.5
SIDES = {"van_der_pol": (2.1, 2.8)}
"""Half-widths by loop; these hold the limit cycle, so that the sample sees the whole region of attraction."""
_PATIENCE = 40.0
_FAR = 1e3


def paper() -> Loop:
    """The arm of the paper under its law on true states, ±24 V."""
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles("-2+3.46j", "-2-3.46j", -8))
    return Loop(plant=arm, controller=law, hardware=_limit(24.0))


def van_der_pol() -> Loop:
    """Reversed time: the origin attracts what is inside the limit cycle, an area of published size."""
    rates = {"x1": "-x2", "x2": "x1 - (1 - x1**2)*x2"}
    plant = system_from_mapping({"name": "van der Pol, reversed", "states": rates, "outputs": {"y": "x1"}})
    return Loop(plant=plant)


def duffing() -> Loop:
    """The spring of the catalogue under its law, within ±5."""
    spring = ulna.model("duffing").with_values()
    law = ulna.state_feedback(ulna.controller_form(spring), ulna.Poles(-2, -3))
    return Loop(plant=spring, controller=law, hardware=_limit(5.0))


LOOPS: dict[str, Callable[[], Loop]] = {"paper": paper, "van_der_pol": van_der_pol, "duffing": duffing}


def _limit(size: float) -> Hardware:
    return Hardware(saturation=Saturation(lower=-size, upper=size))


def converges(found: LevelSet, start: np.ndarray) -> bool:
    """Whether the run from a state comes down to a thousandth of the proved level."""

    def down(_: float, x: np.ndarray) -> float:
        return float(found.value(x[:, None])[0]) - 1e-3

    def away(_: float, x: np.ndarray) -> float:
        return _FAR - float(np.abs(x - found.rest).max())

    down.terminal = away.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    done = solve_ivp(
        lambda _, x: np.nan_to_num(found.rates(x[:, None])[:, 0]),
        (0.0, _PATIENCE / found.slowest),
        start,
        method="LSODA",
        events=(down, away),
        rtol=1e-8,
        atol=1e-10,
    )
    return bool(len(done.t_events[0]))


def measured(name: str, samples: int, boxes: int) -> dict[str, Any]:
    """One loop: proved, checked, and beside the sample."""
    loop, began = LOOPS[name](), time.thread_time()
    verdict = prove(loop, Region(), boxes=boxes)
    proving = time.thread_time() - began
    if not verdict.holds:
        return {"loop": name, "verdict": str(verdict), "prove_s": round(proving, 2)}
    certificate, began = verdict.evidence["certificate"], time.thread_time()
    right = check(certificate).holds
    checking = time.thread_time() - began
    found, half = level_set(certificate), np.array(list(verdict.evidence["half_axes"].values()))
    n, sides = len(half), np.array(SIDES.get(name, FACTOR * half))
    offsets = np.random.default_rng(0).uniform(-1.0, 1.0, (n, samples)) * sides[:, None]
    starts = found.rest[:, None] + offsets
    inside = found.value(starts) <= 1.0
    began = time.thread_time()
    attracted = np.array([converges(found, start) for start in starts.T])
    sampling = time.thread_time() - began
    share = inside.sum() / max(1, attracted.sum())
    # In ζ; the map to the states has the factor |det ∂x/∂ζ|, which the sample sees.
    ball = math.pi ** (n / 2) / math.gamma(n / 2 + 1)
    part = inside.mean()
    return {
        "loop": name,
        "prove_s": round(proving, 2),
        "check_s": round(checking, 2),
        "check": right,
        "boxes": verdict.evidence["boxes"],
        "half_axes": [round(float(h), 3) for h in half],
        "volume_in_coordinates": float(f"{ball * math.sqrt(found.level**n / np.linalg.det(found.P)):.4g}"),
        "volume_in_states": float(f"{part * np.prod(2 * sides):.3g}"),
        "sampled_half_widths": [round(float(side), 3) for side in sides],
        "sample_s": round(sampling, 2),
        "attracted_part_of_box": round(float(attracted.mean()), 3),
        "proved_share_of_attracted": round(float(share), 3),
        "standard_error": round(float(math.sqrt(share * (1 - share) / max(1, attracted.sum()))), 3),
        "contradictions": int((inside & ~attracted).sum()),
    }


def main() -> None:
    """Print one line of JSON for each loop."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--boxes", type=int, default=60_000)
    parser.add_argument("--loops", nargs="*", choices=list(LOOPS), default=list(LOOPS))
    given = parser.parse_args()
    for name in given.loops:
        print(json.dumps(measured(name, given.samples, given.boxes)), flush=True)


if __name__ == "__main__":
    main()
