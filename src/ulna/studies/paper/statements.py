"""The general laws (18) to (24), (26), (30), (33) to (43), (49), (50): evaluated as printed, against the library."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from ulna.base import FormulaError
from ulna.design import gains_in_form
from ulna.geometry import lie_bracket, lie_derivative, lie_derivative_of_covector
from ulna.studies.paper.chain import U, X, Y, Z
from ulna.studies.paper.compare import Comparison, Finding
from ulna.studies.paper.exact import Exact
from ulna.studies.paper.notation import read_formula
from ulna.studies.paper.printed import Entry, Paper
from ulna.studies.paper.verdict import Judged, compare_law, joined, statement

_ZBAR = sp.Matrix(sp.symbols("zbar1:4", real=True))
_ON_ARM = "checked on the arm"
_IN_GENERAL = "checked for fields of three arbitrary functions"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Laws:
    """The paper, what names in its laws stand for, and the exact design they are checked on."""

    paper: Paper
    exact: Exact
    names: Mapping[str, Any]

    def check(self, key: str, entries: Mapping[str, sp.Expr | sp.MatrixBase], meaning: str) -> Judged:
        """The verdict on a passage: each entry evaluated against what it must be."""
        passage = self.paper.passage(key)
        parts = [
            _against(
                passage.printed[entry], exact, self.names, place=entry if len(entries) > 1 else "", meaning=meaning
            )
            for entry, exact in entries.items()
        ]
        return joined(passage, parts)


def statements(paper: Paper, exact: Exact) -> dict[str, Judged]:
    """Return the verdict on each general law, by key of its passage."""
    laws = _Laws(paper=paper, exact=exact, names=_names(exact))
    found = [*_derivatives(paper), *_controller(laws), *_observer(laws), *_estimator(laws)]
    return {judged.passage.key: judged for judged in found}


def _derivatives(paper: Paper) -> list[Judged]:
    """(19) to (21) for arbitrary functions of three coordinates, against the library's Lie calculus."""
    h = sp.Function("h", real=True)(*X)
    f, g = (sp.Matrix([sp.Function(f"{name}{i}", real=True)(*X) for i in (1, 2, 3)]) for name in "fg")
    names = {**_calculus(f), "f": f, "g": g, "h": h}
    gradient = sp.ImmutableDenseMatrix([[h.diff(x) for x in X]])
    laws = {
        "lie_bracket": {"bracket": lie_bracket(f, g, X)},
        "lie_derivative_of_covector": dict.fromkeys(
            ("first", "second", "third"), lie_derivative_of_covector(gradient, f, X)
        ),
    }
    found = [
        joined(
            paper.passage(key),
            [
                _against(
                    paper.entry(key, entry), value, names, place=entry if len(law) > 1 else "", meaning=_IN_GENERAL
                )
                for entry, value in law.items()
            ],
        )
        for key, law in laws.items()
    ]
    product = _against(
        paper.entry("lie_derivative", "product"),
        sp.Matrix([lie_derivative(h, f, X)]),
        names,
        place="product",
        meaning=_IN_GENERAL,
    )
    return [*found, joined(paper.passage("lie_derivative"), [product, _sum_over_coordinates(paper)])]


def _sum_over_coordinates(paper: Paper) -> Comparison:
    """The sum of (20) with its partial derivatives as symbols: which terms are too much, which are missing."""
    text = str(paper.entry("lie_derivative", "sum"))
    slopes, components = sp.symbols("h1:4", real=True), sp.Matrix(sp.symbols("f1:4", real=True))
    exact = lie_derivative(sum(s * x for s, x in zip(slopes, X, strict=True)), components, X)
    difference = sp.expand(read_formula(text) - exact)
    if difference == 0:
        return Comparison(place="sum", printed=text, exact=exact, finding=Finding.STATEMENT, meaning=_IN_GENERAL)
    terms = sp.Add.make_args(difference)
    surplus = ", ".join(str(t) for t in terms if not t.could_extract_minus_sign())
    missing = ", ".join(str(-t) for t in terms if t.could_extract_minus_sign())
    meaning = f"{surplus} stands once too often and {missing} is missing"
    return Comparison(place="sum", printed=text, exact=exact, finding=Finding.MISPRINT, meaning=meaning)


