"""Output transformations of a plant with several outputs, one function for each: ỹ_i = ψ_i(y_i).

With ξ_{j,l} = L_f^l h_j and weight l for ξ_{·,l}, a plant that has the form in some Ψ(y) has L_f^κ h_r as a polynomial
of weight ≤ κ whose coefficients are functions of y. So in every block of size κ = κ_r ≥ 2 the coefficients

    Γ^r_{jm} = ∂²L_f^κ h_r / ∂ξ_{j,κ−1} ∂ξ_{m,1},    κ_j ≥ κ, κ_m ≥ 2,

must be functions of y, whatever Ψ is. For blocks of one size the form in Ψ asks ∂_m ∂_j ψ = −Σ_r Γ^r_{jm} ∂_r ψ / κ for
each of its functions: a flat symmetric connection, whose p solutions are unique up to a linear mixture. Where it does
not mix the outputs, ψ_i''/ψ_i' = −Γ^i_{ii}/κ_i gives them one by one; with other sizes this is one way among others.
Sources: Krener and Respondek, SIAM J. Contr. Opt. 23 (1985); Xia and Gao, SIAM J. Contr. Opt. 27 (1989).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import sympy as sp

from ulna.base import Verdict
from ulna.design.observers.linear_error_form import ObserverForm
from ulna.design.observers.observer_blocks import BlockFrame, block_frame
from ulna.design.observers.observer_chain import NotOfOutputsError, of_outputs
from ulna.design.observers.observer_coordinates import in_other_outputs
from ulna.design.observers.output_functions import (
    OutputSection,
    exponential,
    integral_over_output,
    output_section,
    output_symbols,
)
from ulna.design.observers.refutation_at_points import refuted_by_two_points
from ulna.geometry import observability
from ulna.symbolic.exact import SampledZero, is_zero, tidy
from ulna.system import System, control_affine

_LARGE = 60
"""Operations in the observability matrix above which two points are looked at before anything is differentiated."""
_SAMPLED = SampledZero(seconds=0)
Connection = dict[tuple[int, int, int], sp.Expr]
"""Γ^r_{jm} ≠ 0 as functions of the state, by (r, j, m)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputFunctions:
    """ψ_i for every output, in the output symbols.

    Attributes:
        symbols: (p,) of the outputs.
        functions: (p,) ψ_i, y_i where nothing has to be done.
        unique: true if no other Ψ, linear mixtures apart, can do what these cannot.
    """

    symbols: tuple[sp.Symbol, ...]
    functions: tuple[sp.Expr, ...]
    unique: bool


def output_functions(system: System) -> OutputFunctions:
    """The functions ψ_i that an observer form asks for.

    Args:
        system: observable, with two or more outputs that are states or can be solved for states.

    Raises:
        NotOfOutputsError: with a refuted verdict if no output transformation can help, undecided if outputs would
            have to be mixed or an integral is not found.
    """
    section = output_section(control_affine(system))
    seen = observability(system)
    if max(seen.indices) > 2 or sum(e.count_ops() for e in seen.matrix) > _LARGE:
        sizes = seen.indices
        fastest = [(r, (j, sizes[j] - 1), (m, 1)) for r, j, m in _places(sizes)]
        quick = refuted_by_two_points(seen, fastest)
        if quick.fails:
            raise NotOfOutputsError(quick)
    frame = block_frame(section, seen)
    if frame is None:
        raise NotOfOutputsError(Verdict.undecided("derivatives of the outputs as coordinates", tried="their inverse"))
    sizes = frame.indices
    equal = len(set(sizes)) == 1
    connection = _connection(frame)
    mixed = {key: value for key, value in connection.items() if len(set(key)) > 1} or _crossed(frame, connection)
    if equal and mixed:
        _require_flat(frame, connection)
    if mixed:
        claim, (r, j, m) = "every output has a function of its own", next(iter(mixed))
        why = f"y{r + 1}^({sizes[r]}) holds y{j + 1}^({sizes[r] - 1}) y{m + 1}' times a function of several outputs"
        if r != j or j != m:
            why = f"y{r + 1}^({sizes[r]}) holds y{j + 1}^({sizes[r] - 1}) y{m + 1}'"
        raise NotOfOutputsError(Verdict.undecided(claim, tried="one function for each output", mixing=why))
    functions = []
    for i, (size, y) in enumerate(zip(sizes, section.y, strict=True)):
        if (i, i, i) not in connection:
            functions.append(y)
            continue
        phi = of_outputs(section, -connection[i, i, i] / size, f"ψ_{i + 1}''/ψ_{i + 1}'")
        functions.append(_integrated_twice(section, tidy(phi, seconds=0.3), i))
    drift_only = not any(control_affine(system).g)
    return OutputFunctions(
        symbols=section.y, functions=tuple(functions), unique=equal or (max(sizes) <= 2 and drift_only)
    )


