"""The loops of the paper, exact and as printed: law (32)/(54) and estimator (53) built from the printed text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import sympy as sp

from ulna.studies.paper.carry import Checked, printed_value
from ulna.studies.paper.chain import XBAR, U, X, Y
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.terms import split_terms
from ulna.system import Signal, System, connect


@dataclass(frozen=True, slots=True, kw_only=True)
class Controller:
    """Law and estimator in the paper's names, x̄' = A x̄ + injection(y) − L (c x̄ − y) + g u and u = u(x).

    Attributes:
        law: in x1, x2, x3.
        A: (3, 3); injection: (3, 1) in y; L: (3, 1); g: (3, 1).
    """

    law: sp.Expr
    A: sp.ImmutableDenseMatrix
    injection: sp.ImmutableDenseMatrix
    L: sp.ImmutableDenseMatrix
    g: sp.ImmutableDenseMatrix

    @property
    def estimator_rates(self) -> sp.ImmutableDenseMatrix:
        """(3, 1) the rates of the estimates in xbar, y, u."""
        estimate = sp.Matrix(XBAR)
        return sp.ImmutableDenseMatrix(self.A * estimate + self.injection - self.L * (XBAR[0] - Y) + self.g * U)


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """One printed number that is not the exact one.

    Attributes:
        place: where it is printed.
        printed, exact: its values, as terms of the law or entries of the estimator.
        alone: the exact controller with this one number as printed.
        repaired: the printed controller with this one number exact.
    """

    place: str
    printed: sp.Expr
    exact: sp.Expr
    alone: Controller
    repaired: Controller


_PARTS: Mapping[str, str] = {"A": "A_53", "injection": "injection", "L": "L_53", "g": "g_53"}


def controllers(chain: Mapping[str, Checked]) -> tuple[Controller, Controller]:
    """The exact controller and the printed one."""
    exact = Controller(
        law=chain["u"].exact[0],
        A=chain["A_53"].exact,
        injection=chain["injection"].exact,
        L=chain["L_53"].exact,
        g=chain["g_53"].exact,
    )
    printed = {field: printed_value(chain[key].step) for field, key in _PARTS.items()}
    return exact, Controller(law=printed_value(chain["u"].step)[0], **printed)


def deviations(exact: Controller, printed: Controller) -> tuple[Deviation, ...]:
    """Every number in which the printed controller is not the exact one, the law's first."""
    found: list[Deviation] = []
    here, there = split_terms(exact.law), split_terms(printed.law)
    for shape in dict.fromkeys([*there, *here]):
        good = here[shape].factor * shape if shape in here else sp.Integer(0)
        bad = there[shape].factor * shape if shape in there else sp.Integer(0)
        if good != bad:
            found.append(
                Deviation(
                    place=f"(32), {shape}",
                    printed=bad,
                    exact=good,
                    alone=replace(exact, law=exact.law - good + bad),
                    repaired=replace(printed, law=printed.law - bad + good),
                )
            )
    for field in _PARTS:
        good_matrix, bad_matrix = getattr(exact, field), getattr(printed, field)
        for i in range(good_matrix.rows):
            for j in range(good_matrix.cols):
                if good_matrix[i, j] != bad_matrix[i, j]:
                    found.append(
                        Deviation(
                            place=_place(field, i, j, good_matrix.cols),
                            printed=bad_matrix[i, j],
                            exact=good_matrix[i, j],
                            alone=replace(exact, **{field: _with(good_matrix, i, j, bad_matrix[i, j])}),
                            repaired=replace(printed, **{field: _with(bad_matrix, i, j, good_matrix[i, j])}),
                        )
                    )
    return tuple(found)


def state_feedback_loop(exact: Exact, controller: Controller, name: str) -> System:
    """The arm with the law fed by its true states."""
    plant = replace(
        exact.plant,
        outputs=exact.plant.states,
        readouts=exact.plant.state_symbols,
    )
    return connect(
        {"plant": plant, "law": _law_system(exact, controller)},
        {
            **{f"law.{s.name}": f"plant.{s.name}" for s in plant.states},
            **{f"plant.{s.name}": f"law.{s.name}" for s in plant.inputs},
        },
        outputs=[*(f"plant.{s.name}" for s in plant.states), *(f"law.{s.name}" for s in plant.inputs)],
        name=name,
    )


def compensator_loop(exact: Exact, controller: Controller, name: str) -> System:
    """The arm with the law fed by the estimator, which starts anywhere and sees angle and voltage alone."""
    plant, output = exact.plant, exact.plant.outputs[0].name
    inputs = [s.name for s in plant.inputs]
    estimator = _estimator_system(exact, controller)
    wires = {f"law.{s.name}": f"estimator.{s.name}_hat" for s in plant.states}
    wires |= {f"{part}.{name}": f"law.{name}" for part in ("plant", "estimator") for name in inputs}
    wires |= {f"estimator.{output}": f"plant.{output}"}
    return connect(
        {"plant": plant, "estimator": estimator, "law": _law_system(exact, controller)},
        wires,
        outputs=[
            f"plant.{output}",
            *(f"law.{name}" for name in inputs),
            *(f"estimator.{s.name}" for s in estimator.states),
        ],
        name=name,
    )


def controller_system(exact: Exact, controller: Controller) -> System:
    """Law and estimator as one system that reads the angle alone."""
    plant = exact.plant
    wires = {f"law.{s.name}": f"estimator.{s.name}_hat" for s in plant.states}
    wires |= {f"estimator.{s.name}": f"law.{s.name}" for s in plant.inputs}
    outputs = [f"law.{s.name}" for s in plant.inputs] + [f"estimator.{s.name}_hat" for s in plant.states]
    parts = {"estimator": _estimator_system(exact, controller), "law": _law_system(exact, controller)}
    return connect(parts, wires, outputs=outputs, name="law and estimator as printed")


def _law_system(exact: Exact, controller: Controller) -> System:
    onto = dict(zip(X, exact.plant.state_symbols, strict=True))
    return System(
        name="law",
        states=(),
        rates=(),
        inputs=exact.plant.states,
        outputs=exact.plant.inputs,
        readouts=(controller.law.xreplace(onto),),
    )


def _estimator_system(exact: Exact, controller: Controller) -> System:
    plant = exact.plant
    hats = tuple(
        Signal(name=f"{s.name}_hat", unit=s.unit, text=f"estimate of {s.text or s.name}") for s in plant.states
    )
    onto = {
        **dict(zip(XBAR, (s.symbol for s in hats), strict=True)),
        Y: plant.outputs[0].symbol,
        U: plant.input_symbols[0],
    }
    return System(
        name="estimator",
        states=hats,
        rates=tuple(rate.xreplace(onto) for rate in controller.estimator_rates),
        inputs=(*plant.inputs, *plant.outputs),
        outputs=hats,
        readouts=tuple(s.symbol for s in hats),
    )


def _with(matrix: sp.ImmutableDenseMatrix, row: int, column: int, value: sp.Expr) -> sp.ImmutableDenseMatrix:
    changed = sp.Matrix(matrix)
    changed[row, column] = value
    return sp.ImmutableDenseMatrix(changed)


def _place(field: str, row: int, column: int, columns: int) -> str:
    where = f"row {row + 1}" + (f", column {column + 1}" if columns > 1 else "")
    return f"(53), {field}, {where}"
