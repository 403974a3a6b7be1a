import numpy as np
import pytest
import sympy as sp

from ulna.base import UlnaError
from ulna.program import at_zero, joined, lie_derivatives, solved, tangents, to_numpy
from ulna.symbolic.compiling import kernel

x, y, u = sp.symbols("x y u", real=True)
FIELD = (sp.sin(x) * y + sp.exp(-x) * sp.sqrt(1 + y**2), sp.cos(x * y) / (2 + x**2) + sp.log(3 + x) + u)
FUNCTIONS = [
    sp.sin(x) * sp.cos(x) + y * x,
    (x + 2) ** sp.Rational(3, 2) * sp.cosh(y) + sp.sinh(x),
    sp.tan(x * y) + sp.tanh(x + y) + sp.atan(x * y),
    sp.asin(x * y) - sp.acos(x / (2 + y)),
    sp.Integer(3) + 0 * x,
]
AT = (0.3, 0.7, 0.2)


def lie_chain(function, order):
    chain = [function]
    for _ in range(order):
        chain.append(sp.diff(chain[-1], x) * FIELD[0] + sp.diff(chain[-1], y) * FIELD[1])
    return [float(e.subs(dict(zip((x, y, u), AT, strict=True)))) for e in chain]


@pytest.mark.parametrize("function", FUNCTIONS)
def test_taylor_coefficients_along_the_flow_are_lie_derivatives(function):
    field = kernel("f", (x, y, u), {"dx": FIELD[0], "dy": FIELD[1], "h": function})
    values = to_numpy(lie_derivatives(field, ["x", "y"], ["dx", "dy"], 5))(*AT)
    assert values == pytest.approx(lie_chain(function, 5), rel=1e-12)


def test_a_definition_is_read_once_and_differentiated_through():
    s = sp.Symbol("s", real=True)
    field = kernel("f", (x, y, u), {"dx": s * y, "dy": -s, "h": s * x}, definitions={s: sp.sin(x)})
    direct = kernel("f", (x, y, u), {"dx": sp.sin(x) * y, "dy": -sp.sin(x), "h": sp.sin(x) * x})
    assert to_numpy(lie_derivatives(field, ["x", "y"], ["dx", "dy"], 3))(*AT) == to_numpy(
        lie_derivatives(direct, ["x", "y"], ["dx", "dy"], 3)
    )(*AT)


def test_what_has_no_series_is_refused():
    field = kernel("f", (x, y, u), {"dx": sp.Abs(x), "dy": y, "h": x})
    with pytest.raises(UlnaError, match="abs"):
        lie_derivatives(field, ["x", "y"], ["dx", "dy"], 2)


def test_tangents_are_the_derivatives():
    functions = [*FIELD, *FUNCTIONS, sp.atan(x) * sp.tan(y), sp.asin(x / 2) + sp.acos(y / 2), x**y, sp.tanh(x)]
    program = kernel("f", (x, y, u), {f"o{k}": f for k, f in enumerate(functions)})
    slopes = tangents(program, ["x", "u"])
    values = dict(zip(slopes.outputs, to_numpy(slopes)(*AT), strict=True))
    for k, function in enumerate(functions):
        for symbol in (x, u):
            exact = float(sp.diff(function, symbol).subs(dict(zip((x, y, u), AT, strict=True))))
            assert values[f"o{k}/{symbol.name}"] == pytest.approx(exact, rel=1e-12, abs=1e-15)


def test_holding_an_input_at_zero_folds_it_away():
    program = kernel("f", (x, y, u), {"a": sp.sin(u) * x + y - u, "b": sp.cos(u) / (1 + u) + u / x})
    folded = at_zero(program, ["u"])
    assert to_numpy(folded)(0.3, 0.7, 99.0) == pytest.approx(to_numpy(program)(0.3, 0.7, 0.0), rel=1e-15)
    assert folded.operation_count < program.operation_count


def test_a_linear_system_is_solved_in_instructions():
    generator = np.random.default_rng(3)
    names = [[f"a{i}{j}" for j in range(4)] for i in range(4)]
    symbols = sp.symbols("c1:5", real=True)
    entries = {
        names[i][j]: sp.Integer(i + 2 * j + 1) * symbols[(i * j) % 4] ** (i + 1) for i in range(4) for j in range(4)
    }
    rights = {f"q{i}": symbols[i] for i in range(4)}
    system = joined("s", [kernel("m", symbols, {**entries, **rights})], ["p0", "p1", "p2", "p3"])
    at = generator.uniform(0.5, 1.5, 8)
    numbers = dict(zip(system.outputs, to_numpy(system)(*at), strict=True))
    matrix = np.array([[numbers[e] for e in row] for row in names])
    program = solved("x", system, names, [(f"p{i}", f"q{i}") for i in range(4)], ["x0", "x1", "x2", "x3"], matrix[None])
    expected = np.linalg.solve(matrix, at[4:] - np.array([numbers[f"q{i}"] for i in range(4)]))
    assert to_numpy(program)(*at) == pytest.approx(expected, rel=1e-9)


def test_a_singular_linear_system_is_refused():
    system = joined("s", [kernel("m", (x, y), {"a": x, "b": 2 * x, "c": y, "d": 2 * y, "q": x})], ["p"])
    sample = np.array([[[1.0, 2.0], [3.0, 6.0]]])
    with pytest.raises(UlnaError, match="singular"):
        solved("x", system, [["a", "b"], ["c", "d"]], [("p", "q"), ("p", "q")], ["r", "s"], sample)
