"""Programs with unknowns: solved once, every order of a jet by the same factors."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from ulna.base import FormulaError, PlantError, UlnaError
from ulna.program import (
    ImplicitKernel,
    InstructionList,
    Kernel,
    Operation,
    Terms,
    explicit,
    factored,
    lie_derivatives,
    open_derivatives,
    pruned,
    to_numpy,
    without_inputs,
)
from ulna.symbolic.compiling import kernel
from ulna.symbolic.solving import solve_affine

x, y, u, a, b, c = sp.symbols("x y u a b c", real=True)
SETS = {
    "definite": ((3 + sp.cos(x)) * a + sp.sin(x) * b - y, sp.sin(x) * a + 2 * b + x * y + u),
    "rotation": (sp.cos(x) * a - sp.sin(x) * b - y, sp.sin(x) * a + sp.cos(x) * b - u * x),
    "quotients": (y - (a + 2 * b) / (2 + x), (a - b) * sp.exp(y) + sp.tanh(x) - a),
}
AT = (0.3, 0.7, 0.2)


def program(equations):
    outputs = {"dx": a * y, "dy": sp.sin(b) + u, "h": x * y + a, "zero0": equations[0], "zero1": equations[1]}
    return ImplicitKernel(
        kernel=kernel("p", (x, y, u, a, b), outputs), unknowns=("a", "b"), residuals=("zero0", "zero1")
    )


@pytest.mark.parametrize("equations", SETS.values(), ids=SETS)
def test_unknowns_come_out_as_the_formulas_say(equations):
    found = solve_affine(equations, [a, b])
    plain = kernel("p", (x, y, u), {"dx": (a * y).xreplace(found), "dy": sp.sin(b).xreplace(found) + u})
    assert to_numpy(explicit(program(equations)))(*AT)[:2] == pytest.approx(to_numpy(plain)(*AT), rel=1e-12)


@pytest.mark.parametrize("equations", SETS.values(), ids=SETS)
def test_lie_derivatives_are_those_of_the_solved_plant(equations):
    found = solve_affine(equations, [a, b])
    outputs = {"dx": a * y, "dy": sp.sin(b) + u, "h": x * y + a}
    plain = kernel("p", (x, y, u), {label: e.xreplace(found) for label, e in outputs.items()})
    direct = to_numpy(lie_derivatives(plain, ["x", "y"], ["dx", "dy"], 4))(*AT)
    implicit = to_numpy(lie_derivatives(program(equations), ["x", "y"], ["dx", "dy"], 4))(*AT)
    assert implicit == pytest.approx(direct, rel=1e-10)


def test_open_coefficients_are_inputs_that_make_the_residuals_vanish():
    opened = open_derivatives(program(SETS["definite"]), ["x", "y"], ["dx", "dy"], [("h", 0)], ["u"])
    assert opened.coefficients == ("a:0", "b:0")
    assert opened.kernel.inputs == ("x", "y", "u", "a:0", "b:0")
    found = solve_affine(SETS["definite"], [a, b])
    point = dict(zip((x, y, u), AT, strict=True))
    numbers = [float(found[s].xreplace(point)) for s in (a, b)]
    value, *zeros = to_numpy(opened.kernel)(*AT, *numbers)
    assert value == pytest.approx(0.21 + numbers[0], rel=1e-13)
    assert zeros == pytest.approx([0, 0], abs=1e-14)
    known = open_derivatives(program(SETS["definite"]), ["x", "y"], ["dx", "dy"], [("h", 0)], [])
    assert known.coefficients == ()


@pytest.mark.parametrize("bad", [a * b - 1, sp.sin(a) + b, 1 / (a + 2) + b])
def test_what_is_not_affine_is_refused(bad):
    with pytest.raises(UlnaError, match="not written affinely"):
        explicit(program((bad, a + b)))
    with pytest.raises(PlantError, match="not affine"):
        solve_affine((bad, a + b), [a, b])


def test_dependent_equations_are_refused():
    equations = (a + b - x, 2 * a + 2 * b - y)
    with pytest.raises(UlnaError, match="singular"):
        explicit(program(equations))
    with pytest.raises(PlantError, match="singular"):
        solve_affine(equations, [a, b])


def test_three_unknowns_are_eliminated_in_formulas():
    equations = (2 * a + sp.sin(x) * b - x, sp.sin(x) * a + 3 * b + y * c, y * b + 4 * c - u)
    found = solve_affine(equations, [a, b, c])
    assert all(sp.simplify(e.xreplace(found)) == 0 for e in equations)


def test_sine_and_cosine_squares_leave_the_coefficients():
    found = solve_affine([(sp.sin(x) ** 2 + sp.cos(x) ** 2) * a - y], [a])
    assert found == {a: y}


def solution(rows, sides, samples):
    """The program's x in A x = b, matrix and sides its inputs."""
    m = len(rows)
    out = InstructionList(m * m + m)
    terms = Terms(out=out)
    entries = [[(i * m + k, 1.0) if rows[i][k] else None for k in range(m)] for i in range(m)]
    found = factored(terms, entries, np.array(samples)).solved([(m * m + k, 1.0) for k in range(m)])
    results = [terms.written(value) for value in found]
    instructions, kept = pruned(out.input_count, out.instructions, results)
    inputs = tuple(f"i{k}" for k in range(out.input_count))
    whole = Kernel(name="x", inputs=inputs, outputs=inputs[:m], instructions=instructions, results=kept)
    return np.array(to_numpy(whole)(*np.ravel(rows), *sides)), whole


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 7), st.integers(0, 10**6), st.sampled_from(["definite", "negative", "general", "sparse"]))
def test_any_regular_matrix_is_solved(m, seed, kind):
    generator = np.random.default_rng(seed)
    matrix = generator.uniform(-1, 1, (m, m))
    if kind == "sparse":
        matrix = np.where(generator.random((m, m)) < 0.5, matrix, 0) + np.diag(generator.uniform(1, 2, m))
    if kind in ("definite", "negative"):
        matrix = (matrix @ matrix.T + np.eye(m)) * (1 if kind == "definite" else -1)
    if np.linalg.cond(matrix) > 1e4:
        return
    sides = generator.uniform(-1, 1, m)
    found, _ = solution(matrix, sides, [matrix])
    assert found == pytest.approx(np.linalg.solve(matrix, sides), rel=1e-8, abs=1e-8)


