"""What stands below a verdict never reads as its opposite."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import refused, ulna

from ulna.base import Verdict, all_of
from ulna.cli.analyse import _evidence


@pytest.mark.parametrize(
    ("part", "said"),
    [(Verdict.refuted("G_2 is involutive"), "what fails"), (Verdict.undecided("G_2 is involutive"), "what is open")],
)
def test_the_claim_that_fails_is_not_called_a_reason(part: Verdict, said: str) -> None:
    for whole in (all_of("all G_i are involutive", [part]), part.restated("all G_i are involutive")):
        assert _evidence(whole) == f"{said}: G_2 is involutive"


@pytest.mark.filterwarnings("default::ulna.base.UlnaWarning")
def test_a_proof_that_fails_names_what_fails() -> None:
    unstable = ["duffing", "--controller-poles", "1,2", "--global"]
    said = ulna("prove", *unstable).stdout
    assert "refuted" in said
    assert "what fails: " in said
    assert "because" not in said


DISCRETE = """
name = "digital filter"
time = "discrete"
period = 0.01
states = { q = "Q" }
inputs = { u = {} }
outputs = { y = "q" }
"""


@pytest.mark.parametrize(
    ("rate", "said"), [("0.9*q + 0.1*u", "(equilibrium)"), ("q + 1/2", "not at rest there: q changes by 1/2 a period")]
)
def test_a_plant_in_discrete_time_is_analysed_at_the_terminal(rate: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "filter.toml").write_text(DISCRETE.replace("Q", rate))
    done = ulna("analyse", str(tmp_path / "filter.toml"))
    assert done.exit_code == 0, done.output
    assert said in " ".join(done.stdout.split())


@pytest.mark.parametrize("asked", [[], ["--local"], ["--lqr", "1:1"]])
def test_no_law_for_continuous_time_is_given_for_discrete_time(asked: list[str], tmp_path: Path) -> None:
    (tmp_path / "filter.toml").write_text(DISCRETE.replace("Q", "0.9*q + 0.1*u"))
    assert "it moves in steps of 0.01 s" in refused("design", str(tmp_path / "filter.toml"), *asked)
