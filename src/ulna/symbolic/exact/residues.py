"""Linear algebra modulo a prime, and the way back from residues to fractions."""

from __future__ import annotations

from collections.abc import Sequence
from math import isqrt

import numpy as np
from sympy import Rational

from ulna.symbolic.exact.finite_field import PRIMES, Residues


def null_space_modulo(matrix: Residues, prime: int = PRIMES[0]) -> list[dict[int, int]]:
    """A reduced basis of the null space of integers modulo a prime.

    Args:
        matrix: shape (equations, unknowns).

    Returns:
        One sparse vector per free column, {column: residue}, with 1 at its free column (its greatest index).
    """
    a = matrix.copy() % prime
    rows, columns = a.shape
    pivots: list[int] = []
    row = 0
    for column in range(columns):
        nonzero = np.nonzero(a[row:, column])[0]
        if nonzero.size == 0:
            continue
        swap = row + int(nonzero[0])
        if swap != row:
            a[[row, swap]] = a[[swap, row]]
        a[row] = a[row] * pow(int(a[row, column]), -1, prime) % prime
        others = np.nonzero(a[:, column])[0]
        others = others[others != row]
        a[others] = (a[others] - a[others, column][:, None] * a[row][None, :]) % prime
        pivots.append(column)
        row += 1
        if row == rows:
            break
    basis = []
    for free in sorted(set(range(columns)) - set(pivots)):
        vector = {c: int(-a[r, free] % prime) for r, c in enumerate(pivots) if a[r, free]}
        vector[free] = 1
        basis.append(vector)
    return basis


def combined_residue(residues: Sequence[int], primes: Sequence[int]) -> int:
    """The residue modulo the product of the primes that has these residues (Chinese remainder theorem)."""
    value, modulus = 0, 1
    for residue, prime in zip(residues, primes, strict=True):
        value += modulus * ((residue - value) * pow(modulus, -1, prime) % prime)
        modulus *= prime
    return value


def rational_from_residue(residue: int, modulus: int) -> Rational | None:
    """The fraction p/q with |p| q < modulus / 2⁹ that has this residue, None if there is none (Wang 1981).

    A random residue has such a fraction with probability about 1/100 only, so that chance finds are rare.
    """
    bound = isqrt(modulus // 2)
    r0, r1, t0, t1 = modulus, residue % modulus, 0, 1
    while r1 > bound:
        quotient = r0 // r1
        r0, r1, t0, t1 = r1, r0 - quotient * r1, t1, t0 - quotient * t1
    if t1 == 0 or r1 * abs(t1) >= modulus >> 9:
        return None
    return Rational(r1, t1)
