from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
import symengine as se
import sympy as sp
from sympy.physics.mechanics import KanesMethod, Particle, Point, ReferenceFrame, dynamicsymbols

from ulna.base import NoFormError, PlantError
from ulna.design.analysis.analysis import analyse
from ulna.design.analysis.numeric_answers import answers_in_numbers
from ulna.design.forms.law_kernel import compiled_law
from ulna.geometry import relative_degree
from ulna.plants import model
from ulna.plants.flexible_arm import GRAVITY, LENGTH, MASS, STIFFNESS, flexible_joint_arm
from ulna.program import Operation, to_numpy
from ulna.program.lowering.casadi import to_casadi
from ulna.symbolic.compiling import kernel
from ulna.system import System, system_from_mapping, system_kernel

KEYS = (
    "relative_degree",
    "controllability_rank",
    "controllability_rank_at_point",
    "distribution_dims",
    "involutive",
    "full_state_linearizable",
    "observability_rank",
    "observability_rank_at_point",
    "observability_rank_without_inputs",
)


def symbolic_law(system: System, states: np.ndarray, v: np.ndarray) -> np.ndarray:
    """u = β⁻¹ (v − α) from the formulas of the symbolic road."""
    found = relative_degree(system)
    tops = {f"a{k}": chain[-1] for k, chain in enumerate(found.lie_chain)}
    entries = {f"b{k}": e for k, e in enumerate(found.decoupling)}
    numbers = to_numpy(kernel("law", system.state_symbols, {**tops, **entries}))(*states)
    m = len(v)
    return np.linalg.solve(np.array(numbers[m:]).reshape(m, m), v - np.array(numbers[:m]))


def along(function: Any, x: Sequence[Any], field: Sequence[Any]) -> Any:
    """The Lie derivative, plainly."""
    return sum((function.diff(s) * c for s, c in zip(x, field, strict=True)), se.Integer(0))


