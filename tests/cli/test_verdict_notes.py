"""What stands below a verdict never reads as its opposite."""

from __future__ import annotations

import pytest

from ulna.base import Verdict, all_of
from ulna.cli.analyse import _evidence


@pytest.mark.parametrize(
    ("part", "said"),
    [(Verdict.refuted("G_2 is involutive"), "what fails"), (Verdict.undecided("G_2 is involutive"), "what is open")],
)
def test_the_claim_that_fails_is_not_called_a_reason(part: Verdict, said: str) -> None:
    for whole in (all_of("all G_i are involutive", [part]), part.restated("all G_i are involutive")):
        assert _evidence(whole) == f"{said}: G_2 is involutive"
