import copy
import pickle
from types import MappingProxyType

import pytest

from ulna.base import Status, UlnaError, Verdict, all_of
from ulna.design import Answer


@pytest.mark.parametrize("status", Status)
def test_a_verdict_refuses_to_be_a_bool_and_says_what_to_ask(status):
    with pytest.raises(UlnaError, match=rf"'a': it is {status}.*Ask \.holds"):
        bool(Verdict(claim="a", status=status))


def test_a_verdict_is_pickled_and_copied_and_stays_read_only():
    verdict = Verdict.refuted("a", number=3)
    for again in (pickle.loads(pickle.dumps(verdict)), copy.deepcopy(verdict)):  # noqa: S301 - our own bytes
        assert again == verdict
        assert isinstance(again.evidence, MappingProxyType)


def test_an_answer_of_an_analysis_refuses_as_well():
    with pytest.raises(UlnaError, match=r"'a': it is proved, with the value 3.*Ask \.value"):
        bool(Answer(verdict=Verdict.proved("a"), value=3))


def test_verdicts_answer_by_holds_and_fails():
    answers = {verdict.status: (verdict.holds, verdict.fails) for verdict in map(_verdict, Status)}
    assert answers == {
        Status.PROVED: (True, False),
        Status.SUPPORTED: (True, False),
        Status.UNDECIDED: (False, False),
        Status.REFUTED: (False, True),
    }


@pytest.mark.parametrize("status", Status)
def test_a_verdict_restated_keeps_its_answer_its_evidence_and_what_it_rests_on(status):
    first = Verdict(claim="a", status=status, evidence={"rank": 2})
    again = first.restated("b", point=3).restated("c")
    assert (again.claim, again.status) == ("c", status)
    assert dict(again.evidence) == {_PART.get(status, "because"): "a", "rank": 2, "point": 3}
    assert again.rests_on == "a"


_PART = {Status.REFUTED: "fails", Status.UNDECIDED: "open"}


@pytest.mark.parametrize("status", Status)
def test_what_an_answer_rests_on_never_reads_as_its_opposite(status):
    given = Verdict(claim="a", status=status, evidence={"fails": "old", "because": "b", "rank": 2})
    assert given.rests_on == "b"
    assert ("because" in given.evidence) is given.holds
    assert Verdict(claim="a", status=status).rests_on is None


def _verdict(status):
    return Verdict(claim="a", status=status)


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
    assert refuted.evidence["fails"] == "wrong"
    assert refuted.evidence["at"] == "x = 1"


def test_evidence_cannot_be_changed():
    with pytest.raises(TypeError):
        Verdict.proved("a", x=1).evidence["x"] = 2  # pyright: ignore[reportIndexIssue]
