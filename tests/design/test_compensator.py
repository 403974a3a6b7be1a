import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError, UlnaWarning
from ulna.design import (
    KalmanNoise,
    LinearQuadratic,
    Poles,
    Regulate,
    SetPoint,
    Track,
    close_loop,
    compensator,
    controller_form,
    exact_observer,
    extended_kalman_filter,
    high_gain_observer,
    input_output_form,
    observer_form,
    state_feedback,
)
from ulna.plants import model
from ulna.sim import TIME, simulate
from ulna.system import equilibrium, linearise, read_system, system_from_mapping, write_system

ARM = model("one_link_arm").with_values()
LAW_POLES = Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8)
theta, omega, i = ARM.state_symbols
R = sp.Rational


def as_set(poles):
    return sorted(np.round(poles, 6), key=lambda p: (p.real, p.imag))


def test_the_papers_law_comes_out_exactly():
    law = state_feedback(controller_form(ARM), LAW_POLES)
    expected = (
        -R("6.528") * theta
        - R("1.448") * omega
        - R("0.2") * i
        - R("21.168") * sp.cos(theta)
        + R("1.764") * omega * sp.sin(theta)
    )
    assert sp.expand(law.expressions[0] - expected) == 0
    assert law.gains == sp.Matrix([[128, 48, 12]])


def test_a_plant_and_a_list_of_poles_are_enough_for_a_law():
    short = state_feedback(ARM, [-2, -3, -4])
    assert short.expressions == state_feedback(controller_form(ARM), Poles(-2, -3, -4)).expressions
    assert short.polynomials == ((24, 26, 9),)


def test_the_loop_has_the_poles_of_law_and_observer_together():
    law = state_feedback(controller_form(ARM), LAW_POLES)
    observer = exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    loop = close_loop(ARM, compensator(law, observer))
    rest = equilibrium(loop, near={})
    assert as_set(linearise(rest).eigenvalues) == as_set([-2 + 12**0.5 * 1j, -2 - 12**0.5 * 1j, -8, -9, -10, -11])
    assert rest["u"] == pytest.approx(-17.64, abs=1e-9)
    assert [s.name for s in loop.system.states][:3] == ["theta", "omega", "i"]


def test_a_set_point_is_an_argument_of_the_compensator():
    law = state_feedback(controller_form(ARM), LAW_POLES, reference=SetPoint())
    loop = close_loop(ARM, compensator(law, exact_observer(observer_form(ARM), Poles(-9, -10, -11))))
    assert [s.name for s in loop.system.inputs] == ["y_ref"]
    for wanted in (-1.2, 0.4, 1.5):
        run = simulate(loop.system, [0.0] * 6, 12.0, inputs={"y_ref": wanted})
        assert run["theta"][-1] == pytest.approx(wanted, abs=1e-6)


def test_a_smooth_reference_is_followed_without_lag():
    law = state_feedback(controller_form(ARM), LAW_POLES, reference=Track())
    loop = close_loop(ARM, law)
    motion = R(1, 2) * sp.sin(2 * TIME)
    inputs = {"y_ref": motion} | {f"y_ref_d{k}": sp.diff(motion, TIME, k) for k in (1, 2, 3)}
    # On the reference from the start: angle, rate, and the current that gives the acceleration there.
    start = [0.0, 1.0, float(-(R(588, 17)) / R(100, 51))]
    run = simulate(loop.system, start, np.linspace(0, 6, 301), inputs=inputs)
    assert run["theta"] == pytest.approx(0.5 * np.sin(2 * run.times), abs=1e-9)


def test_integral_action_removes_the_offset_of_a_wrong_load():
    lighter = model("one_link_arm").with_parameters({"m2": "4.5"}).with_values()
    plain = close_loop(lighter, state_feedback(controller_form(ARM), Poles(-6, -7, -8), reference=SetPoint()))
    gains = Poles(-5, -6, -7, -8)
    law = state_feedback(controller_form(ARM), gains, reference=SetPoint(), integral=True)
    assert law.integral_gains == (5 * 6 * 7 * 8,)
    corrected = close_loop(lighter, law)
    assert abs(equilibrium(plain, near={"i": -15}, inputs={"y_ref": 0.3})["theta"] - 0.3) > 0.01
    assert equilibrium(corrected, near={"i": -15}, inputs={"y_ref": 0.3})["theta"] == pytest.approx(0.3, abs=1e-9)
    assert as_set(linearise(equilibrium(close_loop(ARM, law), near={"i": -15})).eigenvalues) == as_set([-5, -6, -7, -8])


