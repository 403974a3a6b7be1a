"""Observers as systems: the paper's, in x and in z; high-gain; extended Kalman filter."""

from __future__ import annotations

import pytest
import sympy as sp

from ulna.base import DesignError, NoFormError
from ulna.design.gains import Poles
from ulna.design.observers.extended_kalman import KalmanNoise, extended_kalman_filter
from ulna.design.observers.high_gain import high_gain_observer
from ulna.design.observers.observer import error_matrix, exact_observer, gains_in_form, injected_observer
from ulna.design.observers.observer_coordinates import observer_form
from ulna.design.observers.transformed_output import transformed_observer_form
from ulna.symbolic.exact import are_zero
from ulna.system import System, read_system, system_from_mapping

ARM = read_system("src/ulna/plants/data/one_link_arm.toml").with_values()


def plant(states: dict[str, str], outputs: dict[str, str], inputs: str = "", **more: object) -> System:
    return system_from_mapping(
        {"name": "plant", "states": states, "outputs": outputs, "inputs": {u: {} for u in inputs.split()}} | more
    )


SINE = plant({"x1": "x2", "x2": "-sin(x1) + u"}, {"y": "x1"}, "u")
LOTKA_VOLTERRA = plant({"x1": "x1*(1 - x2)", "x2": "x2*(-1 + x1)"}, {"y": "x1"}, operating_point={"x1": 1, "x2": 1})


def real(*names: str) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(name, real=True) for name in names)


def error_poles(matrix: sp.MatrixBase) -> dict[sp.Expr, int]:
    return sp.roots(matrix.charpoly().as_expr())


def test_the_papers_observer_exactly() -> None:
    observer = exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    theta, omega, i, y, u = real("theta_hat", "omega_hat", "i_hat", "y", "u")
    gap = theta - y
    due = [
        omega - 20 * gap,
        sp.Rational(100, 51) * i + sp.Rational(588, 17) * sp.cos(y) - sp.Rational(4049, 51) * gap,
        -10 * omega - 10 * i + 10 * u + 100 * gap,
    ]
    assert are_zero([a - b for a, b in zip(observer.system.rates, due, strict=True)]).holds
    assert gains_in_form(observer) == sp.Matrix([990, 299, 30])
    assert error_poles(error_matrix(observer)) == {-9: 1, -10: 1, -11: 1}
    assert [s.name for s in observer.system.inputs] == ["u", "y"]
    assert [s.name for s in observer.system.outputs] == ["theta_hat", "omega_hat", "i_hat"]


def test_linear_parts_of_observer_and_error_have_the_same_poles() -> None:
    # The third gain with the wrong sign is still stable: only the whole set of poles tells.
    observer = exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    hats = list(observer.system.state_symbols)
    jacobian = sp.Matrix(observer.system.rates).jacobian(hats)
    assert error_poles(jacobian) == {-9: 1, -10: 1, -11: 1}


@pytest.mark.parametrize("system", [ARM, SINE, LOTKA_VOLTERRA], ids=["arm", "sine", "lotka-volterra"])
def test_the_error_in_z_is_linear(system: System) -> None:
    form = transformed_observer_form(system)
    observer = exact_observer(form, Poles(*[-k - 3 for k in range(len(form.view.x))]))
    view = form.view
    hats = observer.system.state_symbols
    onto = dict(zip(view.x, hats, strict=True))
    u = sp.Matrix(len(view.u), 1, list(view.u))
    plant_rate = form.map.jacobian * (sp.Matrix(view.f) + sp.Matrix(view.g) * u)
    seen = dict(zip(form.y, view.h, strict=True))
    estimate_rate = form.map.jacobian.xreplace(onto) * sp.Matrix(observer.system.rates).xreplace(seen)
    error = sp.Matrix(form.map.forward) - sp.Matrix(form.map.forward).xreplace(onto)
    residual = plant_rate - estimate_rate - error_matrix(observer) * error
    assert are_zero(list(residual)).holds


def test_the_observer_in_z_is_the_papers_equation_51() -> None:
    observer = injected_observer(observer_form(ARM), Poles(-9, -10, -11))
    z1, z2, z3, y, u = real("z1_hat", "z2_hat", "z3_hat", "y", "u")
    due = [
        -990 * z3 + 990 * y + sp.Rational(5880, 17) * sp.cos(y) + sp.Rational(1000, 51) * u,
        z1 - 299 * z3 + 299 * y + sp.Rational(588, 17) * sp.cos(y) - sp.Rational(1000, 51) * y,
        z2 - 30 * z3 + 20 * y,
    ]
    assert are_zero([a - b for a, b in zip(observer.system.rates, due, strict=True)]).holds
    assert observer.system.readouts[0] == z3


