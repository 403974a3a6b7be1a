"""heyoka is held to one thread while runs are shared out, and has its own number back afterwards."""

from __future__ import annotations

import heyoka as hy
import pytest

from ulna.sim.continuous.one_thread import one_thread


def test_heyoka_keeps_to_one_thread_inside_and_gets_its_number_back() -> None:
    before = hy.get_nthreads()
    hy.set_nthreads(2)
    try:
        with one_thread():
            with one_thread():
                assert hy.get_nthreads() == 1
            assert hy.get_nthreads() == 1
        assert hy.get_nthreads() == 2
        with pytest.raises(ValueError, match="inside"), one_thread():
            raise ValueError("inside")
        assert hy.get_nthreads() == 2
    finally:
        hy.set_nthreads(before)