def _places(sizes: Sequence[int]) -> list[tuple[int, int, int]]:
    """(r, j, m) of the coefficients Γ^r_{jm}; with κ = 2 those with j > m are the same again."""
    p = range(len(sizes))
    return [
        (r, j, m)
        for r, j, m in product(p, repeat=3)
        if 2 <= sizes[r] <= sizes[j] and sizes[m] >= 2 and not (sizes[r] == 2 and m < j)
    ]


def _connection(frame: BlockFrame) -> Connection:
    """The Γ that do not vanish.

    Raises:
        NotOfOutputsError: refuted for every Ψ if an entry is not a function of the outputs.
    """
    section, sizes = frame.section, frame.indices
    found: Connection = {}
    tops = {r: frame.lie(section.view.h[r], size) for r, size in enumerate(sizes) if size >= 2}
    for r, j, m in _places(sizes):
        entry = frame.slope(frame.slope(tops[r], j, sizes[r] - 1), m, 1)
        if is_zero(entry, test=_SAMPLED).holds:
            continue
        judged = section.depends_on_outputs_only(entry)
        if not judged.holds:
            claim = f"the coefficient of y{j + 1}^({sizes[r] - 1}) y{m + 1}' in y{r + 1}^({sizes[r]}) is one of y"
            evidence = {**judged.evidence, "any_psi": True} if judged.fails else judged.evidence
            raise NotOfOutputsError(replace(judged, claim=claim, evidence=evidence))
        found[r, j, m] = entry
        if sizes[r] == 2:
            found[r, m, j] = entry
    return found


def _crossed(frame: BlockFrame, connection: Connection) -> Connection:
    """Entries Γ^i_{ii} that depend on other outputs with derivatives of their own."""
    others = [j for j, size in enumerate(frame.indices) if size >= 2]
    return {
        (i, j, m): value
        for (i, j, m), value in connection.items()
        if i == j == m and any(not is_zero(frame.slope(value, k, 0), test=_SAMPLED).holds for k in others if k != i)
    }


def _require_flat(frame: BlockFrame, connection: Connection) -> None:
    """Refuse a connection without p parallel gradients: it is not symmetric or has curvature.

    Raises:
        NotOfOutputsError: refuted for every Ψ.
    """
    p, size = len(frame.indices), frame.indices[0]
    A = {key: -value / size for key, value in connection.items()}
    zero = sp.Integer(0)

    def slope(r: int, j: int, m: int, k: int) -> sp.Expr:
        return frame.slope(A[r, j, m], k, 0) if (r, j, m) in A else zero

    def product_of(r: int, j: int, k: int, m: int) -> sp.Expr:
        return sum((A[s, j, m] * A[r, s, k] for s in range(p) if (s, j, m) in A and (r, s, k) in A), zero)

    residuals = [A.get((r, j, m), zero) - A.get((r, m, j), zero) for r in range(p) for j in range(p) for m in range(j)]
    for r, j, k, m in product(range(p), repeat=4):
        if k < m:
            turned = product_of(r, j, k, m) - product_of(r, j, m, k)
            residuals.append(slope(r, j, m, k) - slope(r, j, k, m) + turned)
    claim = "the equations ∂_m ∂_j ψ = −Σ_r Γ^r_{jm} ∂_r ψ / κ have as many solutions as outputs"
    for residual in residuals:
        judged = is_zero(residual, test=_SAMPLED)
        if judged.fails:
            evidence = {**judged.evidence, "curvature": tidy(residual, seconds=0.3), "any_psi": True}
            raise NotOfOutputsError(Verdict.refuted(claim, **evidence))


def _integrated_twice(section: OutputSection, phi: sp.Expr, i: int) -> sp.Expr:
    """ψ with ψ''/ψ' = φ.

    Raises:
        NotOfOutputsError: undecided if one of the integrals is not found.
    """
    y = section.y[i]
    exponent = integral_over_output(section, phi, index=i)
    slope = None if exponent is None else exponential(exponent, y)
    psi = None if slope is None else integral_over_output(section, slope, index=i)
    if psi is None:
        shown = f"ψ''/ψ' = {phi}" if slope is None else f"ψ' = {slope}"
        raise NotOfOutputsError(Verdict.undecided(f"ψ_{i + 1} in closed form", tried=shown))
    return sp.factor_terms(psi).as_independent(y, as_Add=False)[1]


def with_outputs_replaced(system: System, found: OutputFunctions) -> System:
    """The plant that measures ψ_i(h) in place of h_i."""
    readouts = system.inline(system.readouts)
    at = dict(zip(found.symbols, readouts, strict=True))
    return replace(system, readouts=tuple(psi.xreplace(at) for psi in found.functions), definitions=())


def in_measured_outputs(system: System, form: ObserverForm, found: OutputFunctions) -> ObserverForm:
    """The form of the plant with replaced outputs as one of the plant itself: ỹ written in y."""
    view = control_affine(system)
    rename = dict(zip(found.symbols, output_symbols(view.system), strict=True))
    written = in_other_outputs(form, view, [psi.xreplace(rename) for psi in found.functions])
    short = partial(tidy, seconds=0.2)
    return replace(
        written,
        drift_injection=written.drift_injection.applyfunc(short),
        input_injection=written.input_injection.applyfunc(short),
    )
