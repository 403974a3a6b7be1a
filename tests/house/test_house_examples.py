"""The examples in the help of public names run and show what they say."""

from __future__ import annotations

import doctest
import inspect
from pathlib import Path

import numpy as np
import pytest

import ulna


def _example(name: str, value: object) -> doctest.DocTest:
    text = inspect.getdoc(value) or ""
    return doctest.DocTestParser().get_doctest(text, {"ulna": ulna, "np": np}, name, None, 0)


def _failures(test: doctest.DocTest) -> int:
    return doctest.DocTestRunner(verbose=False).run(test).failed


@pytest.mark.parametrize("name", [name for name in ulna.__all__ if name not in ("__version__", "TIME")])
def test_every_public_name_has_an_example_that_shows_what_it_says(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    example = _example(name, getattr(ulna, name))
    assert example.examples
    assert _failures(example) == 0


def test_an_example_that_says_something_else_is_noticed(capsys: pytest.CaptureFixture[str]) -> None:
    def wrong() -> None:
        """Nothing.

        >>> 1 + 1
        3
        """

    assert _failures(_example("wrong", wrong)) == 1
    assert "Expected" in capsys.readouterr().out
