"""The controller of a plant chosen by policy: which form, which observer, which hint where one is missing."""

from __future__ import annotations

import pytest

from ulna.base import DesignError, NoFormError, UlnaWarning
from ulna.design import (
    HighGain,
    KalmanNoise,
    LinearQuadratic,
    Method,
    SetPoint,
    Track,
    compensator,
    controller_for,
    controller_form,
    exact_observer,
    extended_kalman_filter,
    high_gain_observer,
    input_output_form,
    observer_form,
    state_feedback,
    transformed_observer_form,
)
from ulna.plants import model
from ulna.system import System, system_from_mapping

ARM = model("one_link_arm").with_values()
TRANSFORMED = model("sir_epidemic").with_values()
FORMLESS = system_from_mapping(
    {"states": {"x1": "x2", "x2": "x2**3 - x1 + u"}, "inputs": {"u": {}}, "outputs": {"y": "x1"}}
)


def cart(damping: str) -> System:
    """A cart whose pendulum hangs to itself when the cart is held."""
    rates = {"p": "q", "q": "u", "a": "w", "w": f"-sin(a) {damping} - u*cos(a)"}
    return system_from_mapping({"states": rates, "inputs": {"u": {}}, "outputs": {"y": "p"}})


def test_law_and_observer_take_the_controller_and_the_observer_form():
    made = controller_for(ARM, law=[-4, -5, -6], observer=[-9, -10, -11], reference=SetPoint())
    law = state_feedback(controller_form(ARM), [-4, -5, -6], reference=SetPoint())
    observer = exact_observer(observer_form(ARM), [-9, -10, -11])
    assert made.law is not None
    assert made.law.system == law.system
    assert made.observer is not None
    assert made.observer.system == observer.system
    assert made.compensator is not None
    assert made.system == compensator(law, observer).system
    assert made.poles == {"law": pytest.approx((-6, -5, -4)), "observer": pytest.approx((-11, -10, -9))}


def test_each_alone_is_the_whole_controller():
    law = controller_for(ARM, law=LinearQuadratic(state_weights=[100, 1, 1]))
    assert law.law is not None
    assert (law.observer, law.compensator, law.system) == (None, None, law.law.system)
    observer = controller_for(ARM, observer="-9, -10, -11")
    assert observer.observer is not None
    assert (observer.law, observer.compensator, observer.system) == (None, None, observer.observer.system)


def test_the_output_is_transformed_where_only_that_gives_a_form():
    with pytest.raises(NoFormError):
        observer_form(TRANSFORMED)
    made = controller_for(TRANSFORMED, observer=[-1, -2])
    assert made.observer is not None
    assert made.observer.form == transformed_observer_form(TRANSFORMED)


def test_other_observers_are_chosen_by_their_options():
    gain = controller_for(FORMLESS, observer=HighGain(gains=[-1, -2], time_scale="1/10"))
    assert gain.system == high_gain_observer(FORMLESS, [-1, -2], time_scale="1/10").system
    noise = KalmanNoise(process=[1, 2], measurement=[0.5], covariance={"x2": 3})
    kalman = controller_for(FORMLESS, law=[-1, -2], observer=noise)
    assert kalman.observer is not None
    assert kalman.observer.system == extended_kalman_filter(FORMLESS, noise).system
    assert kalman.poles == {"law": pytest.approx((-2, -1)), "observer": ()}


def test_estimates_start_at_the_given_operating_point_and_a_covariance_at_its_own():
    plant = system_from_mapping(
        {
            "states": {"x1": "x2", "x2": "u - 2"},
            "inputs": {"u": {}},
            "outputs": {"y": "x1"},
            "operating_point": {"x1": 3, "u": 2},
        }
    )
    made = controller_for(plant, law=[-1, -2], observer=KalmanNoise(covariance=[5, 7]))
    covariance = {"cov_x1_x1": 5.0, "cov_x1_x2": 0.0, "cov_x2_x2": 7.0}
    assert made.initial == {"x1_hat": 3.0, "x2_hat": 0.0} | covariance
    assert controller_for(plant, law=[-1, -2]).initial == {}


