"""The numbers of the paper, (16) to (54), as one chain of steps: how each follows from the ones before it.

The exact values come out of the plant alone; where the library computes the same value by its own methods, it is handed
in as `known` and must be the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import sympy as sp

from ulna.geometry import iterated_bracket, lie_bracket, lie_derivative
from ulna.studies.paper.carry import Step, Values, rows_of
from ulna.studies.paper.printed import Paper

X: Final = sp.symbols("x1:4", real=True)
"""The paper's state: angle, angular velocity, current."""
Z: Final = sp.symbols("z1:4", real=True)
XBAR: Final = sp.symbols("xbar1:4", real=True)
Y, U = sp.symbols("y u", real=True)
_S: Final = sp.Symbol("s")

_HALF: Final = sp.Rational(1, 2)
_FOUR: Final = sp.Integer(4)
_MINUS_EIGHT: Final = sp.Integer(-8)
_OBSERVER_POLES: Final = (sp.Integer(-9), sp.Integer(-10), sp.Integer(-11))

Known = Mapping[str, sp.ImmutableDenseMatrix]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """What the paper chooses freely, exactly: poles of loop and estimator. The paper prints 8 for the pole −8."""

    damping: sp.Rational = _HALF
    frequency: sp.Rational = _FOUR
    real_pole: sp.Rational = _MINUS_EIGHT
    observer_poles: tuple[sp.Rational, ...] = _OBSERVER_POLES

    @property
    def controller_poles(self) -> tuple[sp.Expr, ...]:
        """The three poles of the loop."""
        real = -self.damping * self.frequency
        imaginary = self.frequency * sp.sqrt(1 - self.damping**2)
        return (real + sp.I * imaginary, real - sp.I * imaginary, self.real_pole)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Builder:
    """Makes steps out of the printed entries."""

    paper: Paper
    known: Known

    def step(self, key: str, passage: str, name: str, needs: str, compute: Callable[[Values], object]) -> Step:
        source = self.paper.passage(passage)
        return Step(
            key=key,
            label=source.label,
            printed=rows_of(source.printed[name]),
            needs=tuple(needs.split()),
            compute=lambda values: _matrix(compute(values)),
            known=self.known.get(key),
            passage=passage,
            entry=name,
        )

    def column(
        self, key: str, passage: str, name: str, index: int, needs: str, compute: Callable[[Values], object]
    ) -> Step:
        """One column of a printed matrix, where the next one follows from it as printed; not listed by itself."""
        whole = self.step(key, passage, name, needs, compute)
        return replace(whole, printed=tuple((row[index],) for row in whole.printed), listed=False)


def number_chain(
    paper: Paper,
    drift: sp.ImmutableDenseMatrix,
    input_field: sp.ImmutableDenseMatrix,
    *,
    choices: Choices | None = None,
    known: Known = MappingProxyType({}),
) -> tuple[Step, ...]:
    """Return the steps from the model (16) to the law of the compensator (54).

    Args:
        paper: the printed entries.
        drift: f of the plant with its numbers, exact, in x1, x2, x3; shape (3, 1).
        input_field: g, likewise.
        choices: poles.
        known: results that the library computes by itself, by key of the step.
    """
    build = _Builder(paper=paper, known=known)
    given = choices or Choices()
    return (
        build.step("f", "model", "f", "", lambda _: drift),
        build.step("g", "model", "g", "", lambda _: input_field),
        *_controller_form(build),
        *_law(build, given),
        *_observer_form(build),
        *_estimator(build, given),
    )


def _controller_form(build: _Builder) -> tuple[Step, ...]:
    return (
        build.step("Q", "controllability", "Q", "f g", lambda v: _brackets(v["f"], v["g"])),
        build.step("q", "first_component", "q", "Q", lambda v: v["Q"].inv()[2, :]),
        build.step("T1", "first_component", "T1", "q", lambda v: v["q"] * sp.Matrix(X)),
        build.step("T", "transformation", "T", "T1 f", lambda v: _lie_chain(v["T1"][0], v["f"])),
        build.step("inverse", "inverse_transformation", "inverse", "T", lambda v: _inverse(v["T"])),
        build.step("jacobian", "jacobian", "jacobian", "T", lambda v: v["T"].jacobian(X)),
        build.step(
            "f_z", "arm_in_controller_form", "f", "T inverse f", lambda v: _carried(v["T"], v["inverse"], v["f"])
        ),
        build.step(
            "g_z", "arm_in_controller_form", "g", "T inverse g", lambda v: _carried(v["T"], v["inverse"], v["g"])
        ),
    )


