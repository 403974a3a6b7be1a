"""The examples in the help of public names run and show what they say."""

from __future__ import annotations

import doctest
import inspect

import numpy as np
import pytest

import ulna


def _example(name: str, value: object) -> doctest.DocTest:
    text = inspect.getdoc(value) or ""
    return doctest.DocTestParser().get_doctest(text, {"ulna": ulna, "np": np}, name, None, 0)


def _failures(test: doctest.DocTest) -> int:
    return doctest.DocTestRunner(verbose=False).run(test).failed


SHOWING = [
    name
    for name in ulna.__all__
    if name not in ("__version__", "TIME") and ">>>" in (inspect.getdoc(getattr(ulna, name)) or "")
]


@pytest.mark.parametrize("name", SHOWING)
def test_the_example_of_a_public_name_shows_what_it_says(name: str) -> None:
    assert _failures(_example(name, getattr(ulna, name))) == 0


def test_an_example_that_says_something_else_is_noticed(capsys: pytest.CaptureFixture[str]) -> None:
    def wrong() -> None:
        """Nothing.

        >>> 1 + 1
        3
        """

    assert _failures(_example("wrong", wrong)) == 1
    assert "Expected" in capsys.readouterr().out