def _controller(laws: _Laws) -> list[Judged]:
    exact, paper = laws.exact, laws.paper
    in_z = exact.named(exact.drift_in_z)
    onto = {Z[0]: sp.Symbol("z1", real=True)}
    rates = exact.view.f + exact.view.g * exact.view.u[0]
    view = exact.view
    affine = sp.expand(sp.Matrix(exact.plant.rates) - rates).is_zero_matrix and len(view.h) == 1
    inverse = dict(zip(view.x, exact.form.map.inverse or (), strict=True))
    law_in_z = exact.named(exact.law.expressions.subs(inverse, simultaneous=True))[0]
    return [
        statement(
            paper.passage("affine_system"),
            holds=bool(affine),
            meaning="the arm is of this kind",
        ),
        laws.check(
            "controller_form",
            {"f": in_z.xreplace(onto), "g": exact.named(exact.form.input_fields_in_z)},
            f"{_ON_ARM}; T(0) = 0, also asked for here, is judged below (22)",
        ),
        laws.check("transformation_rule", {"T": exact.named(exact.form.map.forward)}, _ON_ARM),
        laws.check("transformation", {"rule": exact.named(exact.form.map.forward)}, _ON_ARM),
        laws.check("controllability_rule", {"columns": exact.named(exact.brackets)}, _ON_ARM),
        laws.check("law_in_new_coordinates", {"rule": law_in_z}, _ON_ARM),
    ]


def _observer(laws: _Laws) -> list[Judged]:
    exact = laws.exact
    jacobian = exact.named(exact.observer_form.jacobian)
    drift, output = exact.named(exact.view.f), exact.named(exact.view.h)[0]
    new = exact.named(exact.observer_form.map.forward)
    in_z = _onto_z(exact, jacobian.inv() * drift)
    last = sp.ImmutableDenseMatrix([[0, 0, 1]])
    return [
        replace(laws, names={**laws.names, "alpha": laws.names["alpha"].subs(Y, Z[2])}).check(
            "observer_form", {"right": in_z, "c": exact.observer_form.C}, _ON_ARM
        ),
        laws.check("chain_rule", {"right": _onto_z(exact, drift)}, _ON_ARM),
        laws.check("jacobian_columns", {"columns": new.jacobian(X).inv()}, _ON_ARM),
        laws.check("column_recursion", {"columns": jacobian}, _ON_ARM),
        laws.check("columns_from_start", {"columns": jacobian}, _ON_ARM),
        laws.check("output_in_new_coordinates", {"y": _onto_z(exact, sp.Matrix([output]))[0]}, _ON_ARM),
        laws.check("output_condition", {"left": last, "right": sp.Matrix([[output]]).jacobian(X) * jacobian}, _ON_ARM),
        laws.check(
            "first_condition",
            {"left": sp.zeros(1, 1), "right": sp.Matrix([[output]]).jacobian(X) * jacobian[:, 0]},
            _ON_ARM,
        ),
        laws.check(
            "starting_condition",
            {"rows": exact.named(exact.differentials), "right": exact.named(exact.differentials) * jacobian[:, 0]},
            _ON_ARM,
        ),
    ]


def _estimator(laws: _Laws) -> list[Judged]:
    exact = laws.exact
    hats = [sp.Symbol(s.name, real=True) for s in exact.observer_in_z.system.states]
    rates = exact.named(sp.Matrix(exact.observer_in_z.system.rates).xreplace(dict(zip(hats, _ZBAR, strict=True))))
    true_rates = _onto_z(exact, exact.named(exact.observer_form.jacobian).inv() * exact.named(exact.view.f))
    seen = rates.subs({U: 0, Y: Z[2]}, simultaneous=True)
    return [
        laws.check("observer", {"right": rates.subs(U, 0)}, _ON_ARM),
        laws.check("error_dynamics", {"e": _ZBAR - sp.Matrix(Z), "right": seen - true_rates}, _ON_ARM),
        laws.check("estimator_rule", {"right": rates}, _ON_ARM),
        laws.check("estimation_error", {"right": true_rates - seen}, _ON_ARM),
    ]


