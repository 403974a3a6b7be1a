"""The import statements of a text, read once however many rules ask for them."""

from __future__ import annotations

import ast
from functools import cache


@cache
def imports(text: str) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """Every import statement, anywhere in it."""
    return tuple(node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom))
