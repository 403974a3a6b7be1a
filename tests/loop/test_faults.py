"""Faults and reactions of a step against a reference in plain Python, sample after sample; no engine is involved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from processor import Processor, static

import ulna
from ulna.base import SimulationError
from ulna.loop import (
    Deadline,
    Euler,
    Fault,
    Guard,
    Hardware,
    Hold,
    InnovationLimit,
    Jitter,
    Loop,
    MissedSamples,
    Parts,
    ReferenceRange,
    Report,
    SafeOutput,
    joined,
)
from ulna.program import Plain
from ulna.system import System, system_from_mapping

H = 0.01
SIZE = 0.6
PLANT = system_from_mapping(
    {"name": "plant", "states": {"x": "u - x"}, "inputs": {"u": {}}, "outputs": {"y": "x"}, "parameters": {}}
)
ESTIMATOR = system_from_mapping(
    {
        "name": "estimator",
        "states": {"z": "u - z + 5*(y - z)"},
        "inputs": {"u": {}, "y": {}},
        "outputs": {"x_hat": "z"},
        "parameters": {},
    }
)
LAW = static("law", ["x", "r"], {"u": "r - 2*x"})


def _loop(**parts: Any) -> Loop:
    controller = Parts(system=joined(LAW, ESTIMATOR, name="both"), law=LAW, observer=ESTIMATOR)
    hardware = Hardware(**{"period": H, "discretisation": Euler(), "arithmetic": Plain(), **parts})
    return Loop(plant=PLANT, controller=controller, hardware=hardware)


@dataclass
class Reference:
    """The step as the docstrings of `ulna.loop.watches` say it, written once more."""

    deadline: Deadline
    range: ReferenceRange
    limit: InnovationLimit
    guard: Guard
    z: float = 0.0
    y: float = 0.0
    r: float = 0.0
    u: float = 0.0
    started: bool = False
    missed: int = 0
    large: int = 0
    small: int = 0
    lost: bool = False

    def sample(self, y: float, r: float, elapsed: float, missed: bool) -> tuple[float, int, float]:
        """(command, fault code, state of the estimator)."""
        code = 0
        low, high = float(self.range.lower or 0), float(self.range.upper or 0)
        if not low <= r <= high:
            code += Fault.REFERENCE
            if self.range.held or math.isnan(r):
                r = min(high, max(low, self.r))
            else:
                r = min(high, max(low, r))
        finite = math.isfinite(y)
        if self.started and finite and not missed:
            self.z += H * (self.u - self.z + 5 * (self.y - self.z))
        if finite and not missed:
            self.y = y
        late = self.started and not elapsed <= H + float(self.deadline.lateness or 0)
        self.started, self.r = True, r
        if finite and not missed:
            self._count(not abs(self.y - self.z) <= SIZE)
        self.missed = self.missed + 1 if missed else 0
        gone = self.missed > int(self.deadline.missed or 0)
        value, held = r - 2 * self.z, self.u
        flags = {Fault.NOT_FINITE: not finite, Fault.MISSED: gone, Fault.LATE: late, Fault.LOST: self.lost}
        code += sum(int(bit) for bit, on in flags.items() if on)
        if late:
            value = self._instead(self.deadline.reaction, value, held)
        if self.lost:
            value = self._instead(self.limit.reaction, value, held)
        if not finite:
            value = self._instead(self.guard.reaction, value, held)
        if missed:
            value = held
        if gone:
            value = self._instead(self.deadline.reaction, held, held)
        self.u = value
        return value, code, self.z

    def _count(self, large: bool) -> None:
        self.large = self.large + 1 if large else 0
        if self.lost:
            self.small = 0 if large else self.small + 1
            if self.limit.resume is not None and self.small >= self.limit.resume:
                self.lost, self.small = False, 0
        else:
            self.small = 0
            self.lost = self.large >= self.limit.samples

    @staticmethod
    def _instead(reaction: Any, value: float, held: float) -> Any:
        if isinstance(reaction, Report):
            return value
        return reaction.output if isinstance(reaction, SafeOutput) else held


SETTINGS = [
    (Hold(), Hold(), Hold(), None, False),
    (SafeOutput(0.5), SafeOutput(-0.25), SafeOutput(0.125), 4, False),
    (Report(), Report(), Hold(), 2, True),
    (SafeOutput(0.5), Report(), SafeOutput(0.125), 1, True),
    (Report(), SafeOutput(-0.25), Hold(), 3, False),
]


@pytest.mark.parametrize(("timing", "losing", "guarding", "resume", "held"), SETTINGS)
def test_every_reaction_is_that_of_the_reference(
    timing: Any, losing: Any, guarding: Any, resume: int | None, held: bool
) -> None:
    parts = {
        "deadline": Deadline(lateness=2e-3, missed=2, reaction=timing),
        "references": ReferenceRange(lower=-1.0, upper=2.0, held=held),
        "innovation": InnovationLimit(size=SIZE, samples=3, resume=resume, reaction=losing),
        "guard": Guard(reaction=guarding),
    }
    p = Processor(_loop(**parts))
    reference = Reference(parts["deadline"], parts["references"], parts["innovation"], parts["guard"])
    random, seen = np.random.default_rng(3), 0
    y = 0.0
    for k in range(1500):
        y = 0.9 * y + random.normal(0.0, 0.25) + (2.0 if k % 60 > 50 else 0.0)
        given = math.nan if random.random() < 0.02 else y
        r = random.choice([0.5, -0.5, 3.0, -4.0, math.nan, math.inf], p=[0.4, 0.4, 0.05, 0.05, 0.05, 0.05])
        elapsed = random.choice([H, H + 2.1e-3, H + 1.9e-3, 3 * H, math.nan], p=[0.8, 0.05, 0.05, 0.05, 0.05])
        missed = bool(random.random() < (0.6 if k % 100 > 90 else 0.05))
        expected = reference.sample(given, float(r), float(elapsed), missed)
        found = p.sample(y0=given, r0=float(r), elapsed=float(elapsed), missed=float(missed))
        assert found["code"] == expected[1], k
        assert (found["c0"], found["z0"]) == pytest.approx(expected[::2], abs=1e-12), k
        seen |= expected[1]
    assert seen == sum(Fault)


def test_no_call_before_the_first_one_makes_it_late() -> None:
    p = Processor(_loop(deadline=Deadline(lateness=0.0)))
    assert [p.sample(y0=0.1, elapsed=each)["code"] for each in (9.0, 0.01, 0.0101)] == [0, 0, Fault.LATE]


def test_no_reference_is_seen_out_of_its_range_not_even_before_the_first_one() -> None:
    p = Processor(_loop(references=ReferenceRange(lower=1.0, upper=2.0, held=True)))
    assert [p.sample(y0=0.0, r0=each)["rn0"] for each in (math.nan, 3.0, 1.5, 0.5)] == [1.0, 1.0, 1.5, 1.5]


def test_the_count_of_missed_samples_keeps_its_last_bit() -> None:
    p = Processor(_loop(deadline=Deadline(missed=2)))
    found = [p.sample(y0=0.0, r0=1.0, missed=float(k > 0)) for k in range(9)]
    assert [each["code"] for each in found] == [0, 0, 0] + [Fault.MISSED] * 6
    assert max(each["absent"] for each in found) == 2.0


def test_a_reference_declares_its_own_range_unless_another_is_given() -> None:
    table = {
        "name": "law",
        "states": {"nothing": "0"},
        "inputs": {"x": {}, "r": {"range": [-1, 1]}},
        "outputs": {"u": "r - 2*x"},
    }
    law = system_from_mapping(table)
    loop = Loop(plant=PLANT, controller=law, hardware=Hardware(period=H, references=ReferenceRange(upper=0.5)))
    p = Processor(loop)
    assert [p.sample(y0=0.0, x0=0.0, r0=each)["c0"] for each in (-3.0, 0.25, 3.0)] == [-1.0, 0.25, 0.5]
    with pytest.raises(SimulationError, match="the reference declares no range, and none is given"):
        _loop(references=ReferenceRange())


def test_a_filter_watches_what_it_predicted() -> None:
    """After its update the estimate is the measured value, however far off the plant is."""
    arm = ulna.model("one_link_arm").with_values()
    law = ulna.state_feedback(ulna.controller_form(arm), ulna.Poles(-2, -3, -8))
    noise = ulna.KalmanNoise(process=[10, 10, 10], measurement=["1e-9"])
    seen = ulna.compensator(law, ulna.extended_kalman_filter(arm, noise))
    limit = InnovationLimit(size={"y": 0.05}, samples=2, reaction=SafeOutput({"u": 1.5}))
    loop = Loop(plant=arm, controller=seen, hardware=Hardware(period=1e-3, innovation=limit))
    p = Processor(loop)
    p.slots |= {f"z{k}": loop.initial.get(s.name, 0.0) for k, s in enumerate(loop.wiring.memory)}
    followed = [p.sample(y0=0.01 * k)["code"] for k in range(30)]
    assert followed == [0] * 30
    found = [p.sample(y0=y) for y in (0.8, -0.5, 0.5, -0.5)]
    assert found[-1]["code"] == Fault.LOST
    assert found[-1]["c0"] == 1.5
    assert abs(found[-1]["yn0"] - found[-1]["e0"]) < 0.05


def test_the_simulator_tells_the_fault_code_of_every_sample() -> None:
    watched = _loop(
        deadline=Deadline(lateness=1e-3, missed=0, reaction=SafeOutput(0.5)),
        references=ReferenceRange(lower=-1.0, upper=1.0),
        clock=(Jitter(width=4e-3), MissedSamples(probability=0.2)),
    )
    t = ulna.TIME
    run = ulna.simulate(watched, (0.0,), 3.0, inputs={"r": t})
    code = run["fault"].astype(int)
    late = np.diff(run.times, prepend=run.times[0]) > H + 1e-3
    assert np.array_equal((code & Fault.LATE) > 0, late)
    assert np.array_equal((code & Fault.REFERENCE) > 0, np.arange(len(code)) > 100)
    gone = (code & Fault.MISSED) > 0
    assert 0.1 < gone.mean() < 0.3
    assert set(run["u_command"][gone | late]) == {0.5}
    bare = ulna.simulate(_loop(), (0.0,), 0.1, inputs={"r": 0.0})
    assert "fault" not in bare.further


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        (Deadline, "it watches nothing"),
        (lambda: Deadline(lateness=-1.0), "expected a time of 0 s or more"),
        (lambda: Deadline(missed=-1), "between 0 and"),
        (lambda: ReferenceRange(lower=1.0, upper=0.0), "not below the upper"),
        (lambda: InnovationLimit(size=0.0, samples=1), "positive number"),
        (lambda: InnovationLimit(size=1.0, samples=0), "from 1 to"),
        (lambda: SafeOutput({"u": math.inf}), "finite number"),
        (lambda: _loop(guard=Guard(reaction=SafeOutput({"v": 1.0}))), "no signal v there. Known: u"),
        (lambda: _loop(references={"s": ReferenceRange(lower=0.0)}), "no signal s there. Known: r"),
        (lambda: _loop(innovation=InnovationLimit(size={"w": 1.0}, samples=1)).step, "'w' is no measured signal with"),
        (lambda: Hardware(deadline=Deadline(missed=1)).require_period(), "once a period"),
        (
            lambda: (
                Loop(
                    plant=PLANT,
                    controller=static("p", ["y"], {"u": "-y"}),
                    hardware=Hardware(period=H, innovation=InnovationLimit(size=1.0, samples=1)),
                ).step
            ),
            "estimates nothing of what it measures",
        ),
    ],
)
def test_what_cannot_be_watched_is_refused(parts: Any, text: str) -> None:
    with pytest.raises(SimulationError, match=text):
        parts()


def test_an_estimate_that_is_the_measured_value_is_no_innovation() -> None:
    """An observer of reduced order estimates what it does not measure; the rest it hands on."""
    reduced = system_from_mapping(
        {"name": "reduced", "states": {"z": "-z"}, "inputs": {"y": {}}, "outputs": {"x_hat": "y + 0*z"}}
    )
    law: System = LAW
    parts = Parts(system=joined(law, reduced, name="both"), law=law, observer=reduced)
    hardware = Hardware(period=H, innovation=InnovationLimit(size=1.0, samples=1))
    with pytest.raises(SimulationError, match="estimates nothing of what it measures"):
        _ = Loop(plant=PLANT, controller=parts, hardware=hardware).step
