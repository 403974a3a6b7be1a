"""The paper's numbers, (16) to (54): each verdict is computed, and the machinery rejects what it must."""

from __future__ import annotations

from dataclasses import replace

import pytest
import sympy as sp

from ulna.base import UlnaError, mathml
from ulna.plants import model
from ulna.studies.paper.carry import Checked, Step, check_chain, printed_value, rows_of
from ulna.studies.paper.chain import X, number_chain
from ulna.studies.paper.compare import Finding
from ulna.studies.paper.printed import paper
from ulna.system import control_affine


def _steps() -> tuple[Step, ...]:
    view = control_affine(model("one-link-arm").with_values())
    names = dict(zip(view.x, X, strict=True))
    return number_chain(paper(), view.f.xreplace(names), view.g.xreplace(names))


@pytest.fixture(scope="module")
def chain() -> dict[str, Checked]:
    return dict(check_chain(_steps()))


def _numbers_with(chain: dict[str, Checked], finding: Finding) -> set[tuple[str, str]]:
    return {(key, c.printed) for key, checked in chain.items() for c in checked.comparisons if c.finding is finding}


def test_the_misprinted_numbers_are_found(chain: dict[str, Checked]) -> None:
    own = {
        (checked.step.label, c.printed)
        for checked in chain.values()
        for c in checked.comparisons
        if c.finding is Finding.MISPRINT and not c.copied
    }
    assert own == {
        ("(26)", "1.77"),
        ("below (30)", "8"),
        ("(32)", "-1.428"),
        ("(32)", "-1.81"),
        ("(44)", "0"),
        ("(44)", "1"),
        ("(53)", "-9.1"),
    }


def test_the_carried_roundings_of_the_estimator_are_told_from_misprints(chain: dict[str, Checked]) -> None:
    carried = _numbers_with(chain, Finding.ROUNDING)
    assert {("J", "40"), ("J_inverse", "9.8"), ("gamma", "339.1"), ("A_52", "92"), ("A_52", "-9.01")} <= carried
    assert {("gamma_52", "-302"), ("A_53", "-9.8"), ("L_53", "-92"), ("f_z", "-34")} <= carried


def test_misprints_that_follow_from_others_say_so(chain: dict[str, Checked]) -> None:
    copied = {(key, c.printed) for key, checked in chain.items() for c in checked.comparisons if c.copied}
    assert {
        ("inverse", "-17.7"),
        ("jacobian", "-1.77"),
        ("f_z", "17.7"),
        ("u", "-21.24"),
        ("u_bar", "-1.428"),
    } <= copied


def test_the_exact_law_and_gains_come_out(chain: dict[str, Checked]) -> None:
    x1, x2, x3 = X
    law = chain["u"].exact[0]
    expected = [(x1, "-6.528"), (x2, "-1.448"), (x3, "-0.2"), (sp.cos(x1), "-21.168"), (x2 * sp.sin(x1), "1.764")]
    assert sp.expand(law - sum(sp.Rational(number) * shape for shape, number in expected)) == 0
    assert list(chain["L_53"].exact) == [20, sp.Rational(4049, 51), -100]


def test_the_exact_error_poles_are_those_that_were_asked_for(chain: dict[str, Checked]) -> None:
    error = chain["A_53"].exact - chain["L_53"].exact * chain["c_53"].exact
    assert error.eigenvals() == {sp.Integer(-9): 1, sp.Integer(-10): 1, sp.Integer(-11): 1}


def test_the_printed_error_poles_are_not(chain: dict[str, Checked]) -> None:
    matrix, gain = printed_value(chain["A_53"].step), printed_value(chain["L_53"].step)
    polynomial = (matrix - gain * sp.Matrix([[1, 0, 0]])).charpoly().as_expr()
    assert sp.expand(polynomial - sp.prod(sp.Symbol("lambda") + k for k in (9, 10, 11))) != 0


def test_a_corrupted_number_is_noticed_wherever_it_stands(chain: dict[str, Checked]) -> None:
    for key in ("Q", "k", "L", "A_loop"):
        step = chain[key].step
        first = step.printed[-1][-1]
        wrong = rows_of([["77.7"]])[0][0]
        rows = (*step.printed[:-1], (*step.printed[-1][:-1], wrong))
        every = _steps()
        last = [s.key for s in every].index(key)
        steps = [*every[:last], replace(every[last], printed=rows)]
        assert first.text != "77.7"
        assert check_chain(steps)[key].finding is Finding.MISPRINT


def test_a_known_value_that_differs_from_the_computed_one_is_an_error() -> None:
    steps = [replace(s, known=sp.ImmutableDenseMatrix([[1, 2, 3]]).T) if s.key == "k" else s for s in _steps()]
    with pytest.raises(UlnaError, match="the step 'k'"):
        check_chain(steps)


def test_a_step_before_what_it_needs_is_an_error() -> None:
    with pytest.raises(UlnaError, match="does not come before"):
        check_chain(_steps()[::-1])


def test_all_54_equations_are_there_once_and_can_be_set_on_a_page() -> None:
    numbers = [p.number for p in paper().passages if p.number]
    assert numbers == list(range(1, 55))
    assert len(set(paper().keys)) == len(paper().passages)
    for passage in paper().passages:
        assert mathml(passage.latex, display=True).startswith("<math")
        assert passage.says.endswith(".")


def test_an_unknown_passage_is_named() -> None:
    with pytest.raises(KeyError, match="nonsense"):
        paper().passage("nonsense")
