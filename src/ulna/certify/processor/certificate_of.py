"""`sampled_certificate_of`: the certificate of a loop on its processor, its program as formulas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from ulna.certify.certificate import SAMPLED, SampledCertificate
from ulna.certify.errors import CertifyError
from ulna.certify.processor.linearised import UNIT, Linearised
from ulna.loop import Loop, fingerprint
from ulna.program import Kernel, Operation

_SIGNS = {Operation.ADD: "+", Operation.SUB: "-", Operation.MUL: "*", Operation.DIV: "/", Operation.POW: "**"}
_TESTS = (Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL, Operation.AND, Operation.OR, Operation.NOT)
_NAMED = (
    *(Operation.SQRT, Operation.EXP, Operation.LOG, Operation.SIN, Operation.COS, Operation.TAN),
    *(Operation.ASIN, Operation.ACOS, Operation.ATAN, Operation.SINH, Operation.COSH, Operation.TANH),
    *(Operation.ASINH, Operation.ACOSH, Operation.ATANH, Operation.MIN, Operation.MAX),
)


def sampled_certificate_of(
    loop: Loop, linear: Linearised, start: np.ndarray, boxes: Sequence[np.ndarray], shown: dict[str, int]
) -> SampledCertificate:
    """What a second program needs to check an ultimate bound. start, boxes: (n,) SI."""
    found = linear.map
    return SampledCertificate(
        name=found.name,
        design=fingerprint(loop),
        theorem=SAMPLED,
        states=found.states,
        inputs=tuple(s.name for s in found.inputs),
        rates=tuple(map(str, found.rates)),
        readings=tuple(map(str, found.readings)),
        half_steps=tuple(_exact(each.half_step) for each in found.sensors),
        lower=tuple(_end(each.lower) for each in found.sensors),
        upper=tuple(_end(each.upper) for each in found.sensors),
        memory=found.memory,
        program=program_text(found.step),
        first=program_text(found.first),
        stretches=tuple((str(length), *slots) for length, slots in found.stretches),
        center=_texts(linear.center),
        scale=_texts(linear.scale),
        matrix=_whole(linear.A),
        injection=_whole(linear.N),
        powers=str(linear.sums.powers),
        start=_texts(start),
        boxes=tuple(_texts(box) for box in boxes),
        shown={name: str(place) for name, place in shown.items()},
    )


def program_text(kernel: Kernel) -> tuple[tuple[str, str], ...]:
    """Name and formula of every instruction, then `<output>_new` of every output; constants exactly as they are.

    Raises:
        CertifyError: for what jumps: a choice other than the smaller or larger of two.
    """
    first, names = len(kernel.inputs), list(kernel.inputs)
    lines: list[tuple[str, str]] = []
    for place, each in enumerate(kernel.instructions, start=first):
        if each.operation is Operation.CONSTANT:
            names.append(f"({_exact(each.value)})")
            continue
        given = [names[k] for k in each.operands]
        test = kernel.instructions[each.operands[0] - first] if each.operation is Operation.SELECT else None
        if each.operation in _TESTS:
            names.append("")
            continue
        if each.operation in _SIGNS:
            text = f"{given[0]} {_SIGNS[each.operation]} {given[1]}"
        elif each.operation is Operation.NEG:
            text = f"-{given[0]}"
        elif each.operation is Operation.FMA:
            text = f"{given[0]}*{given[1]} + {given[2]}"
        elif each.operation in _NAMED:
            text = f"{each.operation}({', '.join(given)})"
        elif test is not None and set(test.operands) == set(each.operands[1:]) and test.operation in _TESTS[:2]:
            smaller = test.operands == each.operands[1:]
            text = f"{'min' if smaller else 'max'}({given[1]}, {given[2]})"
        else:
            raise CertifyError(
                f"a certificate of '{kernel.name}'",
                f"its program has a choice that may jump ('{each.operation}').",
                "Leave out what switches: anti-windup, watches.",
            )
        names.append(f"w{place}")
        lines.append((f"w{place}", text))
    outputs = [(f"{name}_new", names[k]) for name, k in zip(kernel.outputs, kernel.results, strict=True)]
    return (*lines, *outputs)


def _exact(value: float) -> str:
    return str(Fraction(value))


def _end(value: float) -> str:
    return _exact(value) if math.isfinite(value) else ""


def _texts(values: np.ndarray) -> tuple[str, ...]:
    return tuple(map(_exact, values.tolist()))


def _whole(matrix: np.ndarray) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(str(int(v * UNIT)) for v in row) for row in matrix.tolist())
