"""The contract of every kind of observer, as axioms over all kinds and several plants; and what must break each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import pytest
import sympy as sp

from ulna.design import (
    KalmanNoise,
    Observer,
    Poles,
    exact_observer,
    extended_kalman_filter,
    extended_state_observer,
    high_gain_observer,
    injected_observer,
    observer_form,
    transformed_observer_form,
    with_disturbance,
)
from ulna.plants import model
from ulna.symbolic.exact import are_zero
from ulna.system import LinearInjection, System, control_affine, system_from_mapping


def plant(states: dict[str, str], outputs: dict[str, str], inputs: str = "", **rest: float) -> System:
    sections = {"inputs": {u: {} for u in inputs.split()}, "operating_point": rest}
    return system_from_mapping({"name": "plant", "states": states, "outputs": outputs} | sections)


ARM = model("one_link_arm").with_values()
SINE = plant({"x1": "x2", "x2": "-sin(x1) + u"}, {"y": "x1"}, "u")
LOTKA_VOLTERRA = plant({"x1": "x1*(1 - x2)", "x2": "x2*(-1 + x1)"}, {"y": "x1"}, x1=1, x2=1)
TWO_BLOCKS = plant({"x1": "x2", "x2": "-x1*x3 + u", "x3": "sin(x1) - x3"}, {"y1": "x1", "y2": "x3"}, "u")
# Three integrators in a row, seen in bent coordinates: x2 = z2 + z1**2, x3 = z3 + z1*z2.
BENT = plant(
    {"x1": "x2 - x1**2", "x2": "x3 + x1*(x2 - x1**2)", "x3": "u + (x2 - x1**2)**2 + x1*(x3 - x1*(x2 - x1**2))"},
    {"y": "x1"},
    "u",
)
# The output has a state's name without being that state.
CUBE = plant({"x1": "x2", "x2": "u"}, {"x2": "x1 + x1**3"}, "u")
NO_FORM = plant({"x1": "x2", "x2": "x2**3 - x1 + u"}, {"y": "x1"}, "u")
LOADED = with_disturbance(SINE, {"x2": 1})


@dataclass(frozen=True, kw_only=True)
class Case:
    """An observer, and the poles its error must have at rest; none where they are not asked for."""

    make: Callable[[], Observer]
    rest: dict[str, Any]
    poles: tuple[float, ...] = ()


def _in_form(make: Callable[..., Observer], system: System, *poles: float, **rest: Any) -> Case:
    return Case(make=lambda: make(transformed_observer_form(system), Poles(*poles)), rest=rest, poles=poles)


LEVEL = {"theta": sp.pi / 2, "omega": 0, "i": 0, "u": 0}
CASES = {
    "exact, arm": _in_form(exact_observer, ARM, -9, -10, -11, **LEVEL),
    "exact, sine": _in_form(exact_observer, SINE, -3, -5, x1=sp.pi / 6, x2=0, u=sp.Rational(1, 2)),
    "exact, Lotka-Volterra": _in_form(exact_observer, LOTKA_VOLTERRA, -2, -3, x1=1, x2=1),
    "exact, two blocks": _in_form(exact_observer, TWO_BLOCKS, -2, -3, -7, x1=0, x2=0, x3=0, u=0),
    "in z, arm": _in_form(injected_observer, ARM, -9, -10, -11, **LEVEL),
    "in z, Lotka-Volterra": _in_form(injected_observer, LOTKA_VOLTERRA, -2, -3, x1=1, x2=1),
    "in z, two blocks": _in_form(injected_observer, TWO_BLOCKS, -2, -3, -7, x1=0, x2=0, x3=0, u=0),
    "high gain, bent chain": Case(
        make=lambda: high_gain_observer(BENT, Poles(-1, -2, -3), time_scale="1/10"),
        rest={"x1": 2, "x2": 4, "x3": 0, "u": 0},
        poles=(-10, -20, -30),
    ),
    "high gain, cube": Case(
        make=lambda: high_gain_observer(CUBE, Poles(-1, -2), time_scale="1/5"),
        rest={"x1": 3, "x2": 0, "u": 0},
        poles=(-5, -10),
    ),
    "high gain, no form": Case(make=lambda: high_gain_observer(NO_FORM, Poles(-1, -2)), rest={}),
    "high gain, two blocks": Case(make=lambda: high_gain_observer(TWO_BLOCKS, Poles(-1, -2, -3)), rest={}),
    "Kalman, arm": Case(make=lambda: extended_kalman_filter(ARM), rest={}),
    "Kalman, two blocks": Case(
        make=lambda: extended_kalman_filter(TWO_BLOCKS, KalmanNoise(measurement=[2, 3])), rest={}
    ),
    "Kalman, cube": Case(make=lambda: extended_kalman_filter(CUBE), rest={}),
    "disturbance, sine": Case(
        make=lambda: extended_state_observer(LOADED, Poles(-4, -5, -6)),
        rest={"x1": sp.pi / 6, "x2": 0, "disturbance": sp.Rational(1, 2), "u": 0},
        poles=(-4, -5, -6),
    ),
}
ALL = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
WITH_POLES = pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.poles])


def real(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


def estimates(observer: Observer) -> sp.Matrix:
    return sp.Matrix(observer.system.inline(observer.system.readouts))


def measured(observer: Observer) -> list[sp.Symbol]:
    """The symbols of the plant's outputs among the observer's inputs."""
    return list(observer.system.input_symbols)[len(observer.plant.inputs) :]


def estimate_rates(observer: Observer) -> sp.Matrix:
    """x̂' along the observer's own motion."""
    rates = sp.Matrix(observer.system.inline(observer.system.rates))
    return estimates(observer).jacobian(list(observer.system.state_symbols)) * rates


def copies_the_plant(observer: Observer) -> bool:
    """Whether x̂' = f(x̂) + g(x̂) u where y = h(x̂)."""
    view = control_affine(observer.plant)
    onto = dict(zip(view.x, estimates(observer), strict=True))
    field = (view.f + view.g * sp.Matrix(len(view.u), 1, list(view.u))).xreplace(onto)
    silent = dict(zip(measured(observer), view.h.xreplace(onto), strict=True))
    return are_zero([a - b for a, b in zip(estimate_rates(observer).xreplace(silent), field, strict=True)]).holds


