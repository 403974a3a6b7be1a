"""Stability classes of equilibria: closed answers, critical cases, invariance under changes of coordinates."""

from __future__ import annotations

from typing import Any

import pytest
import sympy as sp
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from ulna.base import Status, UlnaError
from ulna.design.internal.center_manifold import center_modes, reduced_orders
from ulna.design.internal.critical_class import StabilityClass
from ulna.design.internal.equilibrium_stability import equilibrium_stability
from ulna.symbolic.solving import eigenvalue_location, taylor_coefficients
from ulna.symbolic.solving.taylor import NoSeriesError
from ulna.system import System, system_from_mapping


def autonomous(rates: dict[str, str], point: dict[str, Any] | None = None, **parameters: Any) -> System:
    return system_from_mapping(
        {"name": "plant", "states": rates, "operating_point": point or {}, "parameters": parameters}
    )


CASES = {
    "linear, stable": ({"x": "-x"}, "exponential"),
    "at rest everywhere": ({"x": "0"}, "marginal"),
    "cubic damping": ({"x": "-x**3"}, "asymptotic"),
    "cubic growth": ({"x": "x**3"}, "unstable"),
    "quadratic": ({"x": "x**2"}, "unstable"),
    "fifth order behind a fast state": ({"x": "-x**5 + x*y", "y": "-2*y"}, "asymptotic"),
    "hyperbolic tangent cubed": ({"x": "-tanh(x)**3"}, "asymptotic"),
    "centre manifold, stable": ({"x": "x*y", "y": "-y - x**2"}, "asymptotic"),
    "centre manifold, unstable": ({"x": "x*y", "y": "-y + x**2"}, "unstable"),
    "centre manifold of equilibria": ({"x": "x*y - x**3", "y": "-y + x**2"}, "marginal"),
    "centre manifold along (1, 1)": ({"x": "-x + y", "y": "-x*y"}, "unstable"),
    "cubic driven by a decaying state": ({"x": "-x**3 + z**2", "z": "-z"}, "asymptotic"),
    "pendulum, hanging": ({"q": "w", "w": "-sin(q)"}, "marginal"),
    "pendulum, upright": ({"q": "w", "w": "sin(q)"}, "unstable"),
    "pendulum, damped": ({"q": "w", "w": "-sin(q) - w/10"}, "exponential"),
    "pendulum with an inertia that varies": (
        {"q": "w", "w": "-(sin(q) + w**2*sin(q)*cos(q))/(1 + cos(q)**2)"},
        "marginal",
    ),
    "weak focus, damped": ({"x": "y", "y": "-x - y**3"}, "asymptotic"),
    "weak focus, driven": ({"x": "y", "y": "-x + y**3"}, "unstable"),
    "Hopf, supercritical": ({"x": "-y - x*(x**2 + y**2)", "y": "x - y*(x**2 + y**2)"}, "asymptotic"),
    "Hopf, subcritical": ({"x": "-y + x*(x**2 + y**2)", "y": "x + y*(x**2 + y**2)"}, "unstable"),
    "Hopf on a centre manifold": ({"x": "y", "y": "-x - y*z", "z": "-z + y**2"}, "asymptotic"),
    "second focal value": ({"x": "y", "y": "-x - y**5"}, "asymptotic"),
    "van der Pol": ({"x": "y", "y": "-x + y*(1 - x**2)"}, "unstable"),
    "double integrator": ({"x": "y", "y": "0"}, "unstable"),
    "cubic spring": ({"x": "y", "y": "-x**3"}, "marginal"),
    "cubic spring, wrong sign": ({"x": "y", "y": "x**3"}, "unstable"),
    "quadratic spring": ({"x": "y", "y": "-x**2"}, "unstable"),
    "cubic spring, damped": ({"x": "y", "y": "-x**3 - y"}, "asymptotic"),
    "cubic spring, weakly damped": ({"x": "y", "y": "-x**3 - x**2*y"}, "asymptotic"),
    "Liénard": ({"x": "y - x**3", "y": "-x**3"}, "asymptotic"),
    "velocity that never ends": ({"x": "y", "y": "y**2*tan(x)"}, "unstable"),
    "velocity that ends": ({"x": "y", "y": "-x**2*y"}, "marginal"),
    "two slow modes, coupled": ({"x": "-x**3 + y**2*x", "y": "-2*y**3 - x**2*y"}, "asymptotic"),
    "two slow modes, apart": ({"x": "-x**3", "y": "-y**3"}, "asymptotic"),
    "two pendulums": (
        {"a": "p", "b": "r", "p": "-sin(a) + b - a", "r": "(a - b)/2"},
        "marginal",
    ),
    "Hénon and Heiles": ({"a": "p", "b": "r", "p": "-a - 2*a*b", "r": "-b - a**2 + b**2"}, "marginal"),
}


