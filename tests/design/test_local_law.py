"""Laws and observers on the linearisation: gains against python-control, modes that nothing moves, loops."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from ulna.base import DesignError, UlnaWarning
from ulna.design import (
    Bandwidth,
    KalmanNoise,
    LinearQuadratic,
    Method,
    SetPoint,
    Track,
    close_loop,
    compensator,
    controller_for,
    local_law,
    local_observer,
)
from ulna.plants import model
from ulna.sim import simulate
from ulna.system import System, linearise, system_from_mapping

control = pytest.importorskip("control")

CART = model("cart_pole")
UNDERACTUATED = ("cart_pole", "acrobot", "furuta_pendulum", "ball_and_beam", "rtac", "inertia_wheel_pendulum")
SEVERAL_INPUTS = ("pvtol", "planar_quadrotor", "quadruple_tank", "overhead_crane", "two_link_arm")


def numbers(matrix) -> np.ndarray:
    return np.array(matrix, dtype=float).reshape(matrix.shape)


def slopes(plant: System) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    found = linearise(plant.with_values())
    return numbers(found.A.evalf()), numbers(found.B.evalf()), numbers(found.C.evalf())


@pytest.mark.parametrize("name", UNDERACTUATED + SEVERAL_INPUTS)
def test_weights_give_the_gains_of_lqr(name):
    A, B, _ = slopes(model(name))
    states, inputs = 1.0 + np.arange(len(A)), 0.5 + np.arange(B.shape[1])
    law = local_law(model(name), LinearQuadratic(state_weights=states, input_weight=inputs))
    wanted, _, poles = control.lqr(A, B, np.diag(states), np.diag(inputs))
    assert numbers(law.gains) == pytest.approx(wanted, rel=1e-7, abs=1e-9)
    assert sorted(p.real for p in law.poles) == pytest.approx(sorted(poles.real), rel=1e-6)


@pytest.mark.parametrize("name", UNDERACTUATED)
def test_poles_give_the_gains_of_place(name):
    A, B, _ = slopes(model(name))
    poles = [-1.0 - 0.7 * k for k in range(len(A))]
    law = local_law(model(name), poles)
    assert numbers(law.gains) == pytest.approx(control.place(A, B, poles), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", SEVERAL_INPUTS)
@pytest.mark.parametrize("repeated", [False, True])
def test_poles_of_several_inputs_are_placed_repeated_ones_too(name, repeated):
    A, B, _ = slopes(model(name))
    poles = [-2.0] * len(A) if repeated else [-1.0 - 0.5 * k for k in range(len(A))]
    law = local_law(model(name), poles)
    closed = np.poly(A - B @ numbers(law.gains))
    assert closed == pytest.approx(np.poly(poles), rel=1e-5, abs=1e-5)


def test_a_repeated_pole_of_one_input_is_exact():
    law = local_law(CART, [-2, -2, -2, -2])
    assert law.polynomials == ((16, 32, 24, 8),)


def test_noise_gives_the_gain_of_lqe():
    A, _, C = slopes(CART)
    observer = local_observer(CART, KalmanNoise(process=[1, 2, 3, 4], measurement=[0.5]))
    wanted, _, poles = control.lqe(A, np.eye(4), C, np.diag([1.0, 2.0, 3.0, 4.0]), [[0.5]])
    assert numbers(observer.gains.subs(dict.fromkeys(observer.gains.free_symbols, 0))) == pytest.approx(
        wanted, rel=1e-7
    )
    assert sorted(p.real for p in observer.poles) == pytest.approx(sorted(poles.real), rel=1e-6)


def test_a_bandwidth_mirrors_slow_modes_and_hangs_on_no_unit():
    A, _, _ = slopes(CART)
    law = local_law(CART, Bandwidth(3.0))
    rate = max(np.linalg.eigvals(A).real)
    assert sorted(p.real for p in law.poles) == pytest.approx([-rate - 3, -rate, -3, -3], abs=5e-3)
    scaled = system_from_mapping({"states": {"x": "1000*v", "v": "u/1000"}, "inputs": {"u": {}}})
    plain = system_from_mapping({"states": {"x": "v", "v": "u"}, "inputs": {"u": {}}})
    one, other = (numbers(local_law(p, Bandwidth(2.0)).gains) for p in (plain, scaled))
    assert one == pytest.approx(np.array([[4.0, 4.0]]))
    assert other == pytest.approx(np.array([[4.0, 4000.0]]))


def test_a_mode_that_nothing_moves_or_shows_is_named():
    rates = {"x": "-x + u", "y": "2*y + x**2", "z": "-3*z + y**2"}
    stuck = system_from_mapping({"states": rates, "inputs": {"u": {}}, "outputs": {"x": "x"}})
    with pytest.raises(DesignError, match=r"no input moves the mode 2 1/s \(in y\)"):
        local_law(stuck, [-1, -2, -3])
    with pytest.raises(DesignError, match=r"no output shows the mode 2 1/s \(in y\)"):
        local_observer(stuck, [-1, -2, -3])
    calm = system_from_mapping({"states": rates | {"y": "-2*y + x**2"}, "inputs": {"u": {}}})
    with pytest.warns(UlnaWarning, match=r"-2 1/s \(in y\); -3 1/s \(in z\) cannot be moved"):
        law = local_law(calm, [-5])
    assert sorted(p.real for p in law.poles) == pytest.approx([-5, -3, -2])
    with pytest.raises(DesignError, match="3 given, 1 needed"):
        local_law(calm, [-1, -2, -3])


def test_what_a_local_law_cannot_do_is_said():
    with pytest.raises(DesignError, match="leave the mode 0 1/s"):
        local_law(CART, LinearQuadratic(state_weights=[0, 0, 1, 1]))
    with pytest.raises(DesignError, match=r"cannot follow Track\(\)"):
        local_law(CART, [-1, -2, -3, -4], reference=Track())
    moving = system_from_mapping({"states": {"x": "1", "y": "u"}, "inputs": {"u": {}}})
    with pytest.raises(DesignError, match="does not rest"):
        local_law(moving, [-1, -2])
    kink = system_from_mapping({"states": {"x": "sign(x) + u"}, "inputs": {"u": {}}})
    with pytest.raises(DesignError, match="a slope has no value at the point"):
        local_law(kink, [-1])
    unset = system_from_mapping({"states": {"x": "v", "v": "u"}, "inputs": {"u": {}}, "outputs": {"v": "v"}})
    with pytest.raises(DesignError, match="constant inputs set none of the outputs v"):
        local_law(unset, [-1, -2, -3], integral=True)
    loose = system_from_mapping({"states": {"x": "-k*x + u"}, "inputs": {"u": {}}, "parameters": {"k": {}}})
    with pytest.raises(DesignError, match="no value is given for k"):
        local_law(loose, [-1])


@pytest.mark.parametrize("name", ["cart_pole", "furuta_pendulum", "ball_and_beam", "acrobot"])
def test_the_loop_of_a_nonlinear_plant_and_its_local_compensator_settles(name):
    plant = model(name).with_values()
    made = controller_for(plant, law=Bandwidth(3.0), observer=Bandwidth(6.0), method=Method.LOCAL)
    start = np.zeros(8)
    start[0] = 0.001
    run = simulate(close_loop(plant, made), start, np.linspace(0.0, 20.0, 101))
    assert np.abs(run.states[-1]).max() < 1e-5


def test_integral_action_holds_the_output_itself_under_a_constant_push():
    rates = {"x": "v", "v": "-sin(x) + u + d"}
    plant = system_from_mapping({"states": rates, "inputs": {"u": {}, "d": {}}, "outputs": {"y": "x + x**3"}})
    designed = system_from_mapping(
        {"states": rates | {"v": "-sin(x) + u"}, "inputs": {"u": {}}, "outputs": {"y": "x + x**3"}}
    )
    law = local_law(designed, [-1, -2, -3], reference=SetPoint(), integral=True)
    run = simulate(close_loop(plant, law), [0, 0, 0], np.linspace(0, 30, 61), inputs={"y_ref": 0.5, "d": 0.3})
    assert run["y"][-1] == pytest.approx(0.5, abs=1e-8)


def test_a_set_point_moves_the_cart_and_a_plant_need_not_be_affine():
    law = local_law(CART, [-2, -2.5, -3, -3.5], reference=SetPoint())
    run = simulate(close_loop(CART.with_values(), law), [0, 0, 0, 0], np.linspace(0, 20, 41), inputs={"y_ref": 0.2})
    assert run["y"][-1] == pytest.approx(0.2, abs=1e-9)
    square = system_from_mapping(
        {"states": {"x": "-x + u**2"}, "inputs": {"u": {}}, "outputs": {"x": "x"}, "operating_point": {"x": 4, "u": 2}}
    )
    both = compensator(local_law(square, [-3]), local_observer(square, [-9]))
    run = simulate(close_loop(square, both), [4.2, 4.0], np.linspace(0, 10, 41))
    assert run["x"][-1] == pytest.approx(4.0, abs=1e-9)


def test_one_output_of_two_is_held_by_one_input():
    plant = system_from_mapping(
        {
            "states": {"x": "v", "v": "u", "th": "w", "w": "sin(th) - u*cos(th)"},
            "inputs": {"u": {}},
            "outputs": {"th": "th", "x": "x"},
        }
    )
    law = local_law(plant, [-1, -1.5, -2, -2.5], reference=SetPoint())
    assert [s.name for s in law.system.inputs] == ["x", "v", "th", "w", "x_ref"]


def test_a_law_is_honest_about_where_it_holds():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        law = controller_for(model("magnetic_levitation"), law=[-50, -60, -70], method=Method.LOCAL).law
    assert law is not None
    assert law.method == "local, on the linearisation at x = 1/100, i = 1"
    assert repr(law).startswith("Law of")
    assert "local, on the linearisation" in repr(law)
