"""The rules behind the verdicts: each must say no where something is wrong, and yes only where nothing is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
import sympy as sp

from ulna.base import UlnaError
from ulna.studies.paper.carry import Checked, check_chain
from ulna.studies.paper.chain import XBAR, number_chain
from ulna.studies.paper.compare import Finding
from ulna.studies.paper.exact import Exact, exact_design, known_results, paper_choices
from ulna.studies.paper.judge import judge, notes
from ulna.studies.paper.loops import controllers, deviations
from ulna.studies.paper.mechanics import mechanics
from ulna.studies.paper.printed import Paper, paper
from ulna.studies.paper.statements import statements
from ulna.studies.paper.verdict import compare_law, statement

x, y = sp.symbols("x y", real=True)


@pytest.fixture(scope="module")
def exact() -> Exact:
    return exact_design(paper_choices(paper()))


@pytest.fixture(scope="module")
def chain(exact: Exact) -> dict[str, Checked]:
    return dict(_chain(exact, paper()))


def _chain(exact: Exact, printed: Paper):
    drift, field = exact.named(exact.view.f), exact.named(exact.view.g)
    return check_chain(number_chain(printed, drift, field, choices=exact.choices, known=known_results(exact)))


def _with(changes: dict[str, dict[str, Any]]) -> Paper:
    """The paper with other entries printed, by key of the passage."""
    original = paper()
    changed = [replace(p, printed={**p.printed, **changes.get(p.key, {})}) for p in original.passages]
    return replace(original, passages=tuple(changed))


@pytest.mark.parametrize(
    ("printed", "right", "words"),
    [
        (x + y, x - y, "does not hold"),
        (sp.Matrix([x, y]), sp.Matrix([[x, y]]), "transpose"),
        (sp.Matrix([x, y]), sp.Matrix([x, y, 0]), "2 × 1 entries where 3 × 1 entries were expected"),
        (sp.Matrix([x, y]), sp.Matrix([x, -y]), "does not hold"),
        (sp.Matrix([x]), x, "matrix"),
    ],
)
def test_a_law_that_does_not_hold_is_a_misprint(printed, right, words):
    found = compare_law(printed, right, text="as printed")
    assert found.finding is Finding.MISPRINT
    assert words in found.meaning


def test_a_law_that_holds_in_another_form_is_a_statement():
    found = compare_law((x + y) ** 2, x**2 + 2 * x * y + y**2, text="as printed", meaning="checked")
    assert found.finding is Finding.STATEMENT
    assert found.meaning == "checked"


def test_a_statement_that_fails_is_a_misprint():
    assert statement(paper().passages[0], holds=False, meaning="no").finding is Finding.MISPRINT


def test_the_printed_laws_are_held_to_what_they_say(exact):
    wrong = {
        "lie_bracket": {"bracket": "D(g)*f - D(f)*g"},
        "controllability_rule": {"columns": ["g", "bracket(g, f)", "bracket(f, bracket(f, g))"]},
        "observer": {"right": "(A + L*c)*zbar + alpha + L*y"},
        "estimation_error": {"right": "(A - L*c)*(zbar - z)"},
        "first_condition": {"left": "D(h)*J3"},
        "law_in_new_coordinates": {"rule": "fbar3 - (k1*z1 + k2*z2 + k3*z3)"},
    }
    before, after = statements(paper(), exact), statements(_with(wrong), exact)
    for key in wrong:
        assert before[key].finding is Finding.STATEMENT, key
        assert after[key].finding is Finding.MISPRINT, key


def test_laws_with_a_misprint_hold_once_it_is_put_right(exact):
    right = {
        "lie_derivative": {"sum": "h1*f1 + h2*f2 + h3*f3"},
        "lie_derivative_of_covector": {"third": "transpose(nabla(Lf(h)))"},
        "transformation_rule": {"T": ["T1", "Lf(T1)", "Lf(Lf(T1))"]},
    }
    before, after = statements(paper(), exact), statements(_with(right), exact)
    for key in right:
        assert before[key].finding is Finding.MISPRINT, key
        assert after[key].finding is Finding.STATEMENT, key


def test_the_printed_mechanics_is_held_to_the_plants():
    wrong = {
        "inertia": {"I0": "m2*b**2 + 1/2*b**2*m1"},
        "biceps_force": {"F2": "c2*thetaP"},
        "small_angle": {"left": "I0*ddtheta + c1*a1**2*dtheta + (c2*a2 + sin(thetabar)*g*b*(m2 + 1/2*m1))*theta"},
        "natural_frequency": {"squared": "(c2*a2 - sin(thetabar)*g*b*(m2 + m1))/(b**2*(m2 + 1/3*m1))"},
        "armature": {"left": "La*dia + Ra*ia - kb*N*dthetaP"},
        "parameters": {"b": "30"},
    }
    before, after = mechanics(paper()), mechanics(_with(wrong))
    for key in wrong:
        assert before[key].finding is Finding.AGREES, key
        assert after[key].finding is Finding.MISPRINT, key


def test_a_misprint_put_right_is_no_longer_found(exact):
    right = "-6.528*x1 - 1.448*x2 - 0.2*x3 - 21.168*cos(x1) + 1.764*x2*sin(x1)"
    assert _chain(exact, _with({"law": {"u": right}}))["u"].finding is Finding.AGREES


def test_every_passage_has_a_verdict_and_every_misprint_a_meaning(exact, chain):
    judged = judge(paper(), exact, chain)
    assert [entry.passage.key for entry in judged] == list(paper().keys)
    for entry in judged:
        if entry.finding in (Finding.ROUNDING, Finding.MISPRINT):
            assert entry.passage.key in notes()["passage"], entry.passage.key
            bad = [c for c in entry.comparisons if c.finding is entry.finding]
            assert all(c.meaning for c in bad), entry.passage.key


def test_every_printed_number_of_the_chain_has_a_verdict(chain):
    for checked in chain.values():
        marks = {mark for row in checked.step.printed for cell in row for mark in cell.marks}
        assert len(checked.comparisons) >= min(1, len(marks)), checked.step.key


def test_a_passage_of_which_nothing_is_compared_is_refused(exact, chain):
    strange = replace(paper().passages[0], key="nobody_knows_this")
    with pytest.raises(UlnaError, match="no part of it was compared"):
        judge(replace(paper(), passages=(*paper().passages, strange)), exact, chain)


def test_the_deviations_lead_from_the_exact_controller_to_the_printed_one(chain):
    exact, printed = controllers(chain)
    found = deviations(exact, printed)
    assert deviations(exact, exact) == ()
    difference = sum((d.alone.law - exact.law for d in found), sp.Integer(0))
    assert sp.expand(difference - (printed.law - exact.law)) == 0
    rates = sum((d.alone.estimator_rates - exact.estimator_rates for d in found), sp.zeros(3, 1))
    assert sp.expand(sp.Matrix(rates - (printed.estimator_rates - exact.estimator_rates))).is_zero_matrix
    assert {s for d in found for s in d.printed.free_symbols} & set(XBAR) == set()
