"""No step crosses a branch point unseen: the run rests there, goes on, or ends at the exact instant with its name."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

from ulna.base import SimulationError
from ulna.program import branches_of, edges_of, to_python, with_branches, with_modes
from ulna.sim import TIME, Ends, EventKind, Held, Outcome, Trajectory, simulate
from ulna.symbolic.compiling import kernel
from ulna.system import Parameter, Signal, System

x, v, u, p = sp.symbols("x v u p", real=True)
GRIDS = (5.0, np.linspace(0.0, 5.0, 11), np.linspace(0.0, 5.0, 778))


def plant(*rates: object, inputs: str = "", parameters: str = "") -> System:
    return System(
        name="plant",
        states=tuple(Signal(name=name) for name in "xv"[: len(rates)]),
        rates=tuple(map(sp.sympify, rates)),
        inputs=tuple(Signal(name=name) for name in inputs.split()),
        outputs=(Signal(name="y"),),
        readouts=(sp.sqrt(x),),
        parameters=tuple(Parameter(name=name) for name in parameters.split()),
    )


def edge(run: Trajectory) -> tuple[float, str]:
    (found,) = [event for event in run.events if event.kind is EventKind.AT_EDGE]
    return found.time, found.signal


@pytest.mark.parametrize(
    ("rate", "start", "rests", "at", "name"),
    [
        (-sp.sqrt(x), 1.0, 0.0, 2.0, "the root of x reaches 0"),
        (-sp.sqrt(sp.Abs(x)), 1.0, 0.0, 2.0, "the root of abs(x) reaches 0"),
        (sp.sqrt(1 - x), 0.0, 1.0, 2.0, "the root of 1 - x reaches 0"),
        (sp.sqrt(1 - x**2), 0.0, 1.0, math.pi / 2, "the root of 1 - x^2 reaches 0"),
        (-3 * sp.cbrt(x), 1.0, 0.0, 0.5, "the power of x reaches 0"),
        (-3 * x ** sp.Rational(2, 3), 1.0, 0.0, 1.0, "the power of x reaches 0"),
        (-sp.acos(x) * sp.sqrt(1 - x**2), -0.5, None, None, ""),
    ],
    ids=str,
)
def test_a_root_that_reaches_zero_rests_there_where_the_field_does(
    rate: sp.Expr, start: float, rests: float | None, at: float | None, name: str
) -> None:
    for times in GRIDS:
        run = simulate(plant(rate), [start], times)
        if at is None:
            continue
        time, found = edge(run)
        assert found == name
        assert time == pytest.approx(at, abs=1e-10)
        assert run.final_state[0] == rests
        assert run.states.max() <= max(start, rests or 0.0)


@pytest.mark.parametrize(
    ("rates", "start", "at", "name"),
    [
        ((-1 - sp.sqrt(x),), (1.0,), 2.0 - 2.0 * math.log(2.0), "the root of x reaches 0"),
        ((-1, sp.log(x)), (1.0, 0.0), 1.0, "the logarithm of x reaches 0"),
        ((-1 / x,), (1.0,), 0.5, "the denominator x reaches 0"),
        ((-1, sp.asin(x)), (0.5, 0.0), 1.5, "the arc sine of x meets ±1"),
        ((1, sp.tan(x)), (0.0, 0.0), math.pi / 2, "the tangent of x meets an odd multiple of π/2"),
    ],
    ids=str,
)
def test_a_field_that_leads_outside_ends_the_run_with_a_name(
    rates: tuple[sp.Expr, ...], start: tuple[float, ...], at: float, name: str
) -> None:
    ends = []
    for times in GRIDS:
        run = simulate(plant(*rates), start, times, throw=False)
        assert run.outcome is Outcome.EDGE
        assert edge(run)[1] == name
        ends.append(run.times[-1])
    np.testing.assert_allclose(ends, at, rtol=0, atol=1e-9)
    with pytest.raises(SimulationError, match=f"at {at:.6g} s {name[:8]}"):
        simulate(plant(*rates), start, 5.0)


@pytest.mark.parametrize(
    ("rates", "start", "last"),
    [
        ((1, sp.sqrt(x**2)), (-1.0, 0.0), 0.5 + 8.0),
        ((-1, sp.sqrt(sp.Abs(x))), (1.0, 0.0), 2 / 3 + 16 / 3),
        ((1, sp.asin(sp.sin(x))), (0.0, 0.0), math.pi**2 / 8 + ((5 - 2 * math.pi) ** 2 - math.pi**2 / 4) / 2),
        ((1, sp.sin(x) / x), (-1.0, 0.0), float(sp.Si(1) + sp.Si(4))),
        ((1, sp.atan2(sp.sin(x), sp.cos(x))), (0.0, 0.0), ((5 - 2 * math.pi) ** 2) / 2),
    ],
    ids=str,
)
def test_a_field_that_goes_on_beyond_is_followed(
    rates: tuple[sp.Expr, ...], start: tuple[float, ...], last: float
) -> None:
    for times in GRIDS:
        assert simulate(plant(*rates), start, times).final_state[1] == pytest.approx(last, abs=1e-9)


def test_a_weak_singularity_is_not_stepped_over() -> None:
    runs = [simulate(plant(-1 + x * sp.log(x)), [1.0], times, throw=False) for times in GRIDS]
    assert {edge(run) for run in runs} == {(runs[0].times[-1], "the logarithm of x reaches 0")}
    assert all(abs(run.final_state[0]) < 1e-13 for run in runs)


def test_an_angle_is_not_cut_while_its_side_is_kept() -> None:
    moded = with_modes(kernel("angle", (x, v), {"a": sp.atan2(x, v)}))
    assert moded.guards == 1
    evaluate = to_python(moded.kernel)
    for side in (1.0, -1.0):
        for y, x_ in ((0.3, 0.4), (0.3, -0.4), (1e-9, -1.0)):
            assert evaluate(side * y, x_, side)[0] == pytest.approx(math.atan2(side * y, x_), abs=1e-15)
        assert evaluate(-side * 1e-12, -1.0, side)[0] == pytest.approx(side * (math.pi + 1e-12), abs=1e-15)


def test_an_empty_tank_fills_when_something_flows_in() -> None:
    tank = plant(u - sp.sqrt(x), inputs="u")
    pump = Held.known(times=np.array([0.0, 4.0]), values=np.array([0.0, 1.0]))
    run = simulate(tank, [1.0], np.linspace(0.0, 10.0, 11), inputs={"u": pump})
    root = math.sqrt(run.final_state[0])
    # t − 4 = −2 r − 2 log(1 − r) of r = √h.
    assert -2 * root - 2 * math.log(1 - root) == pytest.approx(6.0, abs=1e-8)
    assert not run.states[2:5].any()
    assert np.isfinite(run.outputs).all()
    ramp = simulate(tank, [1.0], np.linspace(0.0, 10.0, 11), inputs={"u": sp.Max(0, TIME - 4)})
    assert ramp.final_state[0] == pytest.approx(9.0, abs=1e-8)
    drained = simulate(tank, [1.0], 10.0, inputs={"u": -0.1}, throw=False)
    assert drained.outcome is Outcome.EDGE


def test_a_start_outside_the_domain_is_named() -> None:
    run = simulate(plant(-sp.sqrt(x)), [-1.0], 5.0, throw=False)
    assert (run.outcome, edge(run)) == (Outcome.EDGE, (0.0, "the root of x is not defined"))


def test_an_exponent_may_be_known_at_run_time_only() -> None:
    # Of an exponent that is not known what changes sign is watched beside what only touches zero, to half the digits.
    for exponent, at in ((0.5, 2.0), (1 / 3, 1.5), (2 / 3, 3.0)):
        run = simulate(plant(-(x**p), parameters="p"), [1.0], 5.0, parameters={"p": exponent})
        assert edge(run)[0] == pytest.approx(at, abs=1e-6)
        assert run.final_state[0] == 0.0


def test_many_runs_see_branch_points_too() -> None:
    runs = simulate(plant(-sp.sqrt(x)), [[1.0], [4.0], [100.0]], 5.0, record=Ends())
    np.testing.assert_allclose(runs.final_state[:, 0], [0.0, 0.0, 56.25], rtol=0, atol=1e-9)
    outside = simulate(plant(-1 - sp.sqrt(x)), [[1.0], [100.0]], 5.0, record=Ends())
    assert [outside.outcome(k) for k in range(2)] == [Outcome.EDGE, Outcome.FINISHED]


def test_branches_rest_at_their_edge_and_smooth_fields_have_none() -> None:
    smooth = kernel("smooth", (x, v, p), {"a": sp.sin(x) / (2 + sp.cos(v)) + sp.sqrt(p), "b": x**3 * sp.exp(v)})
    assert not branches_of(smooth, ("p",))
    assert edges_of(smooth, ("p",)).names == ("the denominator 2 + cos(v) reaches 0",)
    rough = kernel("rough", (x, v, p), {"a": sp.sqrt(p * x) + sp.asin(v), "b": x ** sp.Rational(-1, 3)})
    branched = with_branches(rough, ("p",))
    assert len(branched.branches) == 2
    evaluate = to_python(branched.kernel)
    assert evaluate(4.0, -0.5, 1.0, 0.0, 0.0)[0] == 2.0 + math.asin(-0.5)
    assert evaluate(4.0, -0.5, 1.0, 1.0, 1.0)[0] == -math.pi / 2
