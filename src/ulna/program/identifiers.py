"""Names that can stand in generated source, whatever a user calls a quantity."""

from __future__ import annotations

import keyword
import re

from ulna.program.instructions import Operation

_WORDS = """
abs alignas alignof arguments asm async auto await bool boolean break byte case catch char class complex const
constexpr continue debugger decltype default delete do double else enum eval exit export extends extern false final
finally flipped float for from function fused goto i386 if imaginary implements import in inline inputs instanceof int
interface kernel let linux long main math memcpy namespace native new noreturn np null nullptr odd one operator outputs
package private protected public real register restrict return short signed sizeof static struct super switch
synchronized template this thread_local throw throws transient true try typedef typename typeof undefined union unix
unsigned using var virtual void volatile while with yield zero
"""
_CALLED = {f"{each.value}{suffix}" for each in Operation for suffix in ("", "f")} | {"fabs", "fabsf"}
_RESERVED = frozenset({*_WORDS.split(), *keyword.kwlist, *_CALLED})
"""Words of Python, C, C++ and JavaScript, and what generated source refers to."""
_MACRO = re.compile(r"[A-Z][A-Z0-9_]+|_.*|u?int\w*_t|size_t")
"""Names that the headers of a C compiler may have taken."""

_INTERMEDIATE = re.compile(r"v\d+|in_\d+|total_\w+|\w*__\w*")
"""Names of intermediate values and of functions made on the way."""


def is_plain_name(name: str) -> bool:
    """Whether it can be the name of a variable in Python, C and JavaScript."""
    taken = name in _RESERVED or _MACRO.fullmatch(name) or _INTERMEDIATE.fullmatch(name)
    return name.isidentifier() and name.isascii() and not taken
