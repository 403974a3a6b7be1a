"""One comparator per answer key: `complaint` says what is wrong with a value, None if nothing is.

Numbers and bools are compared as they are; expressions as functions; transformations, laws, observers and zero dynamics
by what they must do to the plant, since they are not unique.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from answer_checks import STATIC, Answers, Check
from answer_facts import Facts
from dynamic_checks import DYNAMIC


def _same(key: str, _plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    return None if found[key] == known[key] else f"{found[key]} instead of {known[key]}"


CHECKS: dict[str, Check] = STATIC | DYNAMIC
"""Comparator by key; keys that are not here are compared as they are."""


def complaint(key: str, plant: Facts, found: Mapping[str, Any], known: Answers) -> str | None:
    """What is wrong with found[key], judged by known[key] and by the plant itself; None if nothing is.

    Args:
        key: of the answer.
        plant: the plant.
        found: values by key, expressions as SymPy has them.
        known: the plant's answers, expressions as text.
    """
    if found.get(key) is None and key != "decoupling_det":
        return "no value"
    return CHECKS.get(key, _same)(key, plant, found, known)
