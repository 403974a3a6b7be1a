"""Plants without zero dynamics are minimum phase, also where the point that remains was not written down."""

from dataclasses import replace

import pytest

from ulna.base import Verdict
from ulna.design.internal.output_zeroing import zero_dynamics
from ulna.design.internal.phase import minimum_phase
from ulna.system import system_from_mapping


@pytest.mark.parametrize(("output", "expected"), [("x1", "exponential"), ("x2", "undecided")])
def test_relative_degrees_that_add_up_leave_no_zero_dynamics(output: str, expected: str) -> None:
    data = {"name": "plant", "states": {"x1": "x2", "x2": "u"}, "inputs": {"u": {}}, "outputs": {"y": output}}
    found = zero_dynamics(system_from_mapping(data))
    unsolved = replace(found, system=None, verdict=Verdict.undecided("the zero dynamics are found", reason="a test"))
    assert minimum_phase(unsolved).stability == expected
