"""Fourteen states, few operations: the structure in numbers, the given outputs in formulas, and both agree."""

from __future__ import annotations

import time

import numpy as np
import pytest
import sympy as sp

from ulna.design.analysis.analysis import analyse
from ulna.design.forms.law_kernel import compiled_law
from ulna.plants import flexible_joint_arm, model
from ulna.program import to_numpy
from ulna.symbolic.compiling import kernel


@pytest.fixture(scope="module")
def analysis():
    start = time.process_time()
    found = analyse(model("quadrotor_extended"), seconds=60)
    return found, time.process_time() - start


def test_both_roads_give_the_same_law(analysis):
    found, _ = analysis
    plant = model("quadrotor_extended")
    law = compiled_law(plant)
    v = [sp.Symbol(f"v{k}", real=True) for k in (1, 2, 3, 4)]
    values = plant.values
    formulas = {f"u{k}": e.xreplace(values) for k, e in enumerate(found["control"].value)}
    program = to_numpy(kernel("law", (*plant.state_symbols, *v), formulas))
    generator = np.random.default_rng(14)
    for _ in range(5):
        states, new = generator.uniform(0.2, 1.0, 14), generator.uniform(-1, 1, 4)
        expected = np.array(program(*states, *new))
        compiled = np.array(to_numpy(law.law)(*states, *new))
        assert compiled == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_the_transformation_is_the_chains_of_the_outputs(analysis):
    found, _ = analysis
    plant = model("quadrotor_extended")
    assert len(found["T"].value) == 14
    assert [found["T"].value[k] for k in (0, 4, 8, 12)] == list(plant.readouts)


def test_a_large_plant_of_many_operations_gets_no_formulas():
    assert analyse(flexible_joint_arm(4))["T"].value is None
