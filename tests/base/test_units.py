from fractions import Fraction

import pytest

from ulna.base import UnitError, coherent, dimension_text, unit


def test_factors_to_si_are_exact():
    assert unit("mH").factor == Fraction(1, 1000)
    assert unit("rad/s").coherent
    assert unit("N*m/A").coherent
    assert unit("ohm").coherent


def test_degrees_are_kept_apart_because_pi_is_not_rational():
    assert unit("deg/s").degrees == 1
    assert not unit("deg").coherent


@pytest.mark.parametrize(
    ("text", "meant"),
    [("bar", "Pa"), ("mm", "m"), ("deg", "rad"), ("rpm", "rad/s"), ("km/h", "m/s"), ("kHz", "Hz"), ("%", "1"),
     ("l/min", "m^3/s"), ("mm/(s*bar)", "SI of length^2*time/mass")],
)  # fmt: skip
def test_the_unit_without_a_factor_is_named(text, meant):
    assert coherent(text) == meant


def test_equal_dimensions_have_equal_text():
    assert dimension_text(unit("V*s/rad").dimension) == dimension_text(unit("N*m/A").dimension)
    assert dimension_text(unit("rad").dimension) == "1"


@pytest.mark.parametrize(
    ("text", "factor", "dimension"),
    [
        ("V/(rad/s)", 1, {"mass": 1, "length": 2, "time": -2, "current": -1}),
        ("kg m^2", 1, {"mass": 1, "length": 2}),
        ("kg·cm²", Fraction(1, 10**4), {"mass": 1, "length": 2}),
        ("µF/m**2", Fraction(1, 10**6), {"mass": -1, "length": -4, "time": 4, "current": 2}),
        ("W/(m^2*K)", 1, {"mass": 1, "time": -3, "temperature": -1}),
        ("s^-1", 1, {"time": -1}),
        ("mAh", Fraction(18, 5), {"current": 1, "time": 1}),
        ("ml/min", Fraction(1, 6 * 10**7), {"length": 3, "time": -1}),
        ("lbf*ft", Fraction("4.4482216152605") * Fraction("0.3048"), {"mass": 1, "length": 2, "time": -2}),
        ("%", Fraction(1, 100), {}),
    ],
)
def test_units_of_plants_motors_and_logs_are_read_exactly(text, factor, dimension):
    found = unit(text)
    assert (found.factor, found.degrees, found.dimension) == (factor, 0, dimension)


def test_a_turn_is_360_degrees():
    assert (unit("rpm").factor, unit("rpm").degrees, unit("rpm").dimension) == (6, 1, {"time": -1})


@pytest.mark.parametrize(
    "text", ["m)*(s", "(m", "m)", "()", "*m", "m*", "m^s", "m^10", "2*m", "1/", "kkg", "kdeg", "mmin"]
)
def test_half_a_unit_is_refused(text):
    with pytest.raises(UnitError):
        unit(text)


@pytest.mark.parametrize("text", ["foo", "__import__('os')", "9**9**9", "m**99", "degC", "x" * 200, "m//s"])
def test_what_is_no_unit_is_refused(text):
    with pytest.raises(UnitError):
        unit(text)


@pytest.mark.parametrize(
    ("written", "meant"),
    [("Ohm", "'ohm'"), ("N*volts", "'V'"), ("MHZ", "'mHz' or 'MHz'"), ("Seconds", "'s'"), ("NM", "'Nm'")],
)
def test_a_unit_in_full_or_in_other_letters_is_told_its_symbol(written: str, meant: str) -> None:
    with pytest.raises(UnitError, match=f"Did you mean {meant}\\?"):
        unit(written)


def test_what_resembles_no_unit_is_not_given_one() -> None:
    with pytest.raises(UnitError) as caught:
        unit("furlong")
    assert "Did you mean" not in str(caught.value)