def differentiated_law(system: System, states: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The same from formulas that SymEngine differentiates plainly along the field; nothing is simplified."""
    x = [se.Symbol(s.name) for s in system.states]
    idle = {se.Symbol(s.name): se.Integer(0) for s in system.inputs}
    # SymPy's symbols are real, SymEngine's are plain.
    plain = {s: sp.Symbol(s.name) for s in (*system.state_symbols, *system.input_symbols)}
    rates = [se.sympify(e.xreplace(plain)) for e in system.inline(system.rates)]
    drift = [e.subs(idle) for e in rates]
    alpha = [se.sympify(e.xreplace(plain)) for e in system.readouts]
    for _ in range(3):
        alpha = [along(e, x, drift) for e in alpha]
    beta = [along(e, x, [r.diff(u) for r in rates]) for e in alpha for u in idle]
    alpha = [along(e, x, drift) for e in alpha]
    numbers = np.array(se.Lambdify(x, [*alpha, *beta], cse=True)(states), dtype=float)
    m = len(v)
    return np.linalg.solve(numbers[m:].reshape(m, m), v - numbers[:m])


@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_law_is_that_of_plainly_differentiated_formulas(links):
    arm = flexible_joint_arm(links)
    law = to_numpy(compiled_law(arm).law)
    generator = np.random.default_rng(10 + links)
    for _ in range(3):
        states, v = generator.uniform(-1, 1, 4 * links), generator.uniform(-1, 1, links)
        expected = differentiated_law(arm, states, v)
        assert np.array(law(*states, *v)) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("links", [1, 2])
def test_both_roads_give_the_same_law(links):
    arm = flexible_joint_arm(links)
    law = compiled_law(arm)
    assert law.indices == (4,) * links
    generator = np.random.default_rng(links)
    for _ in range(3):
        states, v = generator.uniform(-1, 1, 4 * links), generator.uniform(-1, 1, links)
        compiled = np.array(to_numpy(law.law)(*states, *v))
        expected = symbolic_law(arm, states, v)
        assert compiled == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("links", [1, 2, 3, 6, 10])
def test_under_the_law_the_fourth_derivatives_are_the_new_inputs(links):
    """Graph differentiation by CasADi, which shares nothing with the jets, gives the fourth derivative v."""
    arm = flexible_joint_arm(links)
    law = compiled_law(arm)
    field = system_kernel(arm)
    n = 4 * links
    x, u = ca.SX.sym("x", n), ca.SX.sym("u", links)
    outputs = to_casadi(field.kernel)(ca.vertcat(x, u))
    rates, derivative = outputs[:n], outputs[n:]
    for _ in range(4):
        derivative = ca.jtimes(derivative, x, rates)
    fourth = ca.Function("fourth", [x, u], [derivative])
    generator = np.random.default_rng(links)
    for _ in range(3):
        states, v = generator.uniform(-1, 1, n), generator.uniform(-1, 1, links)
        inputs = to_numpy(law.law)(*states, *v)
        scale = max(np.abs(inputs)) * 1e4  # stiffnesses and rotors multiply the torques by as much
        assert np.array(fourth(states, inputs)).ravel() == pytest.approx(v, abs=1e-9 * scale)


@pytest.mark.parametrize(
    "plant",
    [
        {"states": {"a": "b", "b": "sin(a) + c", "c": "-c + u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}},
        # Involutive fails: cart and pendulum, partially linearised.
        {
            "states": {"p": "q", "q": "u", "t": "w", "w": "sin(t) - u*cos(t)"},
            "inputs": {"u": {}},
            "outputs": {"y": "p"},
        },
        # Neither accessible nor observable.
        {"states": {"a": "-a + u", "b": "-2*b", "c": "-3*c"}, "inputs": {"u": {}}, "outputs": {"y": "a + b"}},
        {
            "states": {"x1": "x2 + x3**2", "x2": "x3", "x3": "u", "x4": "x1*u + v"},
            "inputs": {"u": {}, "v": {}},
            "outputs": {"y": "x1", "z": "x4"},
        },
    ],
)
def test_both_roads_answer_alike(plant):
    system = system_from_mapping(plant)
    symbolic, numeric = analyse(system), answers_in_numbers(system, KEYS)
    for key in KEYS:
        if key.startswith("observability_rank") and numeric[key].value is None:
            # Numbers see the drift alone: without a full rank they leave open what inputs add.
            assert system.inputs
            continue
        assert numeric[key].value == symbolic[key].value, key
        # A full rank at one point is a proof, a degree with the graph; all else is sampled.
        full = symbolic[key].value == len(system.states) or "dims" in key or key == "relative_degree"
        sure = ("proved",) if full and symbolic[key].verdict.status == "proved" else ()
        assert numeric[key].verdict.status in ("supported", "refuted", *sure), key


def test_a_large_plant_goes_the_numeric_road():
    analysis = analyse(flexible_joint_arm(4))
    assert analysis["relative_degree"].value == [4, 4, 4, 4]
    assert analysis["distribution_dims"].value[:4] == [4, 8, 12, 16]
    assert analysis["full_state_linearizable"].verdict.status == "supported"
    assert analysis["T"].value is None
    assert "numeric road" in analysis["T"].verdict.evidence["reason"]


def test_the_arm_obeys_the_euler_lagrange_equations_of_one_pendulum():
    arm = flexible_joint_arm(1)
    q, p, u = (sp.Symbol(n, real=True) for n in ("q1", "p1", "u1"))
    rates = arm.inline(arm.rates)
    assert sp.simplify(rates[1] - ((100 * (p - q) - sp.Rational(981, 200) * sp.sin(q)) / sp.Rational(1, 4))) == 0
    assert sp.simplify(rates[3] - 10 * (u - 100 * (p - q))) == 0


@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_arm_obeys_kanes_equations(links):
    """Mass matrix and forces by `KanesMethod`, which the plant is not written with."""
    arm = flexible_joint_arm(links)
    program = to_numpy(system_kernel(arm).kernel)
    angles, speeds = dynamicsymbols(f"a1:{links + 1}"), dynamicsymbols(f"s1:{links + 1}")
    ground, last = ReferenceFrame("N"), Point("O")
    last.set_vel(ground, 0)
    bodies, loads = [], []
    for k, (angle, speed) in enumerate(zip(angles, speeds, strict=True)):
        frame = ground.orientnew(f"A{k}", "Axis", [angle, ground.z])
        frame.set_ang_vel(ground, speed * ground.z)
        tip = last.locatenew(f"P{k}", -LENGTH * frame.y)
        tip.v2pt_theory(last, ground, frame)
        bodies.append(Particle(f"m{k}", tip, MASS))
        loads.append((tip, -MASS * GRAVITY * ground.y))
        last = tip
    kinematic = [angle.diff() - speed for angle, speed in zip(angles, speeds, strict=True)]
    kane = KanesMethod(ground, q_ind=angles, u_ind=speeds, kd_eqs=kinematic)
    kane.kanes_equations(bodies, loads)
    parts = sp.lambdify([*angles, *speeds], [kane.mass_matrix, kane.forcing])
    generator = np.random.default_rng(links)
    for _ in range(3):
        q, w, p, r, u = generator.uniform(-2, 2, (5, links))
        mass, forcing = parts(*q, *w)
        torque = float(STIFFNESS) * (p - np.diff(q, prepend=0))
        expected = np.linalg.solve(mass, forcing.ravel() + torque - np.append(torque[1:], 0))
        found = np.array(program(*q, *w, *p, *r, *u)[links : 2 * links])
        assert found == pytest.approx(expected, rel=1e-10)


def test_the_law_of_six_links_stays_short():
    assert compiled_law(flexible_joint_arm(6)).law.operation_count <= 1500


@pytest.mark.parametrize("name", ["pvtol", "satellite_attitude", "two_link_arm", "quadrotor_extended"])
def test_the_law_exists_wherever_the_decoupling_matrix_is_regular(name):
    """Right angles make sines and cosines vanish: a pivot chosen elsewhere would divide by them."""
    law = compiled_law(model(name))
    m, n = len(law.system.inputs), len(law.system.states)
    program, lie = to_numpy(law.law), to_numpy(law.lie)
    generator = np.random.default_rng(8)
    regular = 0
    for _ in range(100):
        right = generator.choice([0, np.pi / 2, -np.pi / 2, np.pi], n)
        states = np.where(generator.random(n) < 0.6, right, generator.uniform(-1, 1, n))
        v = generator.uniform(-1, 1, m)
        values = np.array(lie(*states))
        beta = values[m:].reshape(m, m).T
        if not np.isfinite(beta).all() or np.linalg.cond(beta) > 1e4:
            continue
        regular += 1
        expected = np.linalg.solve(beta, v - values[:m])
        assert np.array(program(*states, *v)) == pytest.approx(expected, rel=1e-7, abs=1e-7 * np.abs(expected).max())
    assert regular > 20


def test_a_law_between_instructions_that_are_not_affine_is_found_by_slopes():
    """sin² + cos² is one, but its Taylor coefficients hold squares of the input that cancel."""
    plant = system_from_mapping(
        {
            "states": {"a": "b + sin(c)**2 + cos(c)**2", "b": "d", "d": "u", "c": "w", "w": "u"},
            "inputs": {"u": {}},
            "outputs": {"y": "a"},
        }
    )
    law = compiled_law(plant)
    assert law.indices == (3,)
    assert to_numpy(law.law)(0.3, 0.2, 0.5, 0.7, 0.4, 1.7) == pytest.approx((1.7,), rel=1e-12)


def test_accelerations_that_inputs_move_are_not_solved_for():
    """Computed torque: a rigid arm's law needs its mass matrix and no inverse."""
    rigid = system_from_mapping(
        {
            "definitions": {
                "a1": {"zero": "u1 - 3*a1 - cos(q1 - q2)*a2 - sin(q1 - q2)*w2**2"},
                "a2": {"zero": "u2 - cos(q1 - q2)*a1 - 2*a2 + sin(q1 - q2)*w1**2"},
            },
            "states": {"q1": "w1", "w1": "a1", "q2": "w2", "w2": "a2"},
            "inputs": {"u1": {}, "u2": {}},
            "outputs": {"y1": "q1", "y2": "q2"},
        }
    )
    law = compiled_law(rigid)
    assert law.indices == (2, 2)
    assert Operation.DIV not in law.law.operations
    at = {"q1": 0.4, "w1": 1.1, "q2": -0.3, "w2": 0.6}
    cosine, sine = np.cos(0.7), np.sin(0.7)
    expected = (3 * 0.5 + cosine * 0.2 + sine * 0.36, cosine * 0.5 + 2 * 0.2 - sine * 1.21)
    assert to_numpy(law.law)(*at.values(), 0.5, 0.2) == pytest.approx(expected, rel=1e-12)
    assert np.array(to_numpy(law.law)(*at.values(), 0.5, 0.2)) == pytest.approx(
        symbolic_law(rigid, np.array(list(at.values())), np.array([0.5, 0.2])), rel=1e-10
    )


def test_joints_with_and_without_springs_mix():
    """Degrees 2 and 4: accelerations left open at one order stand squared in a later one; slopes solve what remains."""
    mixed = system_from_mapping(
        {
            "definitions": {
                "a": {"zero": "u1 - (2 + cos(q))*a - sin(q)*w**2"},
                "b": {"zero": "9*(p - s) - 3*b - sin(s)"},
            },
            "states": {"q": "w", "w": "a", "s": "d", "d": "b", "p": "r", "r": "u2 - 9*(p - s)"},
            "inputs": {"u1": {}, "u2": {}},
            "outputs": {"y1": "q", "y2": "s"},
        }
    )
    law = compiled_law(mixed)
    assert law.indices == (2, 4)
    states, v = np.array([0.4, 1.1, -0.3, 0.6, 0.2, -0.7]), np.array([0.5, 0.2])
    assert np.array(to_numpy(law.law)(*states, *v)) == pytest.approx(symbolic_law(mixed, states, v), rel=1e-10)


def test_a_state_may_bear_the_name_of_a_new_input():
    law = compiled_law(
        system_from_mapping({"states": {"x": "v1", "v1": "u - 3*v1"}, "inputs": {"u": {}}, "outputs": {"y": "x"}})
    )
    assert (law.law.inputs, law.lie.inputs) == (("x", "v1", "v_1"), ("x", "v1"))
    assert to_numpy(law.law)(0.0, 2.0, 0.5) == (6.5,)


def test_what_has_no_compiled_law_says_why():
    square = system_from_mapping({"states": {"a": "b", "b": "u"}, "inputs": {"u": {}}})
    with pytest.raises(NoFormError, match="0 outputs, 1 inputs"):
        compiled_law(square)
    out_of_reach = system_from_mapping({"states": {"a": "-a", "b": "u"}, "inputs": {"u": {}}, "outputs": {"y": "a"}})
    with pytest.raises(NoFormError, match="no input reaches output number 1"):
        compiled_law(out_of_reach)
    singular = system_from_mapping(
        {
            "states": {"a": "cos(t)*u", "b": "sin(t)*u", "t": "w"},
            "inputs": {"u": {}, "w": {}},
            "outputs": {"y": "a", "z": "b"},
        }
    )
    with pytest.raises(NoFormError, match="rank 1 instead of 2"):
        compiled_law(singular)


def test_numbers_need_parameter_values():
    system = system_from_mapping({"parameters": {"k": {}}, "states": {"a": "-k*a"}})
    with pytest.raises(PlantError, match="without a value: k"):
        system_kernel(system)
    with pytest.raises(PlantError, match="0 links"):
        flexible_joint_arm(0)
