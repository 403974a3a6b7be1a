"""Linearisation by coordinates alone: commuting brackets, the coordinates, and what breaks it."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from ulna.design.forms.linear_coordinates import StateLinearisation, state_linearisation
from ulna.symbolic.exact import are_zero
from ulna.system import System, control_affine, system_from_mapping

x1, x2, x3 = sp.symbols("x1:4", real=True)
# Every example is a whole analysis: shrinking a failure would take minutes.
WITHOUT_SHRINKING = (Phase.explicit, Phase.generate)


def small(states: dict[str, str], inputs: str = "u", **more: Any) -> System:
    return system_from_mapping(
        {
            "name": "small",
            "states": {name: {"equation": text} for name, text in states.items()},
            "inputs": {name: {} for name in inputs.split()},
            **more,
        }
    )


def is_linear_in(found: StateLinearisation, system: System) -> bool:
    """The plant's rates in the new coordinates are A z + B u + offset: checked in x."""
    view = control_affine(system)
    assert found.map is not None
    assert found.A is not None
    assert found.B is not None
    assert found.offset is not None
    forward = found.map.forward
    drift = found.map.jacobian * view.f - found.A * forward - found.offset
    return are_zero([*drift, *(found.map.jacobian * view.g - found.B)]).holds


def test_the_example_that_works_and_its_neighbour_that_does_not() -> None:
    # mathematica.stackexchange.com/q/194301: the coefficient 3 in place of 7 makes the difference.
    works = small({"x1": "3*x1 + u", "x2": "7*x1**2 + 2*x2 + (2*x1 - 1)*u"})
    neighbour = small({"x1": "3*x1 + u", "x2": "7*x1**2 + x2 + (2*x1 - 1)*u"})
    no = state_linearisation(neighbour)
    assert no.verdict.fails
    assert no.verdict.evidence["bracket"] == "[g, ad_f g]"
    assert no.map is None
    # d(x2 − x1²)/dt = 7 x1² + 2 x2 − 6 x1² − u = x1² + 2 x2 − u: linear in z exactly if x1² + 2 x2 is.
    assert state_linearisation(works).verdict.fails
    right = small({"x1": "3*x1 + u", "x2": "4*x1**2 + 2*x2 + (2*x1 - 1)*u"})
    found = state_linearisation(right)
    assert found.verdict.holds
    assert is_linear_in(found, right)


def test_a_linear_plant_is_linear_as_it_stands_even_if_uncontrollable() -> None:
    system = small({"x1": "-x1", "x2": "-2*x2 + u + 1"})
    found = state_linearisation(system)
    assert found.verdict.holds
    assert found.A == sp.ImmutableDenseMatrix([[-1, 0], [0, -2]])
    assert found.offset == sp.ImmutableDenseMatrix([0, 1])
    assert is_linear_in(found, system)


def test_a_nonlinear_plant_that_cannot_be_controlled_is_refused_by_its_rank() -> None:
    found = state_linearisation(small({"x1": "-x1**3", "x2": "u"}))
    assert found.verdict.fails
    assert found.verdict.evidence["rank"] == 1


def test_feedback_linearisable_is_not_enough() -> None:
    found = state_linearisation(small({"x1": "x2", "x2": "sin(x1) + u"}))
    assert found.verdict.fails
    assert found.verdict.evidence["bracket"] == "[ad_f g, ad_f^2 g]"


def test_two_inputs() -> None:
    system = small({"x1": "x2 + x3**2 + 2*x3*u2", "x2": "u1", "x3": "u2"}, "u1 u2")
    found = state_linearisation(system)
    changed = small({"x1": "x2 + 2*x3*u2", "x2": "u1", "x3": "u2"}, "u1 u2")
    assert found.verdict.fails
    good = state_linearisation(changed)
    assert good.verdict.holds
    assert is_linear_in(good, changed)


@settings(max_examples=6, phases=WITHOUT_SHRINKING)
@given(
    st.lists(st.integers(-2, 2), min_size=3, max_size=3),
    st.integers(-3, 3),
    st.sampled_from(["quadratic", "sine", "exponential"]),
)
def test_a_linear_plant_in_disguise_is_recovered(row: list[int], coefficient: int, kind: str) -> None:
    """z' = A z + B u in the coordinates x with z1 = x1 + φ(x2, x3), z2 = x2, z3 = x3."""
    bend = {"quadratic": x3**2 + x2 * x3, "sine": sp.sin(x3), "exponential": sp.exp(x3) - 1}[kind] * coefficient
    z = sp.Matrix([x1 + bend, x2, x3])
    drift = sp.Matrix([z[1], z[2], sum(a * e for a, e in zip(row, z, strict=True))])
    back = z.jacobian([x1, x2, x3]).inv()
    f, g = back * drift, back * sp.Matrix([0, 0, 1])
    texts = {f"x{k + 1}": f"{sp.expand(f[k])} + ({g[k]})*u" for k in range(3)}
    system = small(texts, operating_point={"x1": 0, "x2": 0, "x3": 0})
    found = state_linearisation(system)
    assert found.verdict.holds
    assert is_linear_in(found, system)


@pytest.mark.parametrize("names", ["", "u"])
def test_plants_without_a_chance_get_an_answer(names: str) -> None:
    found = state_linearisation(small({"x1": "-x1**3", "x2": "x1" + "".join(f" + {n}" for n in names.split())}, names))
    assert found.verdict.fails
