"""Observer form of a plant with several outputs, block by block.

In a block of size κ the chain z_κ = ψ(h), z_{k−1} = L_f z_k − a_k(y) is a statement on one function only,

    L_f^κ ψ(h) = Σ_k L_f^{k−1} a_k(h),

so blocks meet only through the outputs that a_k may depend on. With ξ_{j,l} = L_f^l h_j as coordinates the slopes are
read off from the highest derivatives, ∂a_k/∂y_j = ∂/∂ξ_{j,k−1} of what is left of the left side, for every output j
with κ_j ≥ k. Where κ_j < k the derivative y_j^(k−1) is not a coordinate: κ_j = k − 1 ≥ 2 leaves the second derivatives
of a_k to read, κ_j = 1 leaves a_k free in y_j (it can be moved into a_{k−1}).
Sources: Krener and Respondek, SIAM J. Contr. Opt. 23 (1985); Xia and Gao, SIAM J. Contr. Opt. 27 (1989).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import sympy as sp

from ulna.base import Verdict
from ulna.design.observers.observer_chain import (
    NotOfOutputsError,
    ObserverChain,
    input_coefficients,
    of_outputs,
    without_constant,
)
from ulna.design.observers.output_functions import OutputSection, integral_over_output
from ulna.geometry import Observability, integrate, lie_derivative, one_form
from ulna.symbolic.exact import SampledZero, inverse, is_zero, tidy

_SECONDS = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockFrame:
    """The plant's outputs with their derivatives as coordinates.

    Attributes:
        section: the plant with its output symbols.
        indices: (p,) κ.
        fields: ∂/∂ξ_{j,l} in x by (j, l).
    """

    section: OutputSection
    indices: tuple[int, ...]
    fields: dict[tuple[int, int], sp.MatrixBase]

    def lie(self, function: sp.Expr, times: int = 1) -> sp.Expr:
        """L_f^times of a function."""
        for _ in range(times):
            function = lie_derivative(function, self.section.view.f, self.section.view.x)
        return function

    def slope(self, function: sp.Expr, output: int, level: int) -> sp.Expr:
        """∂(function)/∂ξ_{output, level}."""
        return lie_derivative(function, self.fields[output, level], self.section.view.x)


def search_blocks(section: OutputSection, seen: Observability) -> ObserverChain:
    """Chains for all outputs of an observable plant with p ≥ 2 outputs, by its observability indices.

    Args:
        section: the plant with its output symbols.
        seen: its observability.

    Raises:
        NotOfOutputsError: refuted with the function that is not one of y, undecided with what was tried.
    """
    coordinates_claim = "the outputs and their derivatives serve as coordinates"
    if 0 in seen.indices:
        redundant = section.view.system.outputs[seen.indices.index(0)].name
        tried = f"output '{redundant}' is a function of the others: leave it out"
        raise NotOfOutputsError(Verdict.undecided(coordinates_claim, tried=tried))
    frame = block_frame(section, seen)
    if frame is None:
        raise NotOfOutputsError(Verdict.undecided(coordinates_claim, tried="inverting the observability matrix"))
    coordinates: list[sp.Expr] = []
    injections: list[sp.Expr] = []
    measured: list[sp.Expr] = []
    try:
        for i in range(len(seen.indices)):
            psi = _last_coordinate(frame, i)
            chain, injected = _block(frame, i, psi)
            coordinates += chain
            injections += injected
            measured.append(psi)
        inputs = input_coefficients(section, coordinates)
    except NotOfOutputsError as failure:
        why = failure.verdict
        if why.fails and _ambiguous(seen.indices):
            tried = f"one choice of free functions: {why.claim} fails"
            raise NotOfOutputsError(Verdict.undecided(why.claim, tried=tried)) from None
        raise
    return ObserverChain(
        coordinates=tuple(coordinates),
        indices=seen.indices,
        measured=tuple(measured),
        drift_injection=sp.ImmutableDenseMatrix(len(injections), 1, injections),
        input_injection=inputs,
    )


def block_frame(section: OutputSection, seen: Observability) -> BlockFrame | None:
    """The frame of an observable plant; None if the observability matrix could not be inverted."""
    columns = inverse(sp.Matrix(seen.matrix)).solution
    if columns is None:
        return None
    fields, column = {}, 0
    for i, size in enumerate(seen.indices):
        for level in range(size):
            fields[i, level] = columns[:, column]
            column += 1
    return BlockFrame(section=section, indices=seen.indices, fields=fields)


def _ambiguous(indices: tuple[int, ...]) -> bool:
    """Whether second derivatives do not settle all that the short blocks leave open."""
    return any(k - size >= 2 and size >= 2 for k in indices for size in indices)


def _last_coordinate(frame: BlockFrame, i: int) -> sp.Expr:
    """ψ_i(y) whose κ_i-th derivative holds no higher derivative of the other outputs; y_i itself where that is so.

    Raises:
        NotOfOutputsError: if the other outputs cannot be combined away.
    """
    section, size = frame.section, frame.indices[i]
    top = frame.lie(section.view.h[i], size)
    slopes: dict[int, sp.Expr] = {}
    for j, other in enumerate(frame.indices):
        if other > size:
            slope = frame.slope(top, j, size)
            if not is_zero(slope, test=SampledZero(seconds=0.2)).holds:
                slopes[j] = of_outputs(section, slope, f"how derivative {size} of output {i + 1} mixes with others")
    if not slopes:
        return section.y[i]
    components = [-slopes.get(j, sp.Integer(0)) if j != i else sp.Integer(1) for j in range(len(section.y))]
    found = integrate(one_form(components, section.y), seconds=2.0)
    if found.value is None:
        claim = f"the outputs combine to a last coordinate for block {i + 1}"
        raise NotOfOutputsError(replace(found.verdict, claim=claim))
    return found.value


def _block(frame: BlockFrame, i: int, psi: sp.Expr) -> tuple[list[sp.Expr], list[sp.Expr]]:
    """z and a(y) of block i.

    Raises:
        NotOfOutputsError: if a slope is not a function of the outputs.
    """
    section, size = frame.section, frame.indices[i]
    z = [section.at_states(psi)]
    injections: list[sp.Expr] = []
    for k in range(size, 0, -1):
        rate = frame.lie(z[0])
        if k == 1:
            injections.insert(0, of_outputs(section, rate, f"a_1(y) of block {i + 1}"))
            break
        injection = _injection(frame, rate, k, f"of a_{k}(y) in block {i + 1}")
        below, constant = without_constant(tidy(rate - section.at_states(injection), seconds=_SECONDS), section.view.x)
        injections.insert(0, injection + constant)
        z.insert(0, below)
    return z, injections


def _injection(frame: BlockFrame, rate: sp.Expr, k: int, what: str) -> sp.Expr:
    """a_k(y) from L_f z_k = z_{k−1} + a_k(y).

    Raises:
        NotOfOutputsError: if a slope is not a function of the outputs or its integral is not found.
    """
    section = frame.section
    rest = frame.lie(rate, k - 1)
    slopes = {
        j: of_outputs(section, frame.slope(rest, j, k - 1), f"the slope in output {j + 1} {what}")
        for j, size in enumerate(frame.indices)
        if size >= k
    }
    known = _potential(section, slopes, what)
    short = [j for j, size in enumerate(frame.indices) if size == k - 1 >= 2]
    if not short:
        return known
    left = rest - frame.lie(section.at_states(known), k - 1)
    curved = [j for j, size in enumerate(frame.indices) if 2 <= size < k]
    gradient = {}
    for j in short:
        row = {
            m: of_outputs(
                section, frame.slope(frame.slope(left, j, k - 2), m, 1) / (k - 1), f"the curvature in {j + 1} {what}"
            )
            for m in curved
        }
        gradient[j] = _potential(section, row, what)
    return known + _potential(section, gradient, what)


def _potential(section: OutputSection, slopes: dict[int, sp.Expr], what: str) -> sp.Expr:
    """A function of y with the given partial derivatives, output by output.

    Raises:
        NotOfOutputsError: if the slopes are not a gradient or an integral is not found.
    """
    total = sp.Integer(0)
    for j, slope in slopes.items():
        missing = tidy(slope - total.diff(section.y[j]), seconds=0.3)
        part = integral_over_output(section, missing, index=j)
        if part is None:
            raise NotOfOutputsError(Verdict.undecided(f"the integral {what}", tried=f"∫ {missing} d{section.y[j]}"))
        total += part
    for j, slope in slopes.items():
        check = is_zero(total.diff(section.y[j]) - slope, test=SampledZero(seconds=0.2))
        if not check.holds:
            raise NotOfOutputsError(replace(check, claim=f"the slopes {what} are a gradient"))
    return total
