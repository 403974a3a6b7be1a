"""No remedy that the library gives reaches the terminal as Python: the whole source is gone over."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from terminal import python_words

import ulna
from ulna.base import DesignError, UlnaError
from ulna.cli.wording import in_terminal_words, is_python, told

SOURCE = Path(ulna.__file__).parent

NOT_AT_THE_TERMINAL = {
    "campaign/answers/fan_chart.py": "fan charts have no settings there",
    "campaign/plans/grid.py": "a grid is made of steps",
    "campaign/plans/probability.py": "distributions are made from text",
    "campaign/runs/experiment.py": "windows and engines of a campaign have no option",
    "campaign/runs/measures.py": "windows have no option",
    "deploy/compiled.py": "compiled engines are for Python",
    "loop/fitted.py": "a guard has no option",
    "loop/loop.py": "a loop is made from options",
    "loop/watches.py": "a guard has no option",
    "program": "programs are made inside",
    "sim/ensemble.py": "an ensemble is a sweep there",
    "sim/inputs.py": "inputs are numbers and formulas there",
    "sim/continuous/rules.py": "expressions are typed as text",
    "sim/python_control.py": "for Python only",
    "sim/sampled/engine.py": "fixed steps have no option",
    "sim/sampled/work.py": "an estimator on a log is for Python",
    "studies/prosthesis/contenders.py": "of the work on the study itself",
    "symbolic": "of formulas themselves",
    "system/system.py": "of systems made in Python",
    "system/holder.py": "of values handed over in Python",
}
"""Places whose remedies no command can meet, and why."""


@cache
def remedies() -> tuple[tuple[str, str], ...]:
    """(place, hint) of every error in the source, what is filled in as 1."""
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        place = str(path.relative_to(SOURCE))
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "Error(" in text else ():
            if isinstance(node, ast.Call) and getattr(node.func, "id", "").endswith("Error") and len(node.args) > 2:
                found.extend((f"{place}:{node.lineno}", text) for text in _texts(node.args[2]))
    return tuple(found)


def _texts(node: ast.expr) -> list[str]:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.JoinedStr):
        return ["".join(str(part.value) if isinstance(part, ast.Constant) else "1" for part in node.values)]
    if isinstance(node, ast.IfExp):
        return _texts(node.body) + _texts(node.orelse)
    return []


def _reachable(place: str) -> bool:
    return not any(place.startswith(each) for each in NOT_AT_THE_TERMINAL)


def test_the_source_has_remedies_to_go_over():
    assert len(remedies()) > 200
    assert any(is_python(hint) for _, hint in remedies())


def test_no_remedy_is_python_at_the_terminal():
    for place, hint in remedies():
        if is_python(hint):
            said = told(UlnaError("a plant", "it is so.", hint))
            assert python_words(said) == [], place
            assert not is_python(said), place
            if _reachable(place):
                # What can be met there is translated, not left out.
                assert not is_python(in_terminal_words(hint)), (place, hint)


def test_a_remedy_that_nobody_can_type_is_left_out_and_the_rest_kept():
    error = DesignError("a law", "there is none.", "Use `strange_function(plant)`. Or give other poles.")
    assert told(error) == "a law: there is none. Or give other poles."
    assert is_python("Give Strange(thing=1).")
    assert not is_python("Write --vary 'm2=uniform(0,5)', T(x), sin(t), [g, ad_f g].")
