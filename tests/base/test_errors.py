"""Messages are one clear line whatever names and values they quote."""

from __future__ import annotations

from ulna.base import UlnaError


def test_control_sequences_are_spelt_out_and_endless_words_cut() -> None:
    error = UlnaError(f"the name '{'a' * 3000}'", "it has \x1b[2J in it.", "Give another.")
    assert str(error) == f"the name '{'a' * 59}... (3003 characters) it has \\x1b[2J in it. Give another."
    assert str(UlnaError("a" * 290, "no.")) == f"{'a' * 290}: no."
