"""State estimators: the observer with linear error dynamics (paper eq. 49-53), and what all observers share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import sympy as sp

from ulna.base import DesignError, Verdict
from ulna.design.gains import Gains, gain_matrix, gain_rule, roots_of
from ulna.design.observers.linear_error_form import ObserverForm
from ulna.design.observers.observer_coordinates import observer_form
from ulna.design.observers.output_functions import output_symbols
from ulna.plants import PlantLike
from ulna.symbolic.exact import attempt, tidy
from ulna.system import ControlAffine, KalmanFilter, LinearInjection, Signal, System

_SECONDS = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """An estimator of the plant's states from its inputs and outputs, of whatever kind.

    All kinds keep one contract: with no innovation, y = h(x̂), the estimates move as the plant does; and the innovation
    enters as x̂' = f(x̂) + g(x̂) u − L (ŷ − y), L the `gains`.

    Attributes:
        plant: what is observed.
        system: the estimator: inputs the plant's inputs, then its outputs; outputs the estimates `<state>_hat`.
        polynomials: for each block the coefficients a₀ … a_{r−1} of the characteristic polynomial of the error's linear
            part; empty for a Kalman filter, whose gain varies.
        verdict: on what the convergence rests (the form by substitution; the triangular structure; observability).
        form: the observer form it was designed in, where the error is exactly linear; None for other kinds.
        initial: values at which further states of the estimator (a covariance) start; the estimates start at zero.
        sampled: what a processor runs instead of steps of its rates: of an observer in the form's coordinates its
            linear part and what is injected, of a Kalman filter the plant's rates, innovations and densities.

    Examples:
        >>> observer = ulna.exact_observer("duffing", [-5, -6])
        >>> observer.poles
        ((-6+0j), (-5+0j))
    """

    plant: System
    system: System
    polynomials: tuple[tuple[sp.Expr, ...], ...]
    verdict: Verdict
    form: ObserverForm | None = None
    initial: Mapping[str, sp.Expr] = field(default_factory=dict)
    sampled: LinearInjection | KalmanFilter | None = None

    @property
    def gains(self) -> sp.ImmutableDenseMatrix:
        """(n, p) L = ∂x̂'/∂y at y = h(x̂), in the observer's states and the plant's inputs.

        x̂' = f + g u − L (ŷ − y) holds exactly for a high-gain observer and a Kalman filter, and to first order in the
        innovation where functions of y are injected.
        """
        estimates = sp.Matrix(self.system.inline(self.system.readouts))
        rates = estimates.jacobian(list(self.system.state_symbols)) * sp.Matrix(self.system.inline(self.system.rates))
        onto = dict(zip(self.plant.state_symbols, estimates, strict=True))
        shown = [e.xreplace(onto) for e in self.plant.inline(self.plant.readouts)]
        y = output_symbols(self.plant)
        slopes = rates.jacobian(list(y)).xreplace(dict(zip(y, shown, strict=True)))
        return sp.ImmutableDenseMatrix(slopes.applyfunc(lambda e: tidy(e, seconds=0.2)))

    @property
    def poles(self) -> tuple[complex, ...]:
        """The poles of the error's linear part, in 1/s; none of a Kalman filter (parameters need values)."""
        return roots_of(self.polynomials)

    def __repr__(self) -> str:
        return f"Observer of '{self.plant.name}'\n{self.system!r}"

    def _repr_latex_(self) -> str:
        return self.system._repr_latex_()


def exact_observer(form: ObserverForm | PlantLike, gains: Gains) -> Observer:
    """The observer in the plant's own coordinates, whose error in z is linear with the chosen poles (paper eq. 52-53).

    x̂' = f(x̂) + g(x̂) u + (∂x/∂z)(x̂) [γ(y, u) − γ(ŷ, u) + L (ψ(y) − ψ(ŷ))] with ŷ = h(x̂): no inverse map is needed.

    Args:
        form: the observer form; a plant, its name or its file stands for its observer form.
        gains: poles of A − L C, block after block.

    Raises:
        DesignError: if the gain rule does not fit the blocks.
        NoFormError: if a plant has no observer form.

    Examples:
        >>> [state.name for state in ulna.exact_observer("duffing", [-5, -6]).system.states]
        ['x1_hat', 'x2_hat']
    """
    form = form if isinstance(form, ObserverForm) else observer_form(form)
    view = form.view
    polynomials = gain_rule(gains).polynomials(form.indices)
    L = gain_matrix(form.indices, polynomials)
    onto = dict(zip(view.x, estimate_symbols(view.system), strict=True))
    seen = dict(zip(form.y, (h.xreplace(onto) for h in view.h), strict=True))
    measured = sp.Matrix(form.measured)
    correction = form.injection - form.injection.xreplace(seen) + L * (measured - measured.xreplace(seen))
    rates = controlled_rates(view).xreplace(onto) + form.jacobian.xreplace(onto) * correction
    return Observer(
        plant=view.system,
        system=estimator_system(view.system, [collected(r) for r in rates], "exact observer"),
        polynomials=polynomials,
        verdict=form.verdict,
        form=form,
    )