def test_the_upper_triangle_of_a_definite_matrix_costs_nothing():
    matrix = np.eye(6) + 0.1
    other = matrix + np.triu(np.full((6, 6), 0.01), 1)
    counts = [solution(each, np.ones(6), [each])[1].operation_count for each in (matrix, other)]
    updates_above_the_diagonal = 10 + 6 + 3 + 1
    assert counts[1] - counts[0] == 2 * updates_above_the_diagonal


def test_a_small_matrix_is_solved_where_the_sampled_pivots_vanish():
    general = np.array([[1.0, 0.5], [-0.7, 1.0]])
    found, _ = solution(np.array([[1e-300, 1.0], [2.0, 1e-300]]), [3.0, 4.0], [general])
    assert found == pytest.approx([2.0, 3.0])


def test_a_singular_matrix_is_refused():
    with pytest.raises(UlnaError, match="singular"):
        solution(np.ones((3, 3)), np.ones(3), [np.ones((3, 3))])


def test_only_idle_inputs_can_be_left_out():
    whole = kernel("p", (x, y, u), {"a": x * u})
    assert without_inputs(whole, ["y"]).inputs == ("x", "u")
    assert to_numpy(without_inputs(whole, ["y"]))(2.0, 5.0) == (10.0,)
    with pytest.raises(FormulaError, match="it uses u"):
        without_inputs(whole, ["y", "u"])


def test_numbers_fold_and_signs_are_carried():
    out = InstructionList(2)
    terms = Terms(out=out)
    minus = terms.less(None, (0, 3.0))
    assert minus == (0, -3.0)
    assert terms.less((0, 2.0), (0, 2.0)) is None
    assert terms.over((1, 6.0), (None, -2.0)) == (1, -3.0)
    assert not out.instructions
    assert terms.less(minus, (1, -3.0)) == (2, -3.0)
    assert [i.operation for i in out.instructions] == [Operation.SUB]
