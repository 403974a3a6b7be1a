"""Output folders and results."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from ulna.base import UlnaError, Verdict
from ulna.report import output_folder, plain, results_text


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_folder_appears_whole(tmp_path: Path) -> None:
    with output_folder(tmp_path / "deep" / "out") as place:
        (place / "results.json").write_text("{}")
        assert not (tmp_path / "deep" / "out").exists()
    assert _names(tmp_path / "deep") == ["out"]
    assert _names(tmp_path / "deep" / "out") == ["results.json"]


def test_an_earlier_output_is_replaced_whole(tmp_path: Path) -> None:
    for name in ("old.svg", "new.svg"):
        with output_folder(tmp_path / "out") as place:
            (place / "results.json").write_text("{}")
            (place / name).write_text("")
    assert _names(tmp_path / "out") == ["new.svg", "results.json"]
    assert _names(tmp_path) == ["out"]


def test_a_failure_leaves_the_earlier_output_and_nothing_else(tmp_path: Path) -> None:
    with output_folder(tmp_path / "out") as place:
        (place / "results.json").write_text("first")

    def break_off() -> None:
        with output_folder(tmp_path / "out") as place:
            (place / "results.json").write_text("second")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        break_off()
    assert (tmp_path / "out" / "results.json").read_text() == "first"
    assert _names(tmp_path) == ["out"]


def test_a_folder_with_other_files_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("dear")
    with pytest.raises(UlnaError, match="not an earlier output"), output_folder(tmp_path):
        pass
    assert _names(tmp_path) == ["thesis.tex"]


def test_an_empty_folder_may_be_taken(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with output_folder(tmp_path / "out") as place:
        (place / "results.json").write_text("{}")
    assert _names(tmp_path / "out") == ["results.json"]


def test_a_file_in_the_way_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(UlnaError, match="there is a file of this name"), output_folder(tmp_path / "out"):
        pass
    with pytest.raises(UlnaError, match="cannot be written"), output_folder(tmp_path / "out" / "below"):
        pass
    assert _names(tmp_path) == ["out"]


def test_an_unwritable_place_is_one_clear_error() -> None:
    with pytest.raises(UlnaError, match="cannot be written") as caught, output_folder("/proc/ulna-out"):
        pass
    assert caught.value.hint


def test_results_keep_their_order_and_carry_no_date() -> None:
    text = results_text({"b": sp.Rational(100, 51), "a": [1.5, 2 + 3j, np.float64(0.25), np.arange(2)]})
    assert list(json.loads(text)) == ["b", "a"]
    assert json.loads(text) == {"b": "100/51", "a": [1.5, {"re": 2.0, "im": 3.0}, 0.25, [0, 1]]}
    assert text == results_text({"b": sp.Rational(100, 51), "a": [1.5, 2 + 3j, np.float64(0.25), np.arange(2)]})


def test_expressions_verdicts_and_sets_become_plain_data() -> None:
    x = sp.Symbol("x", real=True)
    assert plain(sp.Matrix([[x, 1]])) == [["x", "1"]]
    assert plain(Verdict.proved("it holds", rank=3)) == {
        "claim": "it holds",
        "status": "proved",
        "evidence": {"rank": 3},
    }
    assert plain(frozenset({"b", "a"})) == ["a", "b"]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), object(), complex(0, float("nan"))])
def test_what_json_cannot_hold_is_refused_with_its_place(value: object) -> None:
    with pytest.raises(UlnaError, match=r"results\.loops\[1\]"):
        results_text({"loops": [0.0, value]})


def test_an_earlier_output_with_a_strange_file_in_it_is_not_replaced(tmp_path: Path) -> None:
    holds = ("results.json", "figures/*.svg")
    with output_folder(tmp_path / "out", holds=holds) as place:
        (place / "results.json").write_text("{}")
        (place / "figures").mkdir()
        (place / "figures" / "one.svg").write_text("<svg/>")
    with output_folder(tmp_path / "out", holds=holds) as place:
        (place / "results.json").write_text("{}")
    for strange in ("thesis.txt", "deep/results.json"):
        (tmp_path / "out" / strange).parent.mkdir(exist_ok=True)
        (tmp_path / "out" / strange).write_text("precious")
        with pytest.raises(UlnaError, match="beside an earlier output"), output_folder(tmp_path / "out", holds=holds):
            pass
        assert (tmp_path / "out" / strange).read_text() == "precious"
        (tmp_path / "out" / strange).unlink()
