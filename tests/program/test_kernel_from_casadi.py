"""A CasADi function and the kernel read from it compute the same numbers."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from ulna.base import FormulaError
from ulna.program import Operation, kernel_from_casadi, to_numpy
from ulna.program.lowering.casadi import to_casadi

a, b = ca.SX.sym("a", 3), ca.SX.sym("b")
EXPRESSIONS = ca.vertcat(
    a[0] * ca.sin(a[1]) + b**3 - 2 * a[2],
    ca.sqrt(a[0]) / a[1] ** 2 + ca.fmin(a[2], b) - ca.fmax(a[0], 1),
    ca.if_else(a[0] < b, ca.exp(-a[1]), ca.log(a[2])),
    ca.fabs(a[0] - b) + ca.sign(a[1] - 1) * ca.floor(3 * b) + ca.ceil(a[0]),
    ca.atan2(a[0], a[1]) + a[2] ** b + ca.tanh(b) / (1 + a[0]),
    ca.logic_or(a[0] >= 1, ca.logic_not(a[1] != b)) + a[0] ** 1.5,
)
POINTS = np.random.default_rng(5).uniform(0.2, 2.5, (30, 4))


def test_every_operation_survives_the_way_there_and_back() -> None:
    function = ca.Function("f", [a, b], [EXPRESSIONS])
    read = kernel_from_casadi(function)
    assert read.inputs == ("i0_0", "i0_1", "i0_2", "i1")
    evaluate, again = to_numpy(read), to_casadi(read)
    for point in POINTS:
        expected = np.asarray(function(point[:3], point[3])).ravel()
        np.testing.assert_allclose(evaluate(*map(float, point)), expected, rtol=1e-13)
        np.testing.assert_allclose(np.asarray(again(point)).ravel(), expected, rtol=1e-13)


def test_sparse_results_come_out_dense_with_their_zeros() -> None:
    jacobian = ca.Function("j", [a, b], [ca.jacobian(ca.vertcat(a[0] ** 2, b * a[2]), a)], ["a", "b"], ["j"])
    read = kernel_from_casadi(jacobian)
    assert read.outputs == tuple(f"j_{k}" for k in range(6))
    assert to_numpy(read)(3.0, 4.0, 5.0, 7.0) == (6.0, 0.0, 0.0, 0.0, 0.0, 7.0)


def test_shared_values_stay_shared() -> None:
    shared = ca.sin(a[0] * a[1])
    read = kernel_from_casadi(ca.Function("f", [a], [shared + 1, shared * 2]), inputs=("p", "q", "r"))
    assert read.inputs == ("p", "q", "r")
    assert read.operations[Operation.SIN] == 1


def test_matrix_functions_and_wrong_names_are_refused() -> None:
    symbol = ca.MX.sym("m")
    with pytest.raises(FormulaError, match="Expand"):
        kernel_from_casadi(ca.Function("f", [symbol], [symbol**2]))
    with pytest.raises(FormulaError, match="2 input names for 3"):
        kernel_from_casadi(ca.Function("f", [a], [a[0]]), inputs=("p", "q"))
    with pytest.raises(FormulaError, match="OP_ERF"):
        kernel_from_casadi(ca.Function("f", [b], [ca.erf(b)]))
