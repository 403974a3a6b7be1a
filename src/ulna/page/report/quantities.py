"""Numbers and units as people write them."""

from __future__ import annotations

import math

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number_text(value: float, digits: int = 4) -> str:
    """So many digits, without an exponent where a person would write none: 2290, 0.3, 9.8·10⁻⁵, never, –."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    size = abs(value)
    if size and not 1e-4 <= size < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        text, power = mantissa.rstrip("0").rstrip("."), f"10{str(int(exponent)).translate(_RAISED)}"
        return (power if text == "1" else f"{text}·{power}").replace("-", "−")
    places = 0 if not size else max(0, digits - 1 - math.floor(math.log10(size)))
    text = f"{value:.{places}f}"
    return (text.rstrip("0").rstrip(".") if "." in text else text).replace("-", "−")


def unit_text(unit: str) -> str:
    """N·m²/A² for N*m^2/A^2."""
    raised = unit.replace("/s/s", "/s²").replace("^2", "²").replace("^3", "³").replace("**2", "²").replace("*", "·")
    return "" if unit == "1" else raised.replace("ohm", "Ω")


def with_unit(value: float, unit: str) -> str:
    """A number with its unit."""
    return f"{number_text(value)} {unit_text(unit)}".rstrip()


def seconds(value: float) -> str:
    """A time: 250 µs, 1 ms, 0.5 s."""
    for size, name in ((1e-6, "µs"), (1e-3, "ms")):
        if 0 < value < 999.95 * size and value < 0.1:
            return f"{number_text(value / size)} {name}"
    return f"{number_text(value)} s"
