"""Branch and bound: whether V = (x − x*)ᵀ P (x − x*) falls along every run inside one of its level sets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from flint import arb, arb_mat

from ulna.certify.errors import CertifyError
from ulna.certify.region.balls import Slopes, ball
from ulna.certify.region.rest import Rest

_PLACES, _LEAST = 8, 0.03
"""Places at which the influence of a coordinate is sampled; the least of it, as part of the largest one."""
_FEW = 4
LEAF, HALVED = ".", "/"
"""In a tree: a box that is settled; one that is halved, followed by the place of the variable, then both halves."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Attempt:
    """What became of one level.

    Attributes:
        proved: whether V falls. tree: the boxes that show it. boxes: how many were looked at. stuck: middle and
            half-widths of the box where it ended otherwise.
    """

    proved: bool
    tree: str
    boxes: int
    stuck: tuple[np.ndarray, np.ndarray] | None


def rational(matrix: np.ndarray) -> sp.Matrix:
    """A symmetric matrix near this one in short binary fractions: each entry to 36 digits of its row and column."""
    n = len(matrix)
    scale = [int(np.ceil(np.log2(abs(matrix[i, i])) / 2)) for i in range(n)]

    def entry(i: int, j: int) -> sp.Rational:
        power = sp.Integer(2) ** (36 - scale[i] - scale[j])
        return sp.Rational(round(float((matrix[i, j] + matrix[j, i]) / 2) * float(power))) / power

    return sp.Matrix([[entry(min(i, j), max(i, j)) for j in range(n)] for i in range(n)])


def attempt(slopes: Slopes, found: Rest, P: sp.Matrix, level: sp.Rational, *, boxes: int) -> Attempt:
    """Whether PM(d) + M(d)ᵀP < 0 for every d with dᵀPd ≤ level, so that V falls exponentially there.

    Args:
        slopes, found: the loop and its equilibrium. P: positive definite. level: of V.
        boxes: how many may be looked at.
    """
    tree, looked = [], 0
    geometry = Ellipsoid(P, level, slopes, found)
    weights = _influence(slopes, found, geometry)
    center, n = found.balls, len(found.center)
    root = (np.zeros(n), geometry.half)
    stack = [root]
    while stack:
        middle, half = stack.pop()
        looked += 1
        if looked > boxes:
            return Attempt(proved=False, tree="", boxes=looked, stuck=(middle, half))
        box = geometry.balls(middle, half)
        if geometry.outside(box, half) or falls(slopes, center, geometry, middle, half):
            tree.append(LEAF)
            continue
        place = max(geometry.active, key=lambda k: weights[k] * half[k] / geometry.half[k], default=None)
        if place is None or half[place] < 1e-4 * geometry.half[place]:
            return Attempt(proved=False, tree="", boxes=looked, stuck=(middle, half))
        tree.append(f"{HALVED}{place}")
        # The lower half comes first.
        stack += reversed(list(halves(middle, half, place)))
    return Attempt(proved=True, tree=" ".join(tree), boxes=looked, stuck=None)


def _influence(slopes: Slopes, found: Rest, geometry: Ellipsoid) -> np.ndarray:
    """(n,) how much the secant matrix and the commands change over the ellipsoid with each coordinate; never 0.

    Of random places within: a product does not change with one factor where the other one is 0.
    """
    middle, n = found.numbers, len(found.center)
    basis, still = geometry.basis, slopes.limited_slopes(middle)
    turned = np.linalg.inv(basis)
    inside = np.random.default_rng(0).uniform(-0.5, 0.5, (_PLACES, n)) * geometry.half / np.sqrt(n)
    found_weights = np.zeros(n)
    for place in geometry.active:
        for start in middle + inside:
            ahead, behind = start.copy(), start.copy()
            ahead[place] += geometry.half[place] / 2
            behind[place] -= geometry.half[place] / 2
            change = turned @ (slopes.numbers(ahead) - slopes.numbers(behind)) @ basis
            if np.isfinite(change).all():
                found_weights[place] += np.linalg.norm(change) / _PLACES
        found_weights[place] += np.linalg.norm(turned @ still, axis=0).max(initial=0.0) * (
            slopes.share_of_limits(middle, place, geometry.half[place])
        )
    return np.maximum(found_weights, _LEAST * found_weights.max() + 1e-9)


