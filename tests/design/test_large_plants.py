import casadi as ca
import numpy as np
import pytest
import sympy as sp

from ulna.base import NoFormError, PlantError
from ulna.design.analysis.analysis import analyse
from ulna.design.analysis.large_questions import large_findings
from ulna.design.forms.compiled_law import compiled_law
from ulna.geometry.relative_degree import relative_degree
from ulna.models.flexible_arm import flexible_joint_arm
from ulna.symbolic.program.kernel import kernel
from ulna.symbolic.program.lowering.casadi import to_casadi
from ulna.symbolic.program.lowering.numpy import to_numpy
from ulna.system import System, system_from_mapping
from ulna.system.field_kernel import field_kernel

KEYS = (
    "relative_degree",
    "controllability_rank",
    "controllability_rank_at_point",
    "distribution_dims",
    "involutive",
    "full_state_linearizable",
    "observability_rank",
    "observability_rank_at_point",
)


def symbolic_law(system: System, states: np.ndarray, v: np.ndarray) -> np.ndarray:
    """u = β⁻¹ (v − α) from the formulas of the symbolic road."""
    found = relative_degree(system)
    tops = {f"a{k}": chain[-1] for k, chain in enumerate(found.lie_chain)}
    entries = {f"b{k}": e for k, e in enumerate(found.decoupling)}
    numbers = to_numpy(kernel("law", system.state_symbols, {**tops, **entries}))(*states)
    m = len(v)
    return np.linalg.solve(np.array(numbers[m:]).reshape(m, m), v - np.array(numbers[:m]))


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


@pytest.mark.parametrize("links", [1, 2, 3, 6])
def test_under_the_law_the_fourth_derivatives_are_the_new_inputs(links):
    """Graph differentiation by CasADi, which shares nothing with the jets, gives the fourth derivative v."""
    arm = flexible_joint_arm(links)
    law = compiled_law(arm)
    field = field_kernel(arm)
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
    symbolic, numeric = analyse(system), large_findings(system, KEYS)
    for key in KEYS:
        assert numeric[key].value == symbolic[key].value, key
        assert numeric[key].verdict.status in ("supported", "refuted"), key


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
        field_kernel(system)
    with pytest.raises(PlantError, match="0 links"):
        flexible_joint_arm(0)
