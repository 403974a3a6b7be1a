"""Feedback laws: nonlinearities cancelled, the chains of integrators given the chosen dynamics (paper eq. 30-32)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from ulna.base import DesignError, UlnaWarning
from ulna.design.control.evaluation import commands
from ulna.design.control.reference import AbstractReference, ReferenceChain, Regulate
from ulna.design.forms import LinearisingForm, NormalForm, controller_form
from ulna.design.gains import Gains, gain_matrix, gain_rule, roots_of
from ulna.plants import PlantLike
from ulna.symbolic.exact import SampledZero, is_zero, shortened
from ulna.symbolic.formulas import formula, listing
from ulna.system import Signal, System, equilibrium

_NO_GAINS = sp.ImmutableDenseMatrix(0, 0, [])


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """A feedback law on the states of a plant.

    Attributes:
        plant: what it was designed for.
        method: how, and where it holds, in words: `exact, on the whole state`, `local, on the linearisation at …`.
        expressions: (m, 1) the law in x (and references, integrator states).
        system: the law as a system: inputs the plant's states and the references, outputs the plant's inputs;
            it has states only with integral action.
        polynomials: for each chain the coefficients a₀ … of its characteristic polynomial, the integrator's included;
            of a local law the single one of the closed linearisation; empty where nothing is linear.
        gains: (m, n) K, exact: on the chains z, zero outside each chain's own coordinates; of a local law on x − x*;
            empty where there are none.
        integral_gains: (m,) gain on ∫(z₁ − z_ref) of each chain, or empty.
        form: the form it was designed in, with u = β⁻¹ (v − α), v = −K (z − z_ref) + feedforward; None of a local law.

    Examples:
        >>> law = ulna.state_feedback("mass_spring_damper", [-1, -2])
        >>> law(np.zeros((4, 2))).shape
        (4, 1)
    """

    plant: System
    method: str
    expressions: sp.ImmutableDenseMatrix
    system: System
    polynomials: tuple[tuple[sp.Expr, ...], ...] = ()
    gains: sp.ImmutableDenseMatrix = _NO_GAINS
    integral_gains: tuple[sp.Expr, ...] = ()
    form: LinearisingForm | None = None

    @property
    def reads_states(self) -> bool:
        """True: in a loop its inputs are states, whatever outputs of the plant are called."""
        return True

    @property
    def poles(self) -> tuple[complex, ...]:
        """The poles of the chains, or of the closed linearisation, in 1/s (parameters need values)."""
        return roots_of(self.polynomials)

    def __call__(self, states: Sequence[float] | np.ndarray | Mapping[str, Any], /, **given: Any) -> np.ndarray:
        """(m,) what the law tells the plant's inputs at (n,) states, in SI; for (N, n) states (N, m).

        Args:
            states: numbers in the plant's order, rows of them, or by name.
            given: references by name, parameters in place of their own values, states of an integral (else 0).

        Raises:
            DesignError: for another number of states, an unknown name, or a value that is missing.
        """
        return commands(self.plant, self.system, states, given)

    def __repr__(self) -> str:
        rows = zip((u.name for u in self.plant.inputs), self.expressions, strict=True)
        return listing(f"Law of '{self.plant.name}', {self.method}", rows)

    def _repr_latex_(self) -> str:
        from ulna.symbolic.formulas import equation_latex

        return equation_latex(self.plant.input_symbols, self.expressions)


def state_feedback(
    form: LinearisingForm | NormalForm | PlantLike,
    gains: Gains,
    *,
    reference: AbstractReference | None = None,
    integral: bool = False,
) -> Law:
    """The law that gives every chain the characteristic polynomial of the gain rule.

    Args:
        form: controller, input-output or normal form; a plant, its name or its file stands for its controller form.
        gains: poles (`Poles(...)`, a list, a text) or `LinearQuadratic(...)`; with `integral`, one more per chain.
        reference: `Regulate()` (default, the paper's), `SetPoint()` or `Track()`.
        integral: add ∫(z₁ − z_ref) dt to every chain, which removes constant offsets.

    Raises:
        DesignError: if the gain rule does not fit the chains.
        NoFormError: if a plant has no controller form.

    Warns:
        UlnaWarning: if β is singular at the operating point, where the law divides by zero.

    Examples:
        >>> law = ulna.state_feedback("mass_spring_damper", [-1, -2])
        >>> law([0.1, 0.0]).shape
        (1,)
    """
    if isinstance(form, NormalForm):
        form = form.form
    elif not isinstance(form, LinearisingForm):
        form = controller_form(form)
    if not form.indices:
        raise DesignError(f"a law for '{form.system.name}'", "the plant has no inputs.")
    _warn_if_singular(form)
    extra = 1 if integral else 0
    polynomials = gain_rule(gains).polynomials([r + extra for r in form.indices])
    chains = [
        (reference or Regulate()).chain(form.system, output, k, r)
        for k, (output, r) in enumerate(zip(form.outputs, form.indices, strict=True))
    ]
    signals = tuple(s for chain in chains for s in chain.signals)
    memories = tuple(Signal(name=f"e{k + 1}_int", text="integral of the error") for k in range(len(chains) * extra))
    errors = _errors(form, chains)
    v = sp.Matrix([_new_input(k, errors[k], chains[k], polynomials[k], memories) for k in range(len(chains))])
    expressions = sp.ImmutableDenseMatrix((form.beta.inv() * (v - form.alpha)).applyfunc(shortened))
    return Law(
        plant=form.system,
        method=_method(form),
        form=form,
        gains=gain_matrix(form.indices, [p[extra:] for p in polynomials]).T,
        polynomials=polynomials,
        integral_gains=tuple(p[0] for p in polynomials) if integral else (),
        expressions=expressions,
        system=System(
            name=f"law of {form.system.name}",
            text="feedback-linearising law",
            states=memories,
            rates=tuple(errors[k][0] for k in range(len(memories))),
            inputs=(*form.system.states, *signals),
            outputs=form.system.inputs,
            readouts=tuple(expressions),
            parameters=form.system.parameters,
        ),
    )


def _method(form: LinearisingForm) -> str:
    left, dropped = form.internal_dimension, form.verdict.evidence.get("dropped")
    if dropped:
        return f"approximate input-output, dropping {'; '.join(dropped)}"
    if not left:
        return "exact, on the whole state"
    return f"input-output, which leaves {left} of {len(form.system.states)} states to themselves"


def _warn_if_singular(form: LinearisingForm) -> None:
    point = equilibrium(form.system)
    there = form.beta.subs(dict(point.states))
    if there.has(sp.nan, sp.zoo, sp.oo) or is_zero(there.det(method="berkowitz"), test=SampledZero(seconds=0.2)).holds:
        where = ", ".join(f"{x.name} = {formula(value)}" for x, value in point.states.items())
        warnings.warn(
            f"the law of '{form.system.name}' divides by zero at the operating point {where}: det β vanishes there. "
            "Choose another [operating_point], or other outputs.",
            UlnaWarning,
            stacklevel=3,
        )


def _errors(form: LinearisingForm, chains: list[ReferenceChain]) -> list[list[sp.Expr]]:
    """z − z_ref of every chain, in x."""
    errors, start = [], 0
    for chain, order in zip(chains, form.indices, strict=True):
        errors.append([form.chain[start + j] - chain.values[j] for j in range(order)])
        start += order
    return errors


def _new_input(
    k: int, error: list[sp.Expr], chain: ReferenceChain, polynomial: tuple[sp.Expr, ...], memories: tuple[Signal, ...]
) -> sp.Expr:
    """v = z_ref⁽ʳ⁾ − Σ a_j (z_j − z_ref,j), the integral of the first error in front where there is one."""
    terms = ([memories[k].symbol] if memories else []) + error
    return chain.values[-1] - sum((a * e for a, e in zip(polynomial, terms, strict=True)), sp.Integer(0))