def halves(middle: np.ndarray, half: np.ndarray, place: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The two halves of a box along a variable, exact in binary fractions as long as digits suffice."""
    for sign in (-1.0, 1.0):
        moved, smaller = middle.copy(), half.copy()
        smaller[place] = half[place] / 2
        moved[place] = middle[place] + sign * smaller[place]
        yield moved, smaller


class Ellipsoid:
    """{d : dᵀPd ≤ level}, its bounding box and its shadows on some of the variables."""

    def __init__(self, P: sp.Matrix, level: sp.Rational, slopes: Slopes, found: Rest) -> None:
        n, outer = P.shape[0], slopes.form.outer
        # With few coordinates all are halved: beside the secant matrix V' itself can then be bounded.
        active = tuple(range(n)) if outer <= _FEW else slopes.active
        self.rest = found.numbers
        self.P = arb_mat(n, n, [ball(v) for v in P])
        self.level, self.active = ball(level), tuple(active)
        numbers = np.array(P.tolist(), dtype=float)
        self.basis = np.linalg.inv(np.linalg.cholesky(numbers)).T
        self._inverse = P.inv()
        # Powers of two, so that halving is exact.
        self.half = np.array([power_above(level * self._inverse[k, k]) for k in range(n)])
        self.whole = [k for k in range(n) if k not in self.active]
        self.outer = outer
        if outer < n:
            # Of the errors only their size counts, given how much of the level the states leave.
            self.active = tuple(k for k in self.active if k < outer)
        self._decay: arb_mat | None = None
        self._linear: tuple[arb_mat, arb_mat, arb_mat] | None = None
        self._shadows: dict[tuple[int, ...], arb_mat] = {}
        self._idle = [arb(0, float(self.half[j])) for j in range(n)]

    def pushed(self, w: Sequence[arb]) -> list[arb]:
        """P₁ w of the states before the errors."""
        return [_dot([self.P[i, j] for j in range(self.outer)], w) for i in range(self.outer)]

    def errors_beside(self, w: Sequence[arb]) -> list[arb] | None:
        """A box of all errors that the level allows beside states w; None where the states alone are beyond it."""
        rest = self.level - _dot(w, self.pushed(w))
        if rest < 0:
            return None
        size = arb(rest.upper()).max(arb(0)).sqrt()
        places = range(self.outer, self.P.nrows())
        return [arb(0, 1) * size * ball(self._inverse[j, j]).sqrt() for j in places]

    def with_errors(self, box: list[arb]) -> list[arb]:
        """The box with all errors that the level allows beside its states."""
        beside = self.errors_beside(box[: self.outer]) if self.outer < len(box) else None
        return box if beside is None else [*box[: self.outer], *beside]

    def decay_inverse(self, slopes: Slopes, center: list[arb]) -> arb_mat:
        """S⁻¹ of the errors' part, which is linear."""
        if self._decay is None:
            k, n = self.outer, self.P.nrows()
            A = slopes.matrix(center)
            R = arb_mat(n - k, n - k, [self.P[i, j] for i in range(k, n) for j in range(k, n)])
            A = arb_mat(n - k, n - k, [A[i, j] for i in range(k, n) for j in range(k, n)])
            product = R * A
            S = -(product + product.transpose())
            if not definite(-S, self.basis[k:, k:]):
                raise CertifyError("the errors' part", "its quadratic form does not decrease along the motion.")
            self._decay = S.inv()
        return self._decay

    def linear(self, slopes: Slopes) -> tuple[arb_mat, arb_mat, arb_mat]:
        """P₁ of the states before the errors, A about their slopes at rest, and Q = −(P₁A + AᵀP₁) > 0, or A = Q = 0.

        The slopes are those of the states alone.
        """
        if self._linear is None:
            k = self.outer
            P = arb_mat(k, k, [self.P[i, j] for i in range(k) for j in range(k)])
            A = arb_mat(k, k, [arb(v) for v in slopes.numbers(self.rest[:k]).ravel().tolist()])
            product = P * A
            Q = -(product + product.transpose())
            if not definite(-Q, self.basis[:k, :k]):
                A = Q = arb_mat(k, k, [arb(0)] * (k * k))
            self._linear = P, A, Q
        return self._linear

    def balls(self, middle: np.ndarray, half: np.ndarray) -> list[arb]:
        """The box; what is not active ranges over all of the ellipsoid."""
        found = list(self._idle)
        for place in self.active:
            found[place] = arb(float(middle[place]), float(half[place]))
        return found

    def outside(self, box: list[arb], half: np.ndarray) -> bool:
        """Whether the box is certainly outside, by the shadow on the variables that have been halved."""
        cut = tuple(k for k in self.active if half[k] < self.half[k])
        if not cut:
            return False
        if cut not in self._shadows:
            shadow = self._inverse.extract(list(cut), list(cut)).inv()
            self._shadows[cut] = arb_mat(len(cut), len(cut), [ball(v) for v in shadow])
        shadow, total = self._shadows[cut], arb(0)
        for i, a in enumerate(cut):
            total += shadow[i, i] * box[a] * box[a]
            for j in range(i):
                total += 2 * shadow[i, j] * box[a] * box[cut[j]]
        return bool(total > self.level)


def power_above(square: sp.Rational) -> float:
    """A power of two not below the square root of a fraction."""
    power = sp.Integer(1)
    while power**2 < square:
        power *= 2
    while power**2 / 4 >= square:
        power /= 2
    return float(power)


def falls(slopes: Slopes, center: list[arb], geometry: Ellipsoid, middle: np.ndarray, half: np.ndarray) -> bool:
    """Whether the loop is defined and V falls at every d ≠ 0 of the box: there, or as dᵀ(PM + MᵀP)d for any d."""
    box = geometry.balls(middle, half)
    outer = geometry.outer
    if not slopes.domain.holds([c + d for c, d in zip(center, geometry.with_errors(box), strict=True)]):
        return False
    if slopes.still is not None:
        if _falls_with_errors(slopes, slopes.still, center, geometry, (middle, half)):
            return True
    elif not geometry.whole and _falls_here(slopes, center, geometry, middle, half):
        return True
    direct = outer < len(middle) or not geometry.whole
    if direct and (np.abs(middle[:outer]) > 4.0 * half[:outer]).any():
        return False
    product = geometry.P * _secant_with_errors(slopes, center, geometry, box)
    form = product + product.transpose()
    n = form.nrows()
    return all(form[i, j].is_finite() for i in range(n) for j in range(n)) and definite(form, geometry.basis)


def _falls_here(slopes: Slopes, center: list[arb], geometry: Ellipsoid, middle: np.ndarray, half: np.ndarray) -> bool:
    """Whether dᵀP ζ' < 0 on the box."""
    return bool(_power_on(slopes, center, geometry, middle, half) < 0)


def _power_on(slopes: Slopes, center: list[arb], geometry: Ellipsoid, middle: np.ndarray, half: np.ndarray) -> arb:
    """An upper bound of dᵀP ζ' on the box d = m + δ, where the linear part is not bounded but taken as it is.

    With ζ' = A d + ν(d) for any A: dᵀPAd = −dᵀQd/2 ≤ −mᵀQm/2 − mᵀQδ as Q ≥ 0, and dᵀPν by the mean-value form.
    """
    k = geometry.outer
    P, A, Q = geometry.linear(slopes)
    m = arb_mat(k, 1, [arb(v) for v in middle[:k].tolist()])
    delta = arb_mat(k, 1, [arb(0, v) for v in half[:k].tolist()])
    start = slopes.rates([c + m[j, 0] for j, c in enumerate(center[:k])])
    turn = slopes.matrix([c + m[j, 0] + delta[j, 0] for j, c in enumerate(center[:k])]) - A
    still = arb_mat(k, 1, start) - A * m
    gradient = P * (still + turn * delta) + turn.transpose() * (P * (m + delta)) - Q * m
    total = m.transpose() * (P * still - Q * m * arb(0.5)) + gradient.transpose() * delta
    return total[0, 0]


def _falls_with_errors(
    slopes: Slopes, still: Slopes, center: list[arb], geometry: Ellipsoid, sides: tuple[np.ndarray, np.ndarray]
) -> bool:
    """The same for all errors e that the level allows beside the states w of the box; P is block diagonal.

    Half of V' is wᵀP₁ w'(w, 0) + cᵀe − eᵀSe/2 with c = (∂w'/∂e)ᵀ P₁ w and S = −(R A + AᵀR): at most the first term
    plus cᵀS⁻¹c/2.
    """
    middle, half = sides
    n, k = len(middle), geometry.outer
    w = [arb(float(c), float(h)) for c, h in zip(middle[:k], half[:k], strict=True)]
    errors = geometry.errors_beside(w)
    if errors is None:
        return True
    push, total = geometry.pushed(w), _power_on(still, center, geometry, middle, half)
    coupled = slopes.matrix([c + v for c, v in zip(center, [*w, *errors], strict=True)])
    c = arb_mat(n - k, 1, [_dot([coupled[i, k + j] for i in range(k)], push) for j in range(n - k)])
    total += (c.transpose() * (geometry.decay_inverse(slopes, center) * c))[0, 0] / 2
    return bool(total < 0)


def _secant_with_errors(slopes: Slopes, center: list[arb], geometry: Ellipsoid, box: list[arb]) -> arb_mat:
    """M with ζ' = M d: for the states along the line without errors, then for the errors at these states."""
    n, k = len(box), geometry.outer
    if slopes.still is None:
        return slopes.secant(center, box)
    errors = geometry.errors_beside(box[:k]) or box[k:]
    still = slopes.still.secant(center[:k], box[:k])
    coupled = slopes.matrix([c + v for c, v in zip(center, [*box[:k], *errors], strict=True)])
    entries = [coupled[i, j] if j >= k else still[i, j] if i < k else arb(0) for i in range(n) for j in range(n)]
    return arb_mat(n, n, entries)


def _dot(left: Sequence[arb], right: Sequence[arb]) -> arb:
    total = arb(0)
    for a, b in zip(left, right, strict=True):
        total += a * b
    return total


def definite(whole: arb_mat, basis: np.ndarray) -> bool:
    """Whether a symmetric matrix is certainly negative definite: Gershgorin's discs after a change of basis.

    S. Gershgorin, Izv. Akad. Nauk SSSR 6 (1931). Any invertible basis gives a valid answer; that of the eigenvectors of
    the middle gives small discs.
    """
    n = whole.nrows()
    middle = np.array([[float(whole[i, j].mid()) for j in range(n)] for i in range(n)])
    turned = basis.T @ middle @ basis
    values, vectors = np.linalg.eigh((turned + turned.T) / 2)
    if values[-1] >= 0:
        return False
    best = arb_mat(n, n, [arb(float(v)) for v in (basis @ vectors / np.sqrt(np.abs(values))).ravel()])
    whole = best.transpose() * whole * best
    for i in range(n):
        edge = whole[i, i]
        for j in range(n):
            if j != i:
                edge += whole[i, j].abs_upper()
        if not edge < 0:
            return False
    return True
