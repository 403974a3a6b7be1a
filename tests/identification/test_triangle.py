"""The triangular form of tall matrices, block by block."""

from __future__ import annotations

import numpy as np
import pytest

from ulna.identification.fitting.solve import triangle


@pytest.mark.parametrize("shape", [(3, 5), (200, 5), (5000, 5), (5003, 44)])
def test_a_triangle_has_the_products_of_its_matrix(shape: tuple[int, int]) -> None:
    rows = np.random.default_rng(1).normal(size=shape)
    found = triangle(rows)
    assert found.shape == (shape[1], shape[1])
    assert np.allclose(found, np.triu(found))
    assert found.T @ found == pytest.approx(rows.T @ rows, abs=1e-9 * shape[0])
