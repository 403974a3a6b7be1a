"""The step of three loops in plain arithmetic: NumPy, Numba, C and JavaScript give the same bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from compilers import GCC, by_c, by_node, by_numba, node, same_bits

import ulna
from ulna.loop import ConditionalIntegration, Hardware, Loop, Pwm, Quantiser, Saturation, SlewLimit
from ulna.program import Kernel, Plain, in_arithmetic, to_numpy

ARM = ulna.model("one_link_arm").with_values()
LAW = ulna.state_feedback(ulna.controller_form(ARM), ulna.Poles(-2, -3, -8))
OBSERVER = ulna.exact_observer(ulna.observer_form(ARM), ulna.Poles(-9, -10, -11))
LIMIT = Saturation(lower=-24.0, upper=24.0)


def _steps() -> list[Kernel]:
    """A compensator behind an encoder, one with integral action behind a late bridge, a law on the states."""
    both = ulna.compensator(LAW, OBSERVER)
    eager = ulna.state_feedback(
        ulna.controller_form(ARM), ulna.Poles(-2, -3, -4, -5), reference=ulna.SetPoint(), integral=True
    )
    encoder = Quantiser.encoder(bits=12)
    kinds = [
        (both, {"sensors": encoder, "saturation": LIMIT, "delay": 1e-3}),
        (
            ulna.compensator(eager, OBSERVER),
            {
                "saturation": LIMIT,
                "slew": SlewLimit(rate=500.0),
                "delay": 1.4e-3,
                "drive": Pwm(frequency=2e4, supply=24.0, sag=0.1),
                "anti_windup": ConditionalIntegration(states=("e1_int",)),
            },
        ),
        (LAW, {"sensors": {"theta": encoder}}),
    ]
    return [
        Loop(plant=ARM, controller=c, hardware=Hardware(period=1e-3, arithmetic=Plain(), **parts)).step.kernel
        for c, parts in kinds
    ]


STEPS = _steps()
MOST = max(len(step.inputs) for step in STEPS)


def _points() -> np.ndarray:
    random = np.random.default_rng(1)
    x = random.normal(scale=10.0 ** random.uniform(-3, 2, (MOST, 200)))
    x[:, 190:] = random.choice([np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, 1e300], (MOST, 10))
    return x


POINTS = _points()
EXPECTED = np.concatenate([to_numpy(step)(*POINTS[: len(step.inputs)]) for step in STEPS])


def test_numba_takes_the_same_step() -> None:
    # One of them: each takes seconds to compile.
    first = EXPECTED[: len(STEPS[0].outputs)]
    assert same_bits(by_numba(STEPS[:1], POINTS), first)


@pytest.mark.skipif(GCC is None, reason="there is no gcc")
def test_c_takes_the_same_step(tmp_path: Path) -> None:
    assert same_bits(by_c(STEPS, POINTS, tmp_path), EXPECTED)


@pytest.mark.skipif(node() is None, reason="there is no node")
def test_javascript_takes_the_same_step(tmp_path: Path) -> None:
    assert same_bits(by_node(STEPS, POINTS, tmp_path), EXPECTED)


def test_a_step_in_other_arithmetic_is_told_apart() -> None:
    rounded_otherwise = [in_arithmetic(step, ulna.Fused()) for step in STEPS]
    other = np.concatenate([to_numpy(step)(*POINTS[: len(step.inputs)]) for step in rounded_otherwise])
    assert not same_bits(other, EXPECTED)
