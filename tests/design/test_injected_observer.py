"""The exact observer split for the exact hold: linear part, what is injected, where it starts."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import ulna
from ulna.design import Poles, exact_observer, injected_observer, observer_form
from ulna.loop import ExactHold, Hardware, Loop, Parts, RungeKutta4, joined
from ulna.sim import FixedSteps, simulate
from ulna.symbolic.exact import are_zero
from ulna.system import LinearInjection, System

ARM = ulna.model("one_link_arm").with_values()
FORM = observer_form(ARM)
POLES = Poles(-9, -10, -11)


def test_the_parts_add_up_to_the_observer_and_have_the_poles_asked_for() -> None:
    parts = injected_observer(FORM, POLES).sampled
    assert isinstance(parts, LinearInjection)
    assert parts is not None
    z = sp.Matrix(parts.system.state_symbols)
    whole = parts.matrix * z + sp.Matrix(parts.injection)
    assert are_zero([a - b for a, b in zip(whole, parts.system.rates, strict=True)]).holds
    assert sp.roots(sp.Matrix(parts.matrix).charpoly().as_expr()) == {-9: 1, -10: 1, -11: 1}


def test_it_starts_where_the_estimates_are_wanted() -> None:
    parts = injected_observer(FORM, POLES).sampled
    assert isinstance(parts, LinearInjection)
    assert parts is not None
    hats = [sp.Symbol(f"{s.name}_hat", real=True) for s in ARM.states]
    begun = dict(zip(parts.system.state_symbols, parts.start, strict=True))
    shown = [readout.xreplace(begun) for readout in parts.system.readouts]
    assert are_zero([a - b for a, b in zip(shown, hats, strict=True)]).holds


IDLE = ulna.system_from_mapping(
    {"name": "idle", "states": {"n": "0"}, "inputs": {"theta": {}}, "outputs": {"u": "0*theta"}}
)


def _error(estimator: System | LinearInjection, discretisation: ExactHold | RungeKutta4, period: float) -> float:
    """Largest error of the estimated speed against the observer in continuous time; the arm swings freely."""
    observer = exact_observer(FORM, POLES)
    seen = estimator.system if isinstance(estimator, LinearInjection) else estimator
    parts = Parts(system=joined(IDLE, seen, name="whole"), law=IDLE, observer=estimator)
    chip = Hardware(period=period, discretisation=discretisation)
    loop = Loop(plant=ARM, controller=parts, hardware=chip)
    start = [1.0, 0.0, 0.0]
    names = dict(zip((s.name for s in ARM.states), start, strict=True))
    run = simulate(loop, {**names, "theta_hat": 0.5}, 1.0, engine=FixedSteps(number=4))
    both = {"arm": ARM, "observer": observer.system}
    whole = ulna.connect(both, {"observer.y": "arm.y"}, outputs=["arm.y"], name="both")
    fine = simulate(whole, [*start, 0.5, 0.0, 0.0], run.times)
    return float(np.abs(run["omega_hat"] - fine["omega_hat"]).max())


def test_the_exact_hold_of_it_is_of_second_order_and_far_better_than_holding_the_older_sample() -> None:
    parts = injected_observer(FORM, POLES).sampled
    assert isinstance(parts, LinearInjection)
    assert parts is not None
    coarse, fine = (_error(parts, ExactHold(), period) for period in (0.02, 0.01))
    assert coarse / fine == pytest.approx(4.0, rel=0.15)
    held = _error(parts, ExactHold(interpolate=False), 0.01)
    assert held > 50 * fine
