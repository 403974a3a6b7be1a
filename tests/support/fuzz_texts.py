"""Texts that go wrong: bytes of good ones changed, cut, doubled and exchanged for what has broken readers before."""

from __future__ import annotations

import random

DICTIONARY = (
    *("true", "nan", "-inf", "1e999999999", "1e-999999999", "9" * 40, "0x1p9", "1_0", "[]", "{}", "null", '""', "''"),
    *("sqrt(", "log(0)", "exp(exp(", "min(", "max(", "abs(", "Piecewise((", ", True))", "x < 1", "True", "/0", "**"),
    *("\x1b[2J", "\x00", "\ufeff", "θ", "\u202e", "\ud7ff", "\\u0000", "../../x", "time", "lambda", "__class__"),
    *("(" * 60, "-" * 60, "a" * 200, "=", "==", "[", "]", "{", "}", '"', "\n", "\r", ",", ";", ":", "#", "°", "²"),
)


def mutated(text: bytes, chance: random.Random, *, most: int = 4) -> bytes:
    """The text with one to `most` changes."""
    changed = bytearray(text)
    for _ in range(chance.randint(1, most)):
        place = chance.randrange(len(changed) + 1)
        end = min(len(changed), place + chance.choice((1, 1, 2, 5, 20)))
        match chance.randrange(6):
            case 0:
                changed[place:end] = b""
            case 1:
                changed[place:place] = changed[place:end]
            case 2:
                changed[place:place] = chance.choice(DICTIONARY).encode()
            case 3:
                changed[place:end] = chance.choice(DICTIONARY).encode()
            case 4 if place < len(changed):
                changed[place] ^= 1 << chance.randrange(8)
            case 5:
                other = chance.randrange(len(changed) + 1)
                changed[place:end] = changed[other : other + end - place]
    return bytes(changed)


def formula(chance: random.Random, names: tuple[str, ...], depth: int = 3) -> str:
    """A formula with exp, log, tanh, roots and decimals, as models of everyday devices have them."""
    if depth == 0 or chance.random() < 0.2:
        return chance.choice((*names, *names, "0.93", "38.68", "1e-9", "2", "1/3", "0.0259", "pi", "9.81", "1000"))
    inner = formula(chance, names, depth - 1)
    match chance.randrange(9):
        case 0:
            return f"{chance.choice(('exp', 'log', 'tanh', 'sqrt', 'sin', 'cos', 'atan', 'abs', 'sign'))}({inner})"
        case 1:
            return f"({inner})**{chance.choice(('2', '3', '0.5', '(1/3)', '(-1)', '1.5', '(-0.7)'))}"
        case 2:
            return f"exp(-({inner})/{chance.choice(('0.93', '0.0259', '300'))})"
        case 3:
            return f"({inner})/({formula(chance, names, depth - 1)})"
        case 4:
            return f"{chance.choice(('min', 'max'))}({inner}, {formula(chance, names, depth - 1)})"
        case 5:
            return f"({inner})*({formula(chance, names, depth - 1)})"
        case _:
            return f"{inner} {chance.choice('+-')} {formula(chance, names, depth - 1)}"


def plant(chance: random.Random) -> str:
    """A plant file with one to three states."""
    states = tuple(f"x{k + 1}" for k in range(chance.randint(1, 3)))
    names = (*states, "p") if chance.random() < 0.5 else states
    value = chance.choice(("0.5", "1e9", "-8", "0", "38.68", "1e-12"))
    lines = [f"[parameters]\np = {{ value = {value} }}\n" if "p" in names else "", "[states]"]
    lines += [f'{name} = "{formula(chance, names)} + ({formula(chance, names, 1)})*u"' for name in states]
    lines += ["[inputs]\nu = {}", f'[outputs]\ny = "{formula(chance, states, 1)}"']
    if chance.random() < 0.4:
        lines += ["[operating_point]", f"{states[0]} = {chance.choice(('0.5', '0.73908', '0', '1'))}"]
    return "\n".join(lines) + "\n"
