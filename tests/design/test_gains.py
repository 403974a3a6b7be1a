import pytest
import sympy as sp

from ulna.base import DesignError, UlnaWarning
from ulna.design.control.gains import LinearQuadratic, Poles


def test_the_papers_poles_give_the_papers_gains_exactly():
    assert Poles("-2+2*sqrt(3)*j", "-2-2*sqrt(3)*j", -8).coefficients(3) == (128, 48, 12)
    assert Poles(-9, -10, -11).coefficients(3) == (990, 299, 30)


def test_decimal_poles_are_taken_by_their_text():
    assert Poles("-2+3.46j", "-2-3.46j", -8).coefficients(3)[0] == sp.Rational("127.7728")
    assert Poles(-2 + 3.46j, -2 - 3.46j, -8).coefficients(3)[0] == sp.Rational("127.7728")


@pytest.mark.parametrize("poles", [("-2+3j",), ("x",), ("nan",), (float("inf"),), ("__import__('os')",)])
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
    with pytest.raises(DesignError):
        LinearQuadratic(input_weight=0.0)