def injected_observer(form: ObserverForm | PlantLike, gains: Gains) -> Observer:
    """The same observer in z: ẑ' = (A − L C) ẑ + γ(y, u) + L ψ(y) (paper eq. 49-51), estimates x̂ = T⁻¹(ẑ).

    Its `linear` part and what is injected stand apart, so that a processor can hold it exactly between samples.

    Args:
        form: the observer form; a plant, its name or its file stands for its observer form.
        gains: poles of A − L C, block after block.

    Raises:
        DesignError: if the inverse map is not known or the gain rule does not fit the blocks.
        NoFormError: if a plant has no observer form.

    Examples:
        >>> [state.name for state in ulna.injected_observer("duffing", [-5, -6]).system.states]
        ['z1_hat', 'z2_hat']
    """
    form = form if isinstance(form, ObserverForm) else observer_form(form)
    view = form.view
    if form.map.inverse is None:
        raise DesignError(
            f"observer of '{view.system.name}' in z",
            "no inverse of the transformation was found, so estimates of x cannot be given.",
            "Use exact_observer, which works in x and needs no inverse.",
        )
    polynomials = gain_rule(gains).polynomials(form.indices)
    L = gain_matrix(form.indices, polynomials)
    matrix = sp.Matrix(form.A - L * form.C)
    injection = sp.Matrix(form.injection) + L * sp.Matrix(form.measured)
    names = tuple(f"{z.name}_hat" for z in form.map.new)
    hats = sp.Matrix([sp.Symbol(name, real=True) for name in names])
    x_system = estimator_system(view.system, [sp.Integer(0)] * len(view.x), "exact observer in z")
    system = replace(
        x_system,
        states=tuple(Signal(name=name, text="coordinate of the observer form") for name in names),
        rates=tuple(tidy(r, seconds=_SECONDS) for r in matrix * hats + injection),
        readouts=tuple(form.map.inverse.xreplace(dict(zip(form.map.new, hats, strict=True)))),
    )
    onto = dict(zip(view.x, estimate_symbols(view.system), strict=True))
    return Observer(
        plant=view.system,
        system=system,
        polynomials=polynomials,
        verdict=form.verdict,
        form=form,
        sampled=LinearInjection(
            system=system,
            matrix=sp.ImmutableDenseMatrix(matrix.xreplace(view.system.values)),
            injection=tuple(injection),
            start=tuple(form.map.forward.xreplace(onto)),
        ),
    )


def gains_in_form(observer: Observer) -> sp.ImmutableDenseMatrix:
    """(n, p) the constant L of ẑ' = A ẑ + γ(y, u) − L (ψ(ŷ) − ψ(y)).

    Raises:
        DesignError: if the observer was not designed in an observer form.
    """
    return gain_matrix(_form(observer).indices, observer.polynomials)


def error_matrix(observer: Observer) -> sp.ImmutableDenseMatrix:
    """(n, n) A − L C of the linear error dynamics.

    Raises:
        DesignError: if the observer's error is not linear.
    """
    form = _form(observer)
    return sp.ImmutableDenseMatrix(form.A - gains_in_form(observer) * form.C)


def _form(observer: Observer) -> ObserverForm:
    if observer.form is None:
        raise DesignError(
            f"linear error of '{observer.system.name}'",
            "its error dynamics are not linear.",
            "Use exact_observer where the plant has an observer form.",
        )
    return observer.form


def estimate_symbols(plant: System) -> tuple[sp.Symbol, ...]:
    """(n,) symbols `<state>_hat`."""
    return tuple(sp.Symbol(f"{s.name}_hat", real=True) for s in plant.states)


def estimator_system(
    plant: System, rates: Sequence[sp.Expr], kind: str, *, further: Mapping[Signal, sp.Expr] | None = None
) -> System:
    """A `System` with states and outputs `<state>_hat` and inputs the plant's inputs and outputs.

    Args:
        plant: the plant.
        rates: (n,) derivatives of the estimates.
        kind: what it is, for names and errors.
        further: states beyond the estimates, with their derivatives.

    Raises:
        DesignError: if the plant's names leave no room for those of the estimator.
    """
    states = tuple(replace(s, name=f"{s.name}_hat", text=f"estimate of {s.text or s.name}") for s in plant.states)
    measured = tuple(replace(o, name=y.name) for o, y in zip(plant.outputs, output_symbols(plant), strict=True))
    more = dict(further or {})
    clash = {s.name for s in (*states, *more)} & {s.name for s in (*plant.inputs, *measured, *plant.parameters)}
    if clash:
        raise DesignError(
            f"{kind} of '{plant.name}'", f"the plant uses the name {min(clash)} already.", "Rename it there."
        )
    return System(
        name=f"{kind} of {plant.name}",
        text=kind,
        states=(*states, *more),
        rates=(*rates, *more.values()),
        inputs=(*plant.inputs, *measured),
        outputs=states,
        readouts=tuple(s.symbol for s in states),
        parameters=plant.parameters,
    )


def collected(rate: sp.Expr) -> sp.Expr:
    """The rate as a short sum, what the injection cancels taken out, so that it reads as in the paper's eq. 53."""
    expanded = attempt(_SECONDS, "expand", sp.expand, rate)
    if expanded.value is None:
        return tidy(rate, seconds=_SECONDS)
    short = expanded.value
    if sp.count_ops(short) > 2 * sp.count_ops(rate):
        short = rate
    tidied = tidy(short, seconds=_SECONDS)
    return tidied if sp.count_ops(tidied) < sp.count_ops(short) else short


def controlled_rates(view: ControlAffine) -> sp.Matrix:
    """f(x) + g(x) u."""
    u = sp.Matrix(len(view.u), 1, list(view.u))
    return sp.Matrix(view.f) + sp.Matrix(view.g) * u
