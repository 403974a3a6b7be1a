"""What the library makes of the paper's plant: forms, law, observer, each exact and from the plant alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.design import (
    Law,
    LinearisingForm,
    Observer,
    ObserverForm,
    Poles,
    controller_form,
    error_matrix,
    exact_observer,
    gains_in_form,
    injected_observer,
    observer_form,
    state_feedback,
)
from ulna.geometry import accessibility, observability
from ulna.plants import model
from ulna.studies.paper.chain import XBAR, Choices, U, X, Y, Z
from ulna.studies.paper.notation import read_formula
from ulna.studies.paper.printed import Paper
from ulna.system import ControlAffine, System, control_affine

PLANT = "one_link_arm"


@dataclass(frozen=True, slots=True, kw_only=True)
class Exact:
    """The paper's design done exactly.

    Attributes:
        plant: the arm with its numbers; view: its control-affine view.
        choices: the poles.
        form, law: controller form and feedback law.
        observer_form, observer: observer form and estimator in the plant's coordinates.
        observer_in_z: the same estimator in the coordinates of the form.
        brackets: controllability matrix Q; differentials: observability matrix.
        drift_in_z: the drift in the coordinates of the controller form.
    """

    plant: System
    view: ControlAffine
    choices: Choices
    form: LinearisingForm
    law: Law
    observer_form: ObserverForm
    observer: Observer
    observer_in_z: Observer
    brackets: sp.ImmutableDenseMatrix
    differentials: sp.ImmutableDenseMatrix
    drift_in_z: sp.ImmutableDenseMatrix

    @property
    def names(self) -> dict[sp.Symbol, sp.Symbol]:
        """The plant's symbols → the paper's: x1, x2, x3, their estimates, z1, z2, z3, y, u."""
        hats = [sp.Symbol(f"{s.name}_hat", real=True) for s in self.view.x]
        pairs = [
            *zip(self.view.x, X, strict=True),
            *zip(hats, XBAR, strict=True),
            *zip(self.form.map.new, Z, strict=True),
            *zip(self.observer_form.map.new, Z, strict=True),
            (self.observer_form.y[0], Y),
            (self.view.u[0], U),
        ]
        return dict(pairs)

    def named(self, entries: sp.MatrixBase | Sequence[sp.Expr]) -> sp.ImmutableDenseMatrix:
        """A matrix, or entries as a column, in the paper's names."""
        matrix = sp.ImmutableDenseMatrix(entries if isinstance(entries, sp.MatrixBase) else list(entries))
        return sp.ImmutableDenseMatrix(matrix.xreplace(self.names))


def paper_choices(paper: Paper) -> Choices:
    """The poles that the paper chooses, as it prints them; the real one with the sign that the text needs (−8)."""

    def number(key: str, name: str) -> sp.Rational:
        entry = paper.entry(key, name)
        return read_formula(entry) if isinstance(entry, str) else entry

    poles = [read_formula(str(pole)) for pole in paper.entry("observer_gain", "poles")]
    return Choices(
        damping=number("controller_poles", "damping"),
        frequency=number("controller_poles", "frequency"),
        real_pole=-sp.Abs(number("controller_poles", "real_pole")),
        observer_poles=(poles[0], poles[1], poles[2]),
    )


def exact_design(choices: Choices) -> Exact:
    """Return the whole design for the arm of the catalogue."""
    plant = model(PLANT).with_values()
    form, seen = controller_form(plant), observer_form(plant)
    gains = Poles(*choices.observer_poles)
    return Exact(
        plant=plant,
        view=control_affine(plant),
        choices=choices,
        form=form,
        law=state_feedback(form, Poles(*choices.controller_poles)),
        observer_form=seen,
        observer=exact_observer(seen, gains),
        observer_in_z=injected_observer(seen, gains),
        brackets=accessibility(plant).matrix,
        differentials=observability(plant).matrix,
        drift_in_z=form.drift_in_z,
    )


def known_results(exact: Exact) -> Mapping[str, sp.ImmutableDenseMatrix]:
    """The library's results by key of the step in the chain; each must be what the chain computes step by step."""
    form, seen, named = exact.form, exact.observer_form, exact.named
    u = exact.law.expressions
    rates = sp.Matrix(exact.observer.system.rates).applyfunc(sp.expand)
    estimates = [sp.Symbol(s.name, real=True) for s in exact.observer.system.states]
    slopes = rates.jacobian(estimates)
    to_old = seen.map.forward.jacobian(list(exact.view.x))
    found = {
        "f": exact.view.f,
        "g": exact.view.g,
        "Q": exact.brackets,
        "T": form.map.forward,
        "inverse": _required(form.map.inverse),
        "jacobian": form.map.jacobian,
        "f_z": exact.drift_in_z,
        "g_z": form.input_fields_in_z,
        "k": exact.law.gains.T,
        "u": u,
        "u_bar": u.xreplace(dict(zip(exact.view.x, estimates, strict=True))),
        "O": exact.differentials,
        "tau": seen.starting_fields[0],
        "J": seen.jacobian,
        "J_inverse": to_old,
        "A": seen.A,
        "gamma": seen.injection,
        "c": seen.C,
        "L": gains_in_form(exact.observer),
        "A_51": error_matrix(exact.observer),
        "L_53": -slopes[:, 0],
        "A_53": sp.Matrix.hstack(sp.zeros(3, 1), slopes[:, 1:]),
        "A_52": slopes,
        "g_53": rates.diff(exact.view.u[0]),
    }
    return {key: named(value).applyfunc(sp.expand) for key, value in found.items()}


def _required(inverse: sp.ImmutableDenseMatrix | None) -> sp.ImmutableDenseMatrix:
    if inverse is None:
        raise ArithmeticError("the transformation (26) has an inverse, and none was found")
    return inverse
