"""Values that an option cannot take are one clear line, like every other mistake."""

from __future__ import annotations

import pytest
from terminal import refused


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("simulate duffing --horizon long", "error: --horizon 'long': it is not a valid number."),
        ("simulate duffing --seed 1.5", "error: --seed '1.5': it is not a valid whole number."),
        ("simulate duffing --samples 1", "error: --samples '1': it must be at least 2."),
        ("design duffing --push-gain=-1", "error: --push-gain '-1': it must be at least 0."),
        ("simulate duffing --engine x", "error: --engine 'x': it is not one of 'taylor', 'implicit'."),
    ],
)
def test_a_value_that_an_option_cannot_take_is_one_line_that_names_it(line: str, said: str) -> None:
    assert refused(*line.split()) == said


def test_a_value_of_thousands_of_letters_does_not_bury_the_message() -> None:
    assert len(refused("analyse", "duffing", "--question", "a" * 5000)) < 1500