@pytest.mark.parametrize("name", CASES)
def test_origin_has_the_known_class(name: str) -> None:
    rates, expected = CASES[name]
    found = equilibrium_stability(autonomous(rates))
    assert found.stability == expected
    assert found.verdict.status is Status.PROVED
    assert found.verdict.evidence["by"]


@pytest.mark.parametrize(
    ("rates", "point", "expected"),
    [
        ({"x": "x*(1 - y)", "y": "y*(x - 1)"}, {"x": 1, "y": 1}, "marginal"),
        ({"x": "x*(2 - y)", "y": "y*(x - 3)"}, {"x": 3, "y": 2}, "marginal"),
        ({"x": "x*(1 - x) - x*y", "y": "y*(x - 1/2)"}, {"x": 0.5, "y": 0.5}, "exponential"),
        ({"x": "x - x**3"}, {"x": 1}, "exponential"),
        ({"x": "x - x**3"}, {}, "unstable"),
        ({"x": "x - x**3"}, {"x": 0.8}, "exponential"),
        ({"q": "w", "w": "sin(q)"}, {"q": "pi"}, "marginal"),
    ],
)
def test_equilibria_away_from_the_origin_are_judged_where_they_are(
    rates: dict[str, str], point: dict[str, Any], expected: str
) -> None:
    assert equilibrium_stability(autonomous(rates, point)).stability == expected


def test_nearest_equilibrium_is_taken_and_shown() -> None:
    found = equilibrium_stability(autonomous({"x": "-(x - 2)*(x - 5)*(x - 7)"}, {"x": 6}))
    assert found.equilibrium[sp.Symbol("x", real=True)] in (5, 7)
    assert equilibrium_stability(autonomous({"x": "-(x - 2)*(x - 5)"}, {"x": 4.9})).equilibrium == {
        sp.Symbol("x", real=True): 5
    }


def test_equilibrium_in_decimals_supports_but_does_not_prove() -> None:
    found = equilibrium_stability(autonomous({"x": "y", "y": "1 - x - y - x**3*exp(x)"}))
    assert found.stability == "exponential"
    assert found.verdict.status is Status.SUPPORTED


@pytest.mark.parametrize("rates", [{"x": "1 + x**2"}, {"x": "-x*abs(x)"}, {"x": "y", "y": "-x*(1 + z)", "z": "-z**3"}])
def test_what_cannot_be_decided_says_why(rates: dict[str, str]) -> None:
    found = equilibrium_stability(autonomous(rates))
    assert found.stability is StabilityClass.UNDECIDED
    assert found.verdict.status is Status.UNDECIDED
    assert found.verdict.evidence


def test_signs_of_parameters_without_values_come_from_their_ranges() -> None:
    assert equilibrium_stability(autonomous({"x": "-a*x"}, a={"range": [0, 5]})).stability == "exponential"
    assert equilibrium_stability(autonomous({"x": "-a*x"}, a={"range": [-5, 0]})).stability == "unstable"
    assert equilibrium_stability(autonomous({"x": "-a*x"}, a={})).stability == "undecided"
    assert equilibrium_stability(autonomous({"x": "-a*x"}, a={"value": -2})).stability == "unstable"


def test_system_with_inputs_is_refused() -> None:
    plant = system_from_mapping({"name": "plant", "states": {"x": "u"}, "inputs": {"u": {}}})
    with pytest.raises(UlnaError, match="has inputs"):
        equilibrium_stability(plant)


small = st.integers(-2, 2)


@given(a=small, b=small, c=small, sign=st.sampled_from([-1, 1]), power=st.sampled_from([2, 3, 4, 5]))
@settings(max_examples=6, phases=[Phase.generate])
def test_class_does_not_depend_on_coordinates(a: int, b: int, c: int, sign: int, power: int) -> None:
    # s' = sign s^k, w' = −w in x = s + a w + b s², y = w + c s² (inverted order by order by going through s and w).
    s, w, x, y = sp.symbols("s w x y", real=True)
    # A triangular polynomial map has a polynomial inverse: x = s, y = w + a s + c s² + b s³.
    lift = a * s + c * s**2 + b * s**3
    own = [sign * s**power, -w]
    rate_y = sp.expand((own[1] + lift.diff(s) * own[0]).subs(w, y - lift).subs(s, x))
    # A linear mixing on top: p = x + y, q = y.
    p, q = sp.symbols("p q", real=True)
    rate_x = own[0].subs(s, x)
    mixed = {"p": str(sp.expand((rate_x + rate_y).subs({x: p - q, y: q}, simultaneous=True)))}
    mixed["q"] = str(sp.expand(rate_y.subs({x: p - q, y: q}, simultaneous=True)))
    expected = "asymptotic" if power % 2 and sign < 0 else "unstable"
    assert equilibrium_stability(autonomous(mixed)).stability == expected


