import pytest

from ulna.base import Status, UlnaError, Verdict, all_of


def test_proved_and_refuted_verdicts_are_truth_values():
    assert Verdict.proved("a")
    assert not Verdict.refuted("a", point=1)


@pytest.mark.parametrize("verdict", [Verdict.supported("a"), Verdict.undecided("a")])
def test_an_unproved_verdict_refuses_to_be_a_truth_value(verdict):
    with pytest.raises(UlnaError, match="not a yes or a no"):
        bool(verdict)


def test_a_conjunction_is_as_sure_as_its_least_sure_part():
    sure, likely, unknown, wrong = (
        Verdict.proved("sure"),
        Verdict.supported("likely", points=5),
        Verdict.undecided("unknown"),
        Verdict.refuted("wrong", at="x = 1"),
    )
    assert all_of("all", [sure, sure]).status is Status.PROVED
    assert all_of("all", [sure, likely]).status is Status.SUPPORTED
    assert all_of("all", [unknown, likely]).status is Status.UNDECIDED
    refuted = all_of("all", [unknown, wrong, likely])
    assert refuted.status is Status.REFUTED
    assert refuted.evidence["because"] == "wrong"
    assert refuted.evidence["at"] == "x = 1"


def test_evidence_cannot_be_changed():
    with pytest.raises(TypeError):
        Verdict.proved("a", x=1).evidence["x"] = 2  # pyright: ignore[reportIndexIssue]