def _law(build: _Builder, given: Choices) -> tuple[Step, ...]:
    bars = dict(zip(X, XBAR, strict=True))
    return (
        build.step("fbar3", "law_in_new_coordinates", "fbar3", "f_z", lambda v: v["f_z"][2]),
        build.step("damping", "controller_poles", "damping", "", lambda _: given.damping),
        build.step("frequency", "controller_poles", "frequency", "", lambda _: given.frequency),
        build.step("real_pole", "controller_poles", "real_pole", "", lambda _: given.real_pole),
        build.step("pair_real", "controller_poles", "pair_real", "damping frequency", lambda v: _pair(v)[0]),
        build.step("pair_imaginary", "controller_poles", "pair_imaginary", "damping frequency", lambda v: _pair(v)[1]),
        build.step("k", "gains", "k", "damping frequency real_pole", _gains),
        build.step("A_loop", "closed_loop", "A", "k", lambda v: _companion(v["k"])),
        build.step("u", "law", "u", "T f k", _law_in_x),
        build.step("u_bar", "compensator_law", "u", "u", lambda v: v["u"].xreplace(bars)),
    )


def _observer_form(build: _Builder) -> tuple[Step, ...]:
    return (
        build.step("O", "observability", "O", "f", lambda v: _lie_chain(X[0], v["f"]).jacobian(X)),
        build.step("tau", "starting_vector", "tau", "O", lambda v: v["O"].inv()[:, 2]),
        build.column("J_2", "observer_jacobian", "J", 1, "f tau", lambda v: _bracket(v["f"], v["tau"])),
        build.column("J_3", "observer_jacobian", "J", 2, "f J_2", lambda v: _bracket(v["f"], v["J_2"])),
        build.step(
            "J", "observer_jacobian", "J", "tau J_2 J_3", lambda v: sp.Matrix.hstack(v["tau"], v["J_2"], v["J_3"])
        ),
        build.step("forward", "observer_transformation", "forward", "J", lambda v: v["J"]),
        build.step("J_inverse", "observer_transformation", "inverse", "J", lambda v: v["J"].inv()),
        build.step("A", "arm_in_observer_form", "A", "J f", lambda v: _linear_part(_in_observer_form(v["J"], v["f"]))),
        build.step("gamma", "arm_in_observer_form", "gamma", "J f g", _injection),
        build.step("c", "arm_in_observer_form", "c", "J", lambda v: v["J"][0, :]),
    )


def _estimator(build: _Builder, given: Choices) -> tuple[Step, ...]:
    new, old, end = "estimator_in_new_coordinates", "estimator_in_old_coordinates", "estimator"
    poles = sp.Matrix(given.observer_poles)
    return (
        build.step("poles", "observer_gain", "poles", "", lambda _: poles),
        build.step("L", "observer_gain", "L", "poles", lambda v: _coefficients(list(v["poles"]))),
        build.step("A_51", new, "A", "A L c", lambda v: v["A"] - v["L"] * v["c"]),
        build.step("L_51", new, "L", "L", lambda v: v["L"]),
        build.step("gamma_51", new, "gamma", "gamma", lambda v: v["gamma"]),
        build.step("c_51", new, "c", "c", lambda v: v["c"]),
        build.step("A_52", old, "A", "J A_51", lambda v: v["J"] * v["A_51"] * v["J"].inv()),
        build.step("L_52", old, "L", "J L_51", lambda v: v["J"] * v["L_51"]),
        build.step("gamma_52", old, "gamma", "J gamma_51", lambda v: v["J"] * v["gamma_51"]),
        build.step("A_53", end, "A", "A_52", lambda v: _without_first_column(v["A_52"])),
        build.step("L_53", end, "L", "A_52", lambda v: -v["A_52"][:, 0]),
        build.step("injection", end, "injection", "gamma_52 L_52 L_53", _remaining_injection),
        build.step("g_53", end, "g", "gamma_52", lambda v: v["gamma_52"].diff(U)),
        build.step("c_53", end, "c", "c J_inverse", lambda v: v["c"] * v["J_inverse"]),
    )


def _matrix(value: object) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(value if isinstance(value, sp.MatrixBase) else [value]).applyfunc(sp.expand)


