"""A random permutation of 0 … N − 1 that is known place by place, without a table."""

from __future__ import annotations

import numpy as np

ROUNDS = 10
"""Of the Feistel network: four suffice for a permutation that nobody tells from a random one by its large N."""


def shuffled(places: np.ndarray, count: int, *, seed: int, stream: int) -> np.ndarray:
    """(K,) images of the places under one permutation of 0 … count − 1.

    A Feistel network permutes the numbers of 2 h bits; from an image beyond `count` one goes on to the image of that,
    until one is inside.

    Args:
        places: (K,) whole numbers, 0 ≤ k < count.
        count: how many are permuted, at most 2⁶².
        seed, stream: which permutation.

    Reference:
        M. Luby, C. Rackoff, SIAM J. Computing 17 (1988); J. Black, P. Rogaway, "Ciphers with arbitrary finite domains",
        CT-RSA 2002 (cycle walking).
    """
    half = np.uint64(max(1, -(-(count - 1).bit_length() // 2)))
    keys = mixed(np.uint64(seed) + mixed(np.arange(ROUNDS, dtype=np.uint64) + np.uint64(stream * ROUNDS)))
    images = _network(places.astype(np.uint64), half, keys)
    outside = np.flatnonzero(images >= count)
    while len(outside):
        images[outside] = _network(images[outside], half, keys)
        outside = outside[images[outside] >= count]
    return images.astype(np.int64)


def mixed(values: np.ndarray) -> np.ndarray:
    """The finaliser of SplitMix64: a permutation of the 64-bit numbers in which every bit depends on every bit.

    Reference:
        G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
    """
    z = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _network(values: np.ndarray, half: np.uint64, keys: np.ndarray) -> np.ndarray:
    mask = (np.uint64(1) << half) - np.uint64(1)
    left, right = values >> half, values & mask
    for key in keys:
        left, right = right, left ^ (mixed(right + key) >> (np.uint64(64) - half))
    return left << half | right
