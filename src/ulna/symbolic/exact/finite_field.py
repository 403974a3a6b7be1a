"""Expressions evaluated at random points of a finite field: exact arithmetic at the speed of machine integers.

A relation between expressions that holds identically also holds modulo a prime at every point where all of them are
defined, and one that does not hold fails at a random point but with probability about degree/2³¹ (Schwartz 1980,
Zippel 1979). Functions are mapped so that their algebra survives: exponentials and the units e^{iθ} of angles become
random units that multiply as the arguments add, logarithms random values that add as the arguments multiply, roots
are roots in the field, any other function value is a random number of its own. So this is a filter for searching:
what it finds is checked by `zero`, and what it fails to find may still exist.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from sympy import (
    Abs,
    Add,
    E,
    Expr,
    Float,
    I,
    Mul,
    Pow,
    Rational,
    S,
    Symbol,
    cos,
    cosh,
    cot,
    coth,
    csc,
    exp,
    log,
    pi,
    sec,
    sign,
    sin,
    sinh,
    tan,
    tanh,
)

PRIMES = (2147483549, 2147483477, 2147483237, 2147482661)
"""Primes just below 2³¹, equal to 5 modulo 8 (square roots and i exist cheaply) and 2 modulo 3 (cube roots)."""

_ROOTS = 12

Residues = NDArray[np.int64]


def power(base: Residues, exponent: int, prime: int) -> Residues:
    """base**exponent modulo the prime, entry by entry, for exponent ≥ 0."""
    result = np.ones_like(base)
    square = base % prime
    while exponent:
        if exponent & 1:
            result = result * square % prime
        square = square * square % prime
        exponent >>= 1
    return result


class FieldSample:
    """Values of expressions at `points` random points of the field of `prime` elements.

    Args:
        points: number of points drawn; those where some expression asked for is undefined drop out of `valid`.
        seed: the points are a function of the seed and of the order of the questions.
        constants: symbols that take one value at all points (parameters); the others vary from point to point.
        prime: one of `self.primeS`.
    """

    def __init__(self, points: int, *, seed: int = 1, constants: Iterable[Symbol] = (), prime: int = PRIMES[0]) -> None:
        self.prime = prime
        self._i = pow(2, (prime - 1) // 4, prime)
        self._points = points
        self._random = np.random.default_rng(seed)
        self._constants = frozenset(constants)
        self._memory: dict[object, Residues] = {}
        self.valid: NDArray[np.bool_] = np.ones(points, dtype=bool)

    def __call__(self, expression: Expr) -> Residues:
        """The residues of an expression at the points, shape (points,)."""
        known = self._memory.get(expression)
        if known is None:
            known = self._memory[expression] = self._evaluate(expression)
        return known

    def table(self, expressions: Sequence[Expr]) -> Residues:
        """The residues of several expressions, shape (len(expressions), points)."""
        return np.array([self(e) for e in expressions], dtype=np.int64).reshape(len(expressions), self._points)

    def _unit(self, key: object, symbols: Iterable[object] = (None,)) -> Residues:
        """A random nonzero value that belongs to `key`; the same at all points if all its symbols are constants."""
        found = self._memory.get(("unit", key))
        if found is None:
            constant = self._constants.issuperset(symbols)
            found = self._random.integers(2, self.prime - 1, 1 if constant else self._points, dtype=np.int64)
            found = np.broadcast_to(found, (self._points,)).copy()
            self._memory["unit", key] = found
        return found

    def _evaluate(self, e: Expr) -> Residues:
        if isinstance(e, Rational):
            return self._rational(e)
        if isinstance(e, Symbol):
            return power(self._unit(e, {e}), _ROOTS, self.prime)
        if isinstance(e, Add):
            total = np.zeros(self._points, dtype=np.int64)
            for term in e.args:
                total = total + self(term)
            return total % self.prime
        if isinstance(e, Mul):
            product = np.ones(self._points, dtype=np.int64)
            for factor in e.args:
                product = product * self(factor) % self.prime
            return product
        if isinstance(e, exp) or e is E:
            return self._exponential(e.args[0] if e.args else Rational(1), "exp")
        if isinstance(e, Float):
            return self._evaluate(Rational(e))
        if not e.is_commutative or e.has(*_UNDEFINED):
            return self._undefined()
        if e is I:
            return np.full(self._points, self._i, dtype=np.int64)
        if isinstance(e, Pow):
            return self._pow(e.base, e.exp)
        return self._function(e)

    def _rational(self, number: Rational) -> Residues:
        if int(number.q) % self.prime == 0:
            return self._undefined()
        value = int(number.p) % self.prime * pow(int(number.q), -1, self.prime) % self.prime
        return np.full(self._points, value, dtype=np.int64)

    def _undefined(self) -> Residues:
        self.valid[:] = False
        return np.zeros(self._points, dtype=np.int64)

    def inverse(self, values: Residues) -> Residues:
        """1/values; points where a value is 0 are no longer valid."""
        self.valid &= values != 0
        return power(values, self.prime - 2, self.prime)

    def signed_power(self, base: Residues, exponent: int) -> Residues:
        """base**exponent for any integer exponent; points where 0 is inverted are no longer valid."""
        return power(base if exponent >= 0 else self.inverse(base), abs(exponent), self.prime)

    def _pow(self, base: Expr, exponent: Expr) -> Residues:
        if exponent.is_Integer:
            return self.signed_power(self(base), int(exponent))
        if isinstance(exponent, Rational):
            return self._root(base, exponent)
        constant, rest = exponent.as_coeff_Add()
        constant = Rational(constant) if isinstance(constant, Float) else constant
        return self._pow(base, constant) * self._exponential(rest, ("pow", base)) % self.prime

    def _root(self, base: Expr, exponent: Rational) -> Residues:
        p, q = int(exponent.p), int(exponent.q)
        if isinstance(base, Symbol) and _ROOTS % q == 0:
            return self.signed_power(self._unit(base, {base}), p * (_ROOTS // q))
        if q == 2:
            return self.signed_power(self._square_root(self(base)), p)
        if q == 3:
            return self.signed_power(self._cube_root(self(base)), p)
        if q in (4, 6):
            half = self._square_root(self(base))
            return self.signed_power(self._square_root(half) if q == 4 else self._cube_root(half), p)
        return self.signed_power(self._unit(("root", base, q), base.free_symbols), p)

    def _cube_root(self, values: Residues) -> Residues:
        return power(values, (2 * self.prime - 1) // 3, self.prime)

    def _square_root(self, values: Residues) -> Residues:
        root = power(values, (self.prime + 3) // 8, self.prime)
        root = np.where(root * root % self.prime == values, root, root * self._i % self.prime)
        self.valid &= root * root % self.prime == values
        return root

    def _exponential(self, argument: Expr, kind: object) -> Residues:
        """A homomorphism from sums to products: the value for Σ cₖ mₖ is Π unit(mₖ)^cₖ."""
        product = np.ones(self._points, dtype=np.int64)
        for term in Add.make_args(argument.expand()):
            coefficient, monomial = term.as_coeff_Mul()
            scaled = coefficient * _ROOTS
            if not scaled.is_Integer:
                monomial, scaled = term, Rational(_ROOTS)
            unit = self._unit((kind, monomial), monomial.free_symbols)
            product = product * self.signed_power(unit, int(scaled)) % self.prime
        return product

    def _function(self, e: Expr) -> Residues:
        name, argument = e.func, e.args[0] if e.args else None
        if name in _CIRCULAR and argument is not None:
            unit = self._exponential(argument, "angle")
            return self._circular(name, unit, self._i)
        if name in _HYPERBOLIC and argument is not None:
            return self._circular(_HYPERBOLIC[name], self._exponential(argument, "exp"), 1)
        if name is log and argument is not None:
            return self._logarithm(argument)
        if name is Abs:  # on the component where the argument is positive
            return self(e.args[0])
        if name is sign:
            return np.ones(self._points, dtype=np.int64)
        if e is pi or not e.args:
            return self._unit(e, ())
        key = (name, *(self(a).tobytes() for a in e.args))
        return self._unit(key, e.free_symbols)

    def _circular(self, name: type, unit: Residues, i: int) -> Residues:
        back = self.inverse(unit)
        half = (self.prime + 1) // 2
        even = (unit + back) % self.prime * half % self.prime
        odd = (unit - back) % self.prime * half % self.prime * pow(i, -1, self.prime) % self.prime
        if name is sin:
            return odd
        if name is cos:
            return even
        if name in (tan, csc):
            return (odd if name is tan else 1) * self.inverse(even if name is tan else odd) % self.prime
        return (even if name is cot else 1) * self.inverse(odd if name is cot else even) % self.prime

    def _logarithm(self, argument: Expr) -> Residues:
        """A homomorphism from products to sums."""
        total = np.zeros(self._points, dtype=np.int64)
        for factor in Mul.make_args(argument):
            base, exponent = factor.as_base_exp()
            content, primitive = base.primitive() if isinstance(base, Add) else (Rational(1), base)
            if primitive.could_extract_minus_sign() and isinstance(base, Add):
                content, primitive = -content, -primitive
            for part in (content, primitive):
                if part not in (1, -1):
                    total = total + self._unit(("log", part), part.free_symbols) * self(exponent)
                    total = total % self.prime
        return total


_UNDEFINED = (S.NaN, S.ComplexInfinity, S.Infinity, S.NegativeInfinity)
_CIRCULAR = frozenset((sin, cos, tan, cot, sec, csc))
_HYPERBOLIC = {sinh: sin, cosh: cos, tanh: tan, coth: cot}