@given(
    st.lists(st.sampled_from([-3, -2, -1, 1, 2, 3]), min_size=1, max_size=3),
    st.lists(st.tuples(st.integers(-1, 1), st.integers(1, 3)), max_size=2),
    st.integers(0, 2),
)
@settings(max_examples=20)
def test_roots_are_counted_on_each_side(real: list[int], pairs: list[tuple[int, int]], zeros: int) -> None:
    z = sp.Symbol("z")
    factors = [z - r for r in real] + [(z - a) ** 2 + b**2 for a, b in pairs] + [z] * zeros
    polynomial = sp.Poly(sp.Mul(*factors), z)
    found = eigenvalue_location(_companion(polynomial))
    assert found.verdict.status is Status.PROVED
    assert found.zero == zeros
    assert found.right == sum(r > 0 for r in real) + 2 * sum(a > 0 for a, _ in pairs)
    assert found.left == sum(r < 0 for r in real) + 2 * sum(a < 0 for a, _ in pairs)
    assert sorted(found.squares) == sorted(b**2 for a, b in pairs if a == 0)


def _companion(polynomial: sp.Poly) -> sp.Matrix:
    coefficients = polynomial.all_coeffs()
    n = len(coefficients) - 1
    return sp.Matrix(n, n, lambda i, j: -coefficients[n - j] if i == n - 1 else int(j == i + 1))


def test_irrational_coefficients_are_located_too() -> None:
    root = sp.sqrt(2)
    assert eigenvalue_location(sp.Matrix([[0, 1], [-root, 0]])).squares == (root,)
    assert eigenvalue_location(sp.Matrix([[0, 1], [-root, -sp.pi]])).left == 2
    assert eigenvalue_location(sp.Matrix([[-root, 1], [0, -root]])).left == 2
    assert eigenvalue_location(sp.Matrix([[root, 1], [2, root]])).zero == 1


def test_series_agree_with_derivatives_and_refuse_singular_points() -> None:
    x, s = sp.symbols("x s", real=True)
    functions = [sp.sin(x) * sp.exp(x), 1 / (1 + x), sp.sqrt(1 + x), sp.atan(x), sp.log(1 + x), sp.tan(x), sp.tanh(x)]
    curve = [sp.Integer(c) for c in (0, 1, 2)]
    for function, series in zip(functions, taylor_coefficients(functions, {x: curve}, 4), strict=True):
        along = function.subs(x, s + 2 * s**2)
        for k, coefficient in enumerate(series):
            assert sp.simplify(coefficient - along.diff(s, k).subs(s, 0) / sp.factorial(k)) == 0
    for singular in (1 / x, sp.sqrt(x), sp.Abs(x)):
        with pytest.raises(NoSeriesError):
            taylor_coefficients([singular], {x: curve}, 3)


def test_centre_manifold_satisfies_its_invariance_condition() -> None:
    x, y, z = sp.symbols("x y z", real=True)
    rates = [x * y + z**2, -y + x**2 + sp.sin(x) * z, -2 * z + x**2 - x * y]
    A = sp.Matrix(rates).jacobian([x, y, z]).subs({x: 0, y: 0, z: 0})
    modes = center_modes(A, zero=1, squares=())
    orders = list(reduced_orders(rates, [x, y, z], modes, 5))
    [s] = modes.coordinates
    graph = modes.center * s + modes.stable * sum((sp.Matrix(list(o.manifold)) for o in orders), sp.zeros(2, 1))
    rate = sum(o.rates[0] for o in orders)
    values = dict(zip((x, y, z), graph, strict=True))
    gap = sp.Matrix(rates).subs(values) - graph.diff(s) * rate
    for entry in gap:
        assert sp.series(entry, s, 0, 6).removeO() == 0


def test_a_steady_drift_is_named_as_the_reason_for_no_equilibrium():
    system = system_from_mapping({"format": 1, "name": "drift", "states": {"x1": "-x1", "x2": "-1/2"}})
    found = equilibrium_stability(system)
    assert found.stability == "undecided"
    assert "x2 has the rate -1/2" in str(found.verdict.evidence["reason"])
