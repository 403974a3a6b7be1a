"""Approximate input-output linearisation: the ball and beam as in its paper, and what it must refuse."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from ulna.base import NoFormError, UlnaWarning
from ulna.design import Method, approximate_form, close_loop, controller_for
from ulna.plants import model
from ulna.sim import simulate

BALL = model("ball_and_beam")


def test_the_ball_and_beam_is_that_of_the_paper():
    # Hauser, Sastry, Kokotović 1992, approximation by the input field: equations of section IV.
    form = approximate_form(BALL)
    x1, x2, x3, x4, B, G = sp.symbols("x1:5 B G", real=True)
    assert form.indices == (4,)
    assert sp.simplify(form.chain[3] - (B * x2 * x4**2 - B * G * x4 * sp.cos(x3))) == 0
    assert sp.simplify(form.beta[0] - (2 * B * x2 * x4 - B * G * sp.cos(x3))) == 0
    assert sp.simplify(form.alpha[0] - (B**2 * x1 * x4**4 + B * (1 - B) * G * x4**2 * sp.sin(x3))) == 0
    assert form.verdict.fails
    assert form.verdict.evidence["dropped"] == ("2*B*u*x1*x4 in derivative 3 of y",)


def test_its_loop_settles_and_the_outputs_law_gives_way_to_it():
    with pytest.warns(UlnaWarning, match="divides by zero at the operating point: this one is approximate"):
        made = controller_for(BALL.with_values(), law=[-1, -2, -3, -4], method=Method.INPUT_OUTPUT)
    run = simulate(close_loop(BALL.with_values(), made), [0.3, 0, 0.1, 0], np.linspace(0, 20, 41))
    assert np.abs(run.states[-1]).max() < 1e-5


def test_without_options_the_ball_and_beam_gets_it():
    made = controller_for(BALL)
    assert made.law is not None
    assert made.law.method.startswith("approximate input-output, dropping 2*B*u*x1*x4")
    assert "divides by zero" in made.passed["input-output"]


def test_a_regular_plant_has_nothing_to_drop():
    with pytest.raises(NoFormError, match="nothing has to be dropped"):
        approximate_form(model("duffing"))
    with pytest.raises(NoFormError, match="2 outputs and 2 inputs"):
        approximate_form(model("pvtol"))