def error_poles(observer: Observer, rest: dict[str, Any]) -> set[sp.Expr]:
    """The poles of the estimator, linearised where the plant rests and its states are known."""
    point = {real(name): sp.sympify(value) for name, value in rest.items()}
    view = control_affine(observer.plant)
    field = view.f + view.g * sp.Matrix(len(view.u), 1, list(view.u))
    assert all(sp.simplify(rate.subs(point)) == 0 for rate in field), "the plant does not rest there"
    known = {real(f"{x.name}_hat"): point[x] for x in view.x}
    start = (
        [e.subs(known) for e in observer.sampled.start]
        if isinstance(observer.sampled, LinearInjection)
        else list(known.values())
    )
    there = dict(zip(observer.system.state_symbols, start, strict=True)) | {u: point[u] for u in view.u}
    there |= dict(zip(measured(observer), (h.subs(point) for h in view.h), strict=True))
    rates = sp.Matrix(observer.system.inline(observer.system.rates))
    slopes = rates.jacobian(list(observer.system.state_symbols)).subs(there).applyfunc(sp.nsimplify)
    s = sp.Symbol("s")
    roots = sp.roots(slopes.charpoly(s).as_expr(), s)
    return {sp.nsimplify(root) for root, count in roots.items() for _ in range(count)}


def enters_as_minus_gains_times_innovation(observer: Observer) -> bool:
    """Whether x̂' changes by −L (ŷ − y) + O((ŷ − y)²): the slope of x̂' along y = h(x̂) + s e_j at s = 0 is L_j."""
    view = control_affine(observer.plant)
    shown = view.h.xreplace(dict(zip(view.x, estimates(observer), strict=True)))
    s = sp.Symbol("s", real=True)
    residuals = []
    for j, y in enumerate(measured(observer)):
        moved = dict(zip(measured(observer), shown, strict=True)) | {y: shown[j] + s}
        slope = estimate_rates(observer).xreplace(moved).diff(s).subs(s, 0)
        residuals += list(slope - observer.gains[:, j])
    return are_zero(residuals).holds


def with_one_gain_turned(observer: Observer, row: int) -> Observer:
    """The same observer with one entry of L of the wrong sign: −L_row (ŷ − y) becomes + L_row (ŷ − y)."""
    view = control_affine(observer.plant)
    shown = view.h.xreplace(dict(zip(view.x, estimates(observer), strict=True)))
    turn = sp.zeros(len(view.x), 1)
    turn[row] = 2 * (observer.gains * (sp.Matrix(shown) - sp.Matrix(measured(observer))))[row]
    slopes = estimates(observer).jacobian(list(observer.system.state_symbols))
    rates = sp.Matrix(observer.system.rates) + slopes.inv() * turn
    return replace(observer, system=replace(observer.system, rates=tuple(rates)))


