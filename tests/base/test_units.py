from fractions import Fraction

import pytest

from ulna.base import UnitError, dimension_text, unit


def test_factors_to_si_are_exact():
    assert unit("mH").factor == Fraction(1, 1000)
    assert unit("rad/s").coherent
    assert unit("N*m/A").coherent
    assert unit("ohm").coherent


def test_degrees_are_kept_apart_because_pi_is_not_rational():
    assert unit("deg/s").degrees == 1
    assert not unit("deg").coherent


def test_equal_dimensions_have_equal_text():
    assert dimension_text(unit("V*s/rad").dimension) == dimension_text(unit("N*m/A").dimension)
    assert dimension_text(unit("rad").dimension) == "1"


@pytest.mark.parametrize("text", ["foo", "__import__('os')", "9**9**9", "m**99", "degC", "x" * 200, "m//s"])
def test_what_is_no_unit_is_refused(text):
    with pytest.raises(UnitError):
        unit(text)