def _brackets(field: sp.MatrixBase, start: sp.MatrixBase) -> sp.MatrixBase:
    """The columns start, [f, start], [f, [f, start]], as in (24) and (39)."""
    return sp.Matrix.hstack(*(sp.Matrix(iterated_bracket(field, start, X, k)) for k in range(3)))


def _bracket(first: sp.MatrixBase, second: sp.MatrixBase) -> sp.ImmutableDenseMatrix:
    return lie_bracket(first, second, X)


def _lie_chain(function: sp.Expr, field: sp.MatrixBase) -> sp.MatrixBase:
    """The column h, L_f h, L_f² h, as in (23)."""
    chain = [function]
    while len(chain) < 3:
        chain.append(sp.expand(lie_derivative(chain[-1], field, X)))
    return sp.Matrix(chain)


def _inverse(forward: sp.MatrixBase) -> sp.MatrixBase:
    """x from z = T(x) for a T that is linear in x1, in x2, and in x3 beside a function of x1, as (26) is."""
    x1 = Z[0] / forward[0].diff(X[0])
    x2 = Z[1] / forward[1].diff(X[1])
    rest = forward[2].subs(X[2], 0).subs({X[0]: x1, X[1]: x2})
    return sp.Matrix([x1, x2, (Z[2] - rest) / forward[2].diff(X[2])])


def _carried(forward: sp.MatrixBase, inverse: sp.MatrixBase, field: sp.MatrixBase) -> sp.MatrixBase:
    """(∂T/∂x) f at x = T⁻¹(z)."""
    return (forward.jacobian(X) * field).subs(dict(zip(X, inverse, strict=True)), simultaneous=True)


def _pair(v: Values) -> tuple[sp.Expr, sp.Expr]:
    damping, frequency = v["damping"][0], v["frequency"][0]
    return -damping * frequency, frequency * sp.sqrt(1 - damping**2)


def _gains(v: Values) -> sp.MatrixBase:
    """Coefficients of (s² + 2ζω s + ω²)(s − p), from s⁰ upward."""
    damping, frequency, pole = v["damping"][0], v["frequency"][0], v["real_pole"][0]
    polynomial = sp.Poly((_S**2 + 2 * damping * frequency * _S + frequency**2) * (_S - pole), _S)
    return sp.Matrix(polynomial.all_coeffs()[:0:-1])


def _coefficients(poles: list[sp.Expr]) -> sp.MatrixBase:
    return sp.Matrix(sp.Poly(sp.prod(_S - pole for pole in poles), _S).all_coeffs()[:0:-1])


def _companion(gains: sp.MatrixBase) -> sp.MatrixBase:
    return sp.Matrix([[0, 1, 0], [0, 0, 1], list(-gains)])


def _law_in_x(v: Values) -> sp.Expr:
    """u = −L_f T₃ − k·T(x): (30) with z = T(x)."""
    return -lie_derivative(v["T"][2], v["f"], X) - v["k"].dot(v["T"])


def _in_observer_form(jacobian: sp.MatrixBase, field: sp.MatrixBase) -> sp.MatrixBase:
    """J⁻¹ f(J z): the drift in the observer's coordinates."""
    old = jacobian * sp.Matrix(Z)
    return (jacobian.inv() * field.subs(dict(zip(X, old, strict=True)), simultaneous=True)).applyfunc(sp.expand)


def _linear_part(field: sp.MatrixBase) -> sp.MatrixBase:
    """What is linear in z1 and z2; everything in z3 = y belongs to the injection."""
    return sp.Matrix.hstack(field.diff(Z[0]), field.diff(Z[1]), sp.zeros(3, 1))


def _injection(v: Values) -> sp.MatrixBase:
    drift = _in_observer_form(v["J"], v["f"]).subs({Z[0]: 0, Z[1]: 0, Z[2]: Y}, simultaneous=True)
    return drift + v["J"].inv() * v["g"] * U


def _without_first_column(matrix: sp.MatrixBase) -> sp.MatrixBase:
    return sp.Matrix.hstack(sp.zeros(3, 1), matrix[:, 1:])


def _remaining_injection(v: Values) -> sp.MatrixBase:
    """What of (52) is neither linear in the estimate nor the correction L(ȳ − y): γ + L₅₂ y − L₅₃ y, without input."""
    return v["gamma_52"].subs(U, 0) + (v["L_52"] - v["L_53"]) * Y