def test_regulation_needs_no_reference_input():
    law = state_feedback(controller_form(ARM), LAW_POLES, reference=Regulate())
    assert [s.name for s in law.system.inputs] == ["theta", "omega", "i"]


def test_regulation_holds_an_operating_point_away_from_the_origin():
    levitation = model("magnetic_levitation").with_values()
    loop = close_loop(levitation, state_feedback(controller_form(levitation), Poles(-5, -6, -7)))
    point = {symbol.name: float(value) for symbol, value in equilibrium(levitation).states.items()}
    assert point["x"] > 0
    assert equilibrium(loop, near=point).numbers == pytest.approx(point)
    assert as_set(linearise(equilibrium(loop, near=point)).eigenvalues) == as_set([-5, -6, -7])


def test_a_law_that_divides_by_zero_at_the_operating_point_says_so():
    singular = system_from_mapping(
        {
            "format": 1,
            "name": "force that fades at the origin",
            "states": {"x1": {"equation": "x2"}, "x2": {"equation": "x1*u"}},
            "inputs": {"u": {}},
        }
    )
    with pytest.warns(UlnaWarning, match="divides by zero at the operating point x1 = 0, x2 = 0"):
        state_feedback(controller_form(singular), Poles(-1, -2))


def test_linear_quadratic_gains_stabilise_each_chain():
    loop = close_loop(ARM, state_feedback(controller_form(ARM), LinearQuadratic(state_weights=(100, 1, 1))))
    assert linearise(equilibrium(loop, near={"i": -15})).stable


def test_outputs_are_linearised_where_the_whole_state_cannot_be():
    cart = system_from_mapping(
        {
            "states": {"p": "q", "q": "u", "a": "w", "w": "-sin(a) - w - u*cos(a)"},
            "inputs": {"u": {}},
            "outputs": {"y": "p"},
        }
    )
    law = state_feedback(input_output_form(cart), Poles(-2, -3), reference=SetPoint())
    run = simulate(close_loop(cart, law).system, [0.5, 0, 0.2, 0], 30.0, inputs={"y_ref": 1.0})
    assert run.final_state == pytest.approx([1, 0, 0, 0], abs=1e-5)


def test_two_chains_get_their_own_poles():
    arm = model("two_link_arm").with_values()
    law = state_feedback(controller_form(arm), Poles(-1, -2, -3, -4))
    poles = linearise(equilibrium(close_loop(arm, law), near={})).eigenvalues
    assert as_set(poles) == as_set([-1, -2, -3, -4])


@pytest.mark.parametrize(
    "observer",
    [
        lambda: high_gain_observer(ARM, Poles(-1, -2, -3), time_scale="1/20"),
        lambda: extended_kalman_filter(ARM, KalmanNoise(process=[0, 1, 100], measurement=["1/10000"])),
    ],
    ids=["high gain", "extended Kalman"],
)
def test_any_observer_fits_the_compensator(observer):
    made = observer()
    law = state_feedback(controller_form(ARM), LAW_POLES)
    loop = close_loop(ARM, compensator(law, made)).system
    start = {s.name: 0.0 for s in loop.states} | {"theta": 0.2}
    start |= {name: float(value) for name, value in made.initial.items()}
    run = simulate(loop, start, 6.0)
    assert run["theta"][-1] == pytest.approx(0.0, abs=1e-3)
    assert run["theta_hat"][-1] == pytest.approx(run["theta"][-1], abs=1e-3)


def test_an_observer_of_another_plant_is_refused():
    other = system_from_mapping({"states": {"a": "b", "b": "u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}})
    observer = exact_observer(observer_form(other), Poles(-1, -2))
    with pytest.raises(DesignError, match="does not estimate theta, omega, i"):
        compensator(state_feedback(controller_form(ARM), LAW_POLES), observer)


def test_a_compensator_is_a_system_like_any_other(tmp_path):
    law = state_feedback(controller_form(ARM), LAW_POLES)
    whole = compensator(law, exact_observer(observer_form(ARM), Poles(-9, -10, -11))).system
    write_system(whole, tmp_path / "compensator.toml")
    assert read_system(tmp_path / "compensator.toml") == whole
