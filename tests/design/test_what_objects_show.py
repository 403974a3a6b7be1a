"""What systems, forms, laws and analyses show of themselves in a terminal: equations, not fields."""

from __future__ import annotations

import sympy as sp

from ulna.design import Poles, analyse, controller_form, exact_observer, observer_form, state_feedback
from ulna.plants import model
from ulna.symbolic.formulas import listing

ARM = model("one_link_arm").with_values()


def test_a_system_shows_its_equations():
    assert repr(ARM).splitlines() == [
        "System 'one-link arm with a DC motor', inputs u",
        "  theta' = omega",
        "  omega' = 100*i/51 + 588*cos(theta)/17",
        "  i' = -10*i - 10*omega + 10*u",
        "  y = theta",
    ]
    assert "  J = b**2*m1/3 + b**2*m2" in repr(model("one_link_arm")).splitlines()


def test_forms_laws_and_observers_show_their_equations():
    form = controller_form(ARM)
    assert "  z1 = 51*theta/1000" in repr(form).splitlines()
    assert repr(form).splitlines()[-1].startswith("  z3' = ")
    law = state_feedback(form, Poles(-5, -6, -7))
    assert [line.split(" = ")[0] for line in repr(law).splitlines()[1:]] == ["  u"]
    assert "  γ3 = -10*y" in repr(observer_form(ARM)).splitlines()
    assert "  theta_hat' = omega_hat - 20*theta_hat + 20*y" in repr(
        exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    )


def test_an_analysis_shows_one_line_per_question():
    shown = repr(analyse(model("duffing"))).splitlines()
    assert [line.split()[:2] for line in shown if "relative_degree " in line] == [["relative_degree", "proved"]]


def test_long_formulas_are_cut_with_their_length():
    x = sp.Symbol("x", real=True)
    long = sp.Add(*(x**k for k in range(200)))
    shown = listing("long", [("y", long), ("z", x)])
    assert len(shown) < 300
    assert f"… ({len(str(long))} characters)" in shown
    assert shown.endswith("  z = x")