def test_a_symbolic_plant_keeps_its_parameters() -> None:
    symbolic = read_system("src/ulna/plants/data/one_link_arm.toml")
    observer = exact_observer(observer_form(symbolic), Poles(-9, -10, -11))
    numbers = observer.system.with_values()
    exact = exact_observer(observer_form(ARM), Poles(-9, -10, -11))
    assert are_zero([a - b for a, b in zip(numbers.rates, exact.system.rates, strict=True)]).holds


def test_two_blocks_take_their_poles_in_order() -> None:
    two = plant({"x1": "x2", "x2": "-x1*x3 + u", "x3": "sin(x1) - x3"}, {"y1": "x1", "y2": "x3"}, "u")
    observer = exact_observer(observer_form(two), Poles(-2, -3, -7))
    assert error_poles(error_matrix(observer)) == {-2: 1, -3: 1, -7: 1}
    assert [s.name for s in observer.system.inputs] == ["u", "y1", "y2"]


def test_too_few_poles_are_refused() -> None:
    with pytest.raises(DesignError):
        exact_observer(observer_form(ARM), Poles(-9, -10))


HARD = plant({"x1": "x2", "x2": "x2**3 - x1 + u"}, {"y": "x1"}, "u")


def test_high_gain_error_has_scaled_poles_where_the_plant_is_a_chain() -> None:
    chain = plant({"x1": "x2", "x2": "x3", "x3": "u"}, {"y": "x1"}, "u")
    observer = high_gain_observer(chain, Poles(-1, -2, -3), time_scale=0.1)
    jacobian = sp.Matrix(observer.system.rates).jacobian(list(observer.system.state_symbols))
    assert error_poles(jacobian) == {-10: 1, -20: 1, -30: 1}


def test_high_gain_works_where_no_form_exists() -> None:
    with pytest.raises(NoFormError):
        transformed_observer_form(HARD)
    observer = high_gain_observer(HARD, Poles(-1, -2), time_scale="1/10")
    assert observer.verdict.holds
    x1, x2, y, u = real("x1_hat", "x2_hat", "y", "u")
    due = [x2 + 30 * (y - x1), x2**3 - x1 + u + 200 * (y - x1)]
    assert are_zero([a - b for a, b in zip(observer.system.rates, due, strict=True)]).holds


def test_an_input_that_spoils_observability_is_named() -> None:
    spoiled = plant({"x1": "x2 + x3*u", "x2": "x3", "x3": "-x1"}, {"y": "x1"}, "u")
    observer = high_gain_observer(spoiled, Poles(-1, -2, -3))
    assert observer.verdict.fails
    assert observer.verdict.evidence["input"] == "u"


@pytest.mark.parametrize("scale", [0, -1, "fast", float("nan")])
def test_time_scales_that_are_none_are_refused(scale: object) -> None:
    with pytest.raises(DesignError, match="time scale"):
        high_gain_observer(HARD, Poles(-1, -2), time_scale=scale)


def test_an_unobservable_plant_has_no_high_gain_observer() -> None:
    with pytest.raises(NoFormError, match="rank 1"):
        high_gain_observer(plant({"x1": "-x1", "x2": "-x2"}, {"y": "x1"}), Poles(-1, -2))


def test_the_filter_of_a_linear_plant_is_kalmans_and_bucys() -> None:
    A, C = sp.Matrix([[0, 1], [-2, -3]]), sp.Matrix([[1, 0]])
    observer = extended_kalman_filter(
        plant({"x1": "x2", "x2": "-2*x1 - 3*x2"}, {"y": "x1"}),
        KalmanNoise(process={"x2": 5}, measurement=[0.5], covariance=[2, 3]),
    )
    x1, x2, y, a, b, c = real("x1_hat", "x2_hat", "y", "cov_x1_x1", "cov_x1_x2", "cov_x2_x2")
    P = sp.Matrix([[a, b], [b, c]])
    riccati = A * P + P * A.T + sp.diag(1, 5) - P * C.T * 2 * C * P
    gain = 2 * P * C.T * (y - x1)
    due = [*(A * sp.Matrix([x1, x2]) + gain), riccati[0, 0], riccati[0, 1], riccati[1, 1]]
    assert are_zero([p - q for p, q in zip(observer.system.rates, due, strict=True)]).holds
    assert dict(observer.initial) == {"cov_x1_x1": 2, "cov_x1_x2": 0, "cov_x2_x2": 3}
    assert [s.name for s in observer.system.outputs] == ["x1_hat", "x2_hat"]


@pytest.mark.parametrize(
    "weights",
    [{"process": [1, -1]}, {"measurement": [0]}, {"process": [1]}, {"process": {"x9": 1}}],
)
def test_weights_that_are_none_are_refused(weights: dict[str, object]) -> None:
    with pytest.raises(DesignError):
        extended_kalman_filter(HARD, KalmanNoise(**weights))  # pyright: ignore[reportArgumentType]