def _onto_z(exact: Exact, field: sp.MatrixBase) -> sp.ImmutableDenseMatrix:
    """A field in x written in the coordinates of the observer form."""
    old = exact.named(exact.observer_form.jacobian) * sp.Matrix(Z)
    return sp.ImmutableDenseMatrix(field.subs(dict(zip(X, old, strict=True)), simultaneous=True).applyfunc(sp.expand))


def _names(exact: Exact) -> dict[str, Any]:
    """What the names in the printed laws stand for, on the arm."""
    named = exact.named
    f, g, h = named(exact.view.f), named(exact.view.g), named(exact.view.h)[0]
    T, J = named(exact.form.map.forward), named(exact.observer_form.jacobian)
    in_z = named(exact.drift_in_z)
    gains = exact.law.gains
    return {
        **_calculus(f),
        "f": f,
        "g": g,
        "h": h,
        "T": T,
        "T1": T[0],
        "fbar3": in_z[2],
        **{f"k{i + 1}": gains[i] for i in range(3)},
        "A": exact.observer_form.A,
        "L": gains_in_form(exact.observer),
        "c": exact.observer_form.C,
        "z": sp.Matrix(Z),
        "zbar": _ZBAR,
        "e": _ZBAR - sp.Matrix(Z),
        "y": Y,
        "alpha": named(exact.observer_form.drift_injection),
        "gamma": named(exact.observer_form.injection),
        "fbar": _onto_z(exact, J.inv() * f),
        "J": J,
        "J1": J[:, 0],
        "J2": J[:, 1],
        "J3": J[:, 2],
    }


def _calculus(field: sp.MatrixBase) -> dict[str, Any]:
    """D, ∇, transposition, bracket and Lie derivative along the field, as the laws call them."""

    def jacobian(value: sp.Expr | sp.MatrixBase) -> sp.MatrixBase:
        return sp.Matrix(value if isinstance(value, sp.MatrixBase) else [value]).jacobian(X)

    def along(value: sp.Expr | sp.MatrixBase) -> sp.Expr:
        if isinstance(value, sp.MatrixBase):
            raise TypeError("a Lie derivative of a function is taken of a vector")
        return lie_derivative(value, field, X)

    return {
        "D": jacobian,
        "nabla": lambda value: jacobian(value).T,
        "transpose": lambda value: value.T,
        "bracket": lambda first, second: lie_bracket(first, second, X),
        "Lf": along,
    }


def _against(
    entry: Entry, exact: sp.Expr | sp.MatrixBase, names: Mapping[str, Any], *, place: str, meaning: str
) -> Comparison:
    """An entry evaluated as printed; where that is impossible, with the vector T read as its component T₁."""
    text = _text(entry)
    try:
        return compare_law(_value(entry, names), exact, text=text, place=place, meaning=meaning)
    except FormulaError:
        pass
    repaired = compare_law(_value(entry, {**names, "T": names["T1"]}), exact, text=text, place=place)
    if repaired.finding is Finding.STATEMENT:
        words = "T stands where T₁ is meant: the Lie derivative is one of a function, not of the whole vector"
    else:
        words = "it cannot be evaluated"
    return Comparison(place=place, printed=text, exact=exact, finding=Finding.MISPRINT, meaning=words)


def _value(entry: Entry, names: Mapping[str, Any]) -> sp.Expr | sp.MatrixBase:
    """A text as it evaluates; texts as rows of numbers, or columns side by side where each is a column."""
    if isinstance(entry, str):
        return read_formula(entry, names)
    rows: list[Any] = [
        read_formula(row, names) if isinstance(row, str) else [read_formula(cell, names) for cell in row]
        for row in entry
    ]
    if isinstance(rows[0], sp.MatrixBase):
        return sp.Matrix.hstack(*rows) if rows[0].cols == 1 else sp.Matrix.vstack(*rows)
    return sp.Matrix(rows)


def _text(entry: Entry | Sequence[str]) -> str:
    return entry if isinstance(entry, str) else ", ".join(_text(part) for part in entry)
