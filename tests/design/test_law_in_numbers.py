"""A law is a function of the state: `law(x)`, with references and parameters by name."""

from __future__ import annotations

import numpy as np
import pytest

from ulna.base import DesignError
from ulna.design import Law, SetPoint, state_feedback
from ulna.plants import model


@pytest.fixture(name="law", scope="module")
def law_of_the_arm() -> Law:
    return state_feedback(model("one_link_arm"), [-2, -3, -4], reference=SetPoint(), integral=False)


def test_a_law_is_called_with_a_state_with_many_or_by_name(law: Law) -> None:
    states = np.random.default_rng(1).uniform(-1, 1, (4, 3))
    rows = law(states, y_ref=0.2)
    assert rows.shape == (4, 1)
    for state, row in zip(states, rows, strict=True):
        assert law(state, y_ref=0.2).shape == (1,)
        np.testing.assert_allclose(law(state, y_ref=0.2), row, rtol=1e-12)
    named = {"i": states[:, 2], "omega": states[:, 1], "theta": states[:, 0]}
    assert np.array_equal(law(named, y_ref=0.2), rows)


def test_it_says_what_its_formula_says(law: Law) -> None:
    at = {"theta": 0.3, "omega": -0.4, "i": 0.5, "y_ref": 0.1, "m2": 4.5}
    plant = law.plant
    formula = plant.inline(tuple(law.expressions))[0].xreplace(
        {s: v for s, v in plant.values.items() if s.name != "m2"}
    )
    expected = float(formula.subs({s: at[s.name] for s in formula.free_symbols}))
    assert law([0.3, -0.4, 0.5], y_ref=0.1, m2=4.5)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("states", "given", "found"),
    [
        ([0.1, 0.2], {"y_ref": 0.0}, "Give 3 numbers"),
        ({"theta": 0.1}, {"y_ref": 0.0}, "Give theta, omega, i"),
        ([0, 0, 0], {}, r"law\(x, y_ref=...\)"),
        ([0, 0, 0], {"y_ref": 0.0, "speed": 1.0}, "no reference or parameter speed"),
        ([0, 0, 0], {"y_ref": 0.0, "theta": 1.0}, "no reference or parameter theta"),
    ],
)
def test_a_wrong_state_or_name_is_refused(law: Law, states: object, given: dict[str, float], found: str) -> None:
    with pytest.raises(DesignError, match=found):
        law(states, **given)  # pyright: ignore[reportArgumentType]
