"""`LevelSet`: what a certificate proves, in floating point: V, the loop within its limits, and the set in a plane."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ulna.certify.certificate import THEOREM, Certificate
from ulna.certify.errors import CertifyError
from ulna.program import to_numpy
from ulna.symbolic.compiling import kernel
from ulna.symbolic.formulas import parse_formula

_STEP = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelSet:
    """{x: V(x) ≤ level} with V = (ζ − ζ*)ᵀ P (ζ − ζ*), ζ = T(x), and the loop in which V falls there.

    Attributes:
        states: names of x. coordinates: (n,) ζ*. rest: (n,) x*. P: (n, n). level: of V.
        forward, inverse: T and T⁻¹ of (n, N) points.
        commands: (m, N) the limited signals as commanded, of (n, N) states. limited: their names.
        lower, upper: (m,) limits. rates: (n, N) x' within the limits.
        lines: of each state its row (n,) in ζ where it is linear in ζ, by name.
    """

    states: tuple[str, ...]
    coordinates: np.ndarray
    rest: np.ndarray
    P: np.ndarray
    level: float
    forward: Callable[[np.ndarray], np.ndarray]
    inverse: Callable[[np.ndarray], np.ndarray]
    commands: Callable[[np.ndarray], np.ndarray]
    limited: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    rates: Callable[[np.ndarray], np.ndarray]
    lines: dict[str, np.ndarray]

    def value(self, points: np.ndarray) -> np.ndarray:
        """(N,) V / level of (n, N) states: at most 1 in what is proved."""
        d = self.forward(points) - self.coordinates[:, None]
        return np.einsum("ij,ij->j", d, self.P @ d) / self.level

    def shadow(self, names: Sequence[str], count: int = 200) -> np.ndarray | None:
        """(2, count) the edge of the set's projection on two states; None where these are not linear in ζ.

        With x = x* + L d the projection of {d: dᵀPd ≤ level} is the ellipse of L P⁻¹ Lᵀ.
        """
        if not set(names) <= set(self.lines):
            return None
        L = np.array([self.lines[name] for name in names])
        root = np.linalg.cholesky(L @ np.linalg.solve(self.P, L.T) * self.level)
        angles = np.linspace(0.0, 2.0 * np.pi, count)
        places = [self.states.index(name) for name in names]
        return self.rest[places][:, None] + root @ np.array([np.cos(angles), np.sin(angles)])

    def reach(self) -> np.ndarray:
        """(n,) how far each state goes in the set, of many points on its edge."""
        n = len(self.rest)
        directions = np.hstack([np.random.default_rng(0).normal(size=(n, 4000)), np.eye(n)])
        directions /= np.linalg.norm(directions, axis=0)
        edge = np.linalg.inv(np.linalg.cholesky(self.P)).T @ directions
        points = self.inverse(self.coordinates[:, None] + np.sqrt(self.level) * edge)
        return np.nanmax(np.abs(points - self.rest[:, None]), axis=1)

    @property
    def slowest(self) -> float:
        """1/s: the decay rate of the linearisation at rest."""
        n = len(self.rest)
        steps = _STEP * np.maximum(1.0, np.abs(self.rest)) * np.eye(n)
        ahead, behind = (self.rates(self.rest[:, None] + sign * steps) for sign in (1.0, -1.0))
        return float(-np.linalg.eigvals((ahead - behind) / (2.0 * steps.diagonal())).real.max())


def level_set(certificate: Certificate) -> LevelSet:
    """The level set that a certificate proves, with its loop, read from the certificate alone.

    Raises:
        CertifyError: a certificate of another theorem, which has no level set.
    """
    if certificate.theorem != THEOREM:
        found = f"it is of another theorem ({certificate.theorem})."
        raise CertifyError("a level set of a certificate", found, "Prove Region() or StableWithin(box={...}).")
    x = {name: sp.Symbol(name, real=True) for name in certificate.states}
    z = {name: sp.Symbol(name, real=True) for name in certificate.coordinates}
    names, commands = dict(x), {}
    limited = {name: sp.Symbol(name, real=True) for name in certificate.limited}
    for name, text in certificate.wires:
        formula = parse_formula(text, names)
        if name in limited:
            commands[name] = formula
        names[name] = limited.get(name, formula)
    inverse = [parse_formula(text, z) for text in certificate.inverse]
    numbers = [[sp.Rational(entry) for entry in row] for row in certificate.P]
    ordered = [commands[name] for name in certificate.limited]
    lower, upper = (np.array([float(sp.Rational(v)) for v in row]) for row in (certificate.lower, certificate.upper))
    commanded = _function([*x.values()], ordered)
    between = _function([*x.values(), *limited.values()], [parse_formula(text, names) for text in certificate.rates])

    def rates(points: np.ndarray) -> np.ndarray:
        kept = np.clip(commanded(points), lower[:, None], upper[:, None])
        return between(np.vstack([points, kept]))

    forward = _function([*x.values()], [parse_formula(text, x) for text in certificate.forward])
    backward = _function([*z.values()], inverse)
    center = np.array([float(sp.Rational(entry)) for entry in certificate.center])
    return LevelSet(
        states=certificate.states,
        coordinates=center,
        rest=backward(center[:, None])[:, 0],
        P=np.array(numbers, dtype=float),
        level=float(sp.Rational(certificate.level)),
        forward=forward,
        inverse=backward,
        commands=commanded,
        limited=tuple(certificate.limited),
        lower=lower,
        upper=upper,
        rates=rates,
        lines=_lines(certificate.states, inverse, [*z.values()]),
    )


def _lines(names: Sequence[str], inverse: Sequence[sp.Expr], symbols: Sequence[sp.Symbol]) -> dict[str, np.ndarray]:
    rows = {name: [sp.diff(e, s) for s in symbols] for name, e in zip(names, inverse, strict=True)}
    return {name: np.array(row, dtype=float) for name, row in rows.items() if all(e.is_number for e in row)}


def _function(symbols: Sequence[sp.Symbol], formulas: Sequence[sp.Expr]) -> Callable[[np.ndarray], np.ndarray]:
    """(k, N) values of k formulas at (n, N) points; without a word where they have none."""
    if not formulas:
        return lambda points: np.zeros((0, points.shape[1]))
    evaluate = to_numpy(kernel("level set", list(symbols), {f"v{k}": e for k, e in enumerate(formulas)}))

    def values(points: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            found = evaluate(*points)
        return np.array([np.broadcast_to(row, points.shape[1:]) for row in found], dtype=float)

    return values
