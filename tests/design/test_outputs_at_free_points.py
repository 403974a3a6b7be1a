"""An operating point that depends on free parameters never makes an answer worse than none: outputs in closed form."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import pytest
import sympy as sp

from ulna.base import Verdict
from ulna.design.forms import output_search
from ulna.design.forms.output_search import linearising_outputs
from ulna.geometry import integrate
from ulna.system import system_from_mapping

PLANTS = {
    "square law under PI control": (
        (
            "parameters = {Kp = {value=1}, Ki = {value=2}}\n"
            'states = {x = "-x**2 + Kp*(r - x) + Ki*q", q = "r - x"}\n'
            "inputs = {r = {}}\noperating_point = {r = 1}"
        ),
        "Kp*q - x",
    ),
    "two tanks filled at once": (
        (
            "parameters = {a = {value=1}, b = {value=2}, d = {value=3}, c = {value=1}}\n"
            'states = {x = "-a*x**2 + b*u", z = "-c*z + d*u"}\n'
            "inputs = {u = {}}\noperating_point = {u = 1}"
        ),
        "d*x - b*z",
    ),
    "cubic spring seen through an integrator": (
        (
            "parameters = {k = {value=2}, b = {value=3}}\n"
            'states = {x = "-k*x**3 + w + b*u", w = "x - u"}\n'
            "inputs = {u = {}}\noperating_point = {u = 1}"
        ),
        "x + b*w",
    ),
    "exchange at a rate that grows": (
        (
            "parameters = {a = {value=1}, b = {value=2}}\n"
            'states = {x = "-a*x + x*u", y = "y**2 - b*y*u"}\n'
            "inputs = {u = {}}\noperating_point = {x = 1}"
        ),
        "x**b*y",
    ),
}


@pytest.mark.parametrize("name", PLANTS)
def test_a_free_point_hides_no_output(name: str) -> None:
    text, expected = PLANTS[name]
    found = linearising_outputs(system_from_mapping(tomllib.loads(text)))
    assert found.functions is not None
    assert found.verdict.holds
    wanted = sp.sympify(expected, locals={s.name: s for s in found.functions[0].free_symbols})
    x = found.linearisability.accessibility.view.x
    slopes = sp.Matrix([[h.diff(c) for c in x] for h in (found.functions[0], wanted)])
    assert sp.simplify(slopes.det()) == 0  # one is a function of the other


@pytest.mark.parametrize(("tried", "said"), [("out of time after 4 s", True), ("closed", False)])
def test_a_search_given_up_for_lack_of_time_says_so(monkeypatch: pytest.MonkeyPatch, tried: str, said: bool) -> None:
    def nothing(*arguments: Any, **keywords: Any) -> Any:
        verdict = Verdict.undecided("an integral is known", tried=(tried,))
        return replace(integrate(*arguments, **keywords), value=None, verdict=verdict)

    output_search._linearising_outputs.cache_clear()
    monkeypatch.setattr(output_search, "integrate", nothing)
    text = PLANTS["square law under PI control"][0].replace("Kp = {", "Kx = {value=3}, Kp = {")
    found = linearising_outputs(system_from_mapping(tomllib.loads(text)))
    assert found.functions is None
    assert ("out of time" in found.verdict.evidence.get("reason", "")) == said
