"""No file above 400 lines and no function above 80 unless the file's docstring says why."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILE_LIMIT = 400
FUNCTION_LIMIT = 80


def _too_long(text: str) -> Iterator[str]:
    tree = ast.parse(text)
    reasons = ast.get_docstring(tree) or ""
    lines = len(text.splitlines())
    if lines > FILE_LIMIT and f"Longer than {FILE_LIMIT} lines because" not in reasons:
        yield f"{lines} lines"
    if f"Longer than {FUNCTION_LIMIT} lines because" in reasons:
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.end_lineno is not None:
            length = node.end_lineno - node.lineno + 1
            if length > FUNCTION_LIMIT:
                yield f"{node.name} has {length} lines"


def test_files_and_functions_are_short() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {what}"
        for folder in ("src", "tests", "benchmarks")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for what in _too_long(path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_a_long_file_is_noticed_and_can_say_why() -> None:
    body = "x = 1\n" * 400
    assert list(_too_long('"""A table."""\n' + body)) == ["401 lines"]
    assert list(_too_long('"""A table. Longer than 400 lines because it is one table."""\n' + body)) == []


def test_a_long_function_is_noticed_and_can_say_why() -> None:
    function = "def long() -> None:\n" + "    x = 1\n" * 80
    assert list(_too_long(function)) == ["long has 81 lines"]
    assert list(_too_long('"""Longer than 80 lines because it is one formula."""\n' + function)) == []
