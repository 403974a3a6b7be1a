"""Is an expression identically zero? Random points first (a quick, certain no), exact algebra after (a certain yes)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any, Protocol, runtime_checkable

import numpy as np
import sympy as sp
from sympy.functions.elementary.hyperbolic import InverseHyperbolicFunction
from sympy.functions.elementary.trigonometric import InverseTrigonometricFunction

from ulna.base import Verdict, all_of
from ulna.symbolic.exact.ball import tape
from ulna.symbolic.exact.embed import attempt_exactly, embed
from ulna.symbolic.exact.finite_field import PRIMES, FieldSample
from ulna.symbolic.exact.sample import RADIUS, SEED, regular_points

_READABLE = 30
"""Nodes from which on an expression is not written out in a claim."""


@runtime_checkable
class ZeroTest(Protocol):
    """Any rule that judges whether an expression is identically zero."""

    def __call__(self, expression: sp.Expr, /) -> Verdict:
        """The verdict on "the expression is identically zero"."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledZero:
    """Balls at random rational points, then a bounded proof by a normal form.

    A value whose ball excludes 0 refutes with certainty. An analytic expression that is not zero passes a random
    point with probability zero (J. T. Schwartz, J. ACM 27 (1980), for polynomials). The claim is about the domain
    where every part of the expression is real.

    Args:
        points: number of random points that must all be zero.
        digits: decimal digits of the arithmetic.
        seed: of the random points.
        seconds: s, time for the proof; 0 leaves it out.
        operations: size (nodes of the expression) above which no proof is tried.
        near: values near which to sample, for expressions that are zero or defined only there.
        radius: half width of that neighbourhood.
    """

    points: int = 6
    digits: int = 40
    seed: int = SEED
    seconds: float = 1.0
    operations: int = 4000
    near: Mapping[sp.Basic, sp.Expr] | None = None
    radius: sp.Rational = RADIUS

    def __call__(self, expression: sp.Expr, /) -> Verdict:
        """The verdict on "the expression is identically zero"."""
        claim = f"{_short(expression)} = 0"
        if expression == 0:
            return Verdict.proved(claim)
        program = tape([expression])
        seen = 0
        for point, [value] in regular_points(
            program, self.points, seed=self.seed, digits=self.digits, near=self.near, radius=self.radius
        ):
            if not value.contains(0):
                size = sp.Float(value.mid().str(20, radius=False), 20)
                return Verdict.refuted(claim, point=point, value=size, seed=self.seed)
            seen += 1
        evidence: dict[str, Any] = {"points": seen, "digits": self.digits, "seed": self.seed}
        if not seen:
            return Verdict.undecided(claim, tried="no random point where the expression is real and finite", **evidence)
        if self.seconds > 0 and program.size <= self.operations:
            proof = attempt_exactly(self.seconds, "normal form", vanishes_exactly, expression)
            if proof.value:
                return Verdict.proved(claim, method="normal form", **evidence)
            evidence["no_proof"] = proof.reason or "the normal form does not vanish by the known relations"
        return Verdict.supported(claim, **evidence)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidueZero:
    """Random points of a finite field, for searching: milliseconds, supported or refuted, nothing proved.

    The field does not know that √u √v = √(uv) for positive u and v; so with roots or inverse functions a nonzero value
    there is doubted, and the real numbers are asked.

    Args:
        points: number of random points.
        seed: of the random points.
    """

    points: int = 32
    seed: int = 1

    def __call__(self, expression: sp.Expr, /) -> Verdict:
        """The verdict on "the expression is identically zero"."""
        claim = f"{_short(expression)} = 0"
        evidence = {"points": self.points, "seed": self.seed, "prime": PRIMES[0]}
        if expression.is_Rational:
            return Verdict.proved(claim) if expression == 0 else Verdict.refuted(claim, value=expression)
        zero = self.seen(expression)
        if not zero and _has_hidden_relations(expression):
            return SampledZero(points=4, seconds=0)(expression)
        if zero is None:
            return Verdict.undecided(claim, tried="no random point where the expression is finite", **evidence)
        return Verdict.supported(claim, **evidence) if zero else Verdict.refuted(claim, **evidence)

    def seen(self, expression: sp.Expr) -> bool | None:
        """Whether all values in the field are zero; None if there is none."""
        sample = FieldSample(self.points, seed=self.seed)
        values = sample(expression)
        return not np.any(values[sample.valid]) if sample.valid.any() else None


def vanishes(expression: sp.Expr, test: ResidueZero = ResidueZero()) -> bool:
    """Whether the expression is zero at random points of a finite field: `ResidueZero` as a quick filter."""
    if expression.is_Rational:
        return expression == 0
    return test.seen(expression) or (_has_hidden_relations(expression) and test(expression).holds)


def _has_hidden_relations(expression: sp.Expr) -> bool:
    if expression.has(sp.log, sp.Abs, InverseTrigonometricFunction, InverseHyperbolicFunction):
        return True
    return any(not node.exp.is_Integer for node in expression.atoms(sp.Pow))


def vanishes_exactly(expression: sp.Expr) -> bool:
    """True only if exact algebra with sines, exponentials, logarithms and roots as generators gives 0.

    Raises:
        ExactAlgebraError: see `ulna.symbolic.exact.embed.embed`.
    """
    ring, [element] = embed([expression])
    return ring.is_zero(element)


def is_zero(expression: sp.Expr, *, test: ZeroTest = SampledZero()) -> Verdict:
    """Whether the expression is identically zero.

    Refuted verdicts carry `point` and `value`; supported ones the number of `points`, the `seed` and the `digits`.
    """
    return test(sp.sympify(expression))


def are_zero(expressions: Iterable[sp.Expr], *, test: ZeroTest = SampledZero()) -> Verdict:
    """Whether all of the expressions are identically zero; a refuted verdict also carries the `index`."""
    verdicts: list[Verdict] = []
    for index, expression in enumerate(expressions):
        verdict = is_zero(expression, test=test)
        if verdict.fails:
            return all_of("all expressions vanish", [verdict], index=index)
        verdicts.append(verdict)
    return all_of("all expressions vanish", verdicts)


def _short(expression: sp.Expr) -> str:
    nodes = sum(1 for _ in islice(sp.preorder_traversal(expression), _READABLE))
    return str(expression) if nodes < _READABLE else "the expression"
