"""The test run checks every call into ulna against its annotations."""

from __future__ import annotations

from typing import Any

import pytest
from beartype.roar import BeartypeCallHintParamViolation

from ulna import UlnaError, Verdict


def test_a_call_with_a_wrong_type_is_refused_while_tests_run() -> None:
    wrong: Any = 3
    with pytest.raises(BeartypeCallHintParamViolation):
        UlnaError(wrong, "found")


def test_a_dataclass_with_a_wrong_field_is_refused_while_tests_run() -> None:
    wrong: Any = 3
    with pytest.raises(BeartypeCallHintParamViolation):
        Verdict(claim="claim", status=wrong)