def test_a_plant_without_controller_form_gets_its_outputs_linearised_where_the_rest_is_stable():
    with pytest.warns(UlnaWarning, match=r"is input-output, which leaves 2 of 4.* exact: it has no controller form"):
        made = controller_for(cart("- w"), law=[-1, -2], reference=Track())
    assert made.law is not None
    wanted = state_feedback(input_output_form(cart("- w")), [-1, -2], reference=Track())
    assert made.law.expressions == wanted.expressions
    assert list(made.passed) == ["exact"]
    asked = controller_for(cart("- w"), law=[-1, -2], method=Method.INPUT_OUTPUT, reference=Track())
    assert asked.law is not None
    assert asked.law.expressions == wanted.expressions
    assert asked.passed == {}


def test_gains_that_fit_no_better_law_fall_to_the_linearisation_and_say_so():
    with pytest.warns(UlnaWarning, match=r"local, on the linearisation at the origin. exact: .* input-output: "):
        made = controller_for(cart("+ w"), law=[-1, -2, -3, -4])
    assert made.law is not None
    assert sorted(pole.real for pole in made.law.poles) == pytest.approx([-4, -3, -2, -1])
    assert "the zero dynamics are unstable" in made.passed["input-output"]
    with pytest.raises(
        DesignError, match=r"no method gives one\. .*local: 2 given, 4 needed.*method=Method.INPUT_OUTPUT"
    ):
        controller_for(cart("+ w"), law=[-1, -2])


def test_what_may_run_away_with_the_outputs_held_is_told():
    with pytest.warns(UlnaWarning, match="the rest of the state may diverge"):
        controller_for(cart("+ w"), law=[-1, -2], method=Method.INPUT_OUTPUT)


def test_a_plant_without_observer_form_gets_a_local_observer_and_a_blind_one_is_refused():
    with pytest.warns(UlnaWarning, match="the observer of 'plant' is local: the condition"):
        made = controller_for(FORMLESS, observer=[-1, -2])
    assert made.observer is not None
    assert made.observer.poles == pytest.approx((-2, -1))
    hidden = system_from_mapping({"states": {"x": "u", "y": "y + x**2"}, "inputs": {"u": {}}, "outputs": {"x": "x"}})
    with pytest.raises(NoFormError, match=r"no output shows the mode 1 1/s \(in y\).*HighGain\(gains=.*KalmanNoise"):
        controller_for(hidden, observer=[-1, -2])
    blind = system_from_mapping({"states": {"x1": "u"}, "inputs": {"u": {}}})
    with pytest.raises(NoFormError, match=r"no output to observe. Add \[outputs\]"):
        controller_for(blind, observer=[-1])


def test_options_without_what_they_act_on_are_refused():
    with pytest.raises(DesignError, match="integral: there is no law"):
        controller_for(ARM, observer=[-9, -10, -11], integral=True)
    with pytest.raises(DesignError, match="reference: the law is designed already"):
        controller_for(ARM, law=state_feedback(ARM, [-1, -2, -3]), reference=SetPoint())


@pytest.mark.parametrize(
    ("name", "method", "better"),
    [
        ("aircraft_altitude", "exact", []),
        ("duffing", "exact", []),
        ("magnetic_levitation", "exact", []),
        ("isidori_zero_dynamics", "input-output", ["exact"]),
        ("cart_pole", "local", ["exact", "input-output", "approximate"]),
        ("inertia_wheel_pendulum", "exact", []),
    ],
)
def test_with_nothing_asked_for_the_best_law_is_taken_and_the_better_ones_are_told(name, method, better):
    made = controller_for(model(name).with_values())
    assert made.law is not None
    assert made.law.method.startswith(method)
    assert [key for key in made.passed if key != "observer"] == better
    assert max(pole.real for pole in made.law.poles) < 0


@pytest.mark.parametrize(
    ("name", "reason"), [("chua", "there are no inputs"), ("brockett_integrator", "no input moves")]
)
def test_a_plant_that_no_method_helps_is_told_every_reason(name, reason):
    with pytest.raises(DesignError, match=rf"no method gives one. exact: .*{reason}"):
        controller_for(model(name).with_values())
