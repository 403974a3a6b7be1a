import numpy as np
import pytest
import sympy as sp

from ulna.base import DesignError, UlnaWarning
from ulna.design.gains import LinearQuadratic, Poles


def test_the_papers_poles_give_the_papers_gains_exactly():
    assert Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8).coefficients(3) == (128, 48, 12)
    assert Poles(-9, -10, -11).coefficients(3) == (990, 299, 30)


def test_decimal_poles_are_taken_by_their_text():
    assert Poles("-2+3.46j", "-2-3.46j", -8).coefficients(3)[0] == sp.Rational("127.7728")
    assert Poles(-2 + 3.46j, -2 - 3.46j, -8).coefficients(3)[0] == sp.Rational("127.7728")


@pytest.mark.parametrize(
    "given",
    [([-1, "-2+j", -2 - 1j],), ("-1, -2+j, -2-j",), (np.array([-1, -2 + 1j, -2 - 1j]),), ((-1, "-2+j"), "-2-j")],
)
def test_poles_come_singly_in_lists_arrays_and_text(given):
    assert Poles(*given).values == Poles(-1, "-2+j", "-2-j").values


@pytest.mark.parametrize("poles", [("-2+3j",), ("x",), ("nan",), (float("inf"),), ("__import__('os')",), ("-1,,-2",)])
def test_unusable_poles_are_refused(poles):
    with pytest.raises(DesignError):
        Poles(*poles)


def test_a_wrong_number_of_poles_says_how_many_are_needed():
    with pytest.raises(DesignError, match="2 given .* 3 needed"):
        Poles(-1, -2).coefficients(3)


def test_a_conjugate_pair_may_not_be_dealt_to_two_chains():
    with pytest.raises(DesignError, match="conjugate"):
        Poles(-1, "-2+j", "-2-j", -3).polynomials([2, 2])


def test_unstable_poles_are_allowed_with_a_warning():
    with pytest.warns(UlnaWarning, match="not in the open left half-plane"):
        assert Poles(1, -2).coefficients(2) == (-2, 1)


def test_linear_quadratic_gains_solve_the_double_integrator():
    low, high = LinearQuadratic(state_weights=(1.0, 0.0)).coefficients(2)
    assert float(low) == pytest.approx(1.0, abs=1e-10)
    assert float(high) == pytest.approx(2**0.5, abs=1e-10)


def test_one_weight_serves_every_coordinate_and_several_are_dealt_out_chain_after_chain():
    assert LinearQuadratic(state_weights=9).coefficients(3) == LinearQuadratic(state_weights=[9, 9, 9]).coefficients(3)
    first, second = LinearQuadratic(state_weights=[100, 1, 4, 0, 7]).polynomials([2, 3])
    assert first == LinearQuadratic(state_weights=[100, 1]).coefficients(2)
    assert second == LinearQuadratic(state_weights=[4, 0, 7]).coefficients(3)


@pytest.mark.parametrize("count", [2, 4])
def test_a_wrong_number_of_weights_is_neither_filled_up_nor_cut(count):
    with pytest.raises(DesignError, match=f"{count} given .* 3 needed"):
        LinearQuadratic(state_weights=[100] + [1] * (count - 1)).coefficients(3)


@pytest.mark.parametrize(
    "weights",
    [{"input_weight": 0}, {"state_weights": []}, {"state_weights": [1, -1]}, {"state_weights": float("nan")}],
)
def test_weights_without_a_stable_optimum_are_refused(weights):
    with pytest.raises(DesignError, match="must be positive"):
        LinearQuadratic(**weights)


def test_the_first_coordinate_of_every_chain_needs_a_weight():
    with pytest.raises(DesignError, match="each chain's first coordinate"):
        LinearQuadratic(state_weights=[1, 1, 0, 1]).polynomials([2, 2])