@ALL
def test_inputs_are_those_of_the_plant_then_its_outputs_and_outputs_are_estimates_in_order(case: Case) -> None:
    observer = case.make()
    names = [s.name for s in observer.system.inputs]
    assert names[: len(observer.plant.inputs)] == [s.name for s in observer.plant.inputs]
    given = [name.removesuffix("_measured") for name in names[len(observer.plant.inputs) :]]
    assert given == [s.name for s in observer.plant.outputs]
    assert [s.name for s in observer.system.outputs] == [f"{s.name}_hat" for s in observer.plant.states]
    assert set(observer.initial) <= {s.name for s in observer.system.states}


@ALL
def test_without_innovation_the_estimates_move_as_the_plant_does(case: Case) -> None:
    observer = case.make()
    assert copies_the_plant(observer)
    first, *others = observer.system.rates
    wrong = replace(observer.system, rates=(first + observer.system.state_symbols[-1] ** 2, *others))
    assert not copies_the_plant(replace(observer, system=wrong))


@ALL
def test_gains_say_how_the_innovation_enters(case: Case) -> None:
    observer = case.make()
    assert observer.gains.shape == (len(observer.plant.states), len(observer.plant.outputs))
    assert enters_as_minus_gains_times_innovation(observer)


@WITH_POLES
def test_the_error_has_all_the_poles_asked_for(name: str) -> None:
    case = CASES[name]
    observer = case.make()
    assert error_poles(observer, case.rest) == set(case.poles)
    s = sp.Symbol("s")
    asked = {
        root
        for coefficients in observer.polynomials
        for root in sp.Poly([1, *reversed(coefficients)], s).all_roots(radicals=False)
    }
    assert asked == set(case.poles)


@WITH_POLES
def test_a_gain_of_the_wrong_sign_is_noticed_by_the_poles(name: str) -> None:
    case = CASES[name]
    observer = case.make()
    for row in range(len(observer.plant.states)):
        gain = observer.gains[row, :].subs({real(f"{k}_hat"): v for k, v in case.rest.items()})
        if any(entry != 0 for entry in gain) and not isinstance(observer.sampled, LinearInjection):
            assert error_poles(with_one_gain_turned(observer, row), case.rest) != set(case.poles)


def test_a_third_gain_of_the_wrong_sign_leaves_the_papers_observer_stable_and_is_noticed_all_the_same() -> None:
    observer = exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    turned = error_poles(with_one_gain_turned(observer, 2), LEVEL)
    assert all(sp.re(pole) < 0 for pole in turned)
    assert turned != {-9, -10, -11}


def test_gains_are_the_papers_the_riccati_equations_and_the_scaled_ones() -> None:
    paper = exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    assert [g.subs(real("theta_hat"), 0) for g in paper.gains] == [20, sp.Rational(4049, 51), -100]
    theta = [real(f"cov_theta_{s.name}") for s in ARM.states]
    assert list(extended_kalman_filter(ARM, KalmanNoise(measurement=["1/2"])).gains) == [2 * entry for entry in theta]
    assert list(high_gain_observer(NO_FORM, Poles(-1, -2), time_scale="1/10").gains) == [30, 200]


# The input enters at the level next to those allowed, or, in the last two, at one allowed.
TRIANGULAR = [
    pytest.param({"x1": "x2*(1 + u)", "x2": "-x1"}, "u", id="second derivative in the first"),
    pytest.param({"x1": "x2", "x2": "x3*(1 + u)", "x3": "-x1"}, "u", id="third in the second"),
    pytest.param({"x1": "x2*(1 + u)", "x2": "x3", "x3": "-x1"}, "u", id="second in the first of three"),
    pytest.param({"x1": "x2 + x1*u", "x2": "-x1 + x1*x2*u"}, None, id="triangular"),
    pytest.param({"x1": "x2", "x2": "x3 + x2*u", "x3": "x3*x1*u - x1"}, None, id="triangular of three"),
]


@pytest.mark.parametrize(("states", "early"), TRIANGULAR)
def test_inputs_may_enter_a_derivative_with_lower_ones_only(states: dict[str, str], early: str | None) -> None:
    observer = high_gain_observer(plant(states, {"y": "x1"}, "u"), Poles(*range(-len(states), 0)))
    assert observer.verdict.holds is (early is None)
    assert observer.verdict.evidence.get("input") == early
