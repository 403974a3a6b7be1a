"""Source text of a kernel inside a loop: one line an operation, sine and cosine written out as arithmetic.

Calls of the mathematical library would keep the compiler from working on many runs at once, and its vector forms round
otherwise than its scalar ones. Written out, a run gives the same bits alone, in any place of a block, on any thread.
"""

from __future__ import annotations

from collections.abc import Mapping

from ulna.symbolic.program.instructions import Operation
from ulna.symbolic.program.kernel import Kernel
from ulna.symbolic.program.lowering.python_source import TEMPLATES, literal

ROUNDING = "6755399441055744.0"
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number."""


LAMBERT_ABOVE = (1.0, 0.13725490196078433, 0.00392156862745098, 2.8729440494146376e-05, 2.901963686277412e-08)
LAMBERT_BELOW = (1.0, 0.47058823529411764, 0.027450980392156862, 0.00040221216691804925, 1.3058836588248353e-06)
"""Of tanh y = y N(y²)/D(y²), the ninth convergent of Lambert's continued fraction."""


class Writer:
    """Lines of source with indentation and names that are used once."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.depth = 0
        self._count = 0

    def line(self, text: str) -> None:
        """Add a line at the present depth."""
        self.lines.append("    " * self.depth + text)

    def new(self, text: str) -> str:
        """Add `name = text` and hand back the name."""
        name = f"a{self._count}"
        self._count += 1
        self.line(f"{name} = {text}")
        return name

    def kernel(self, kernel: Kernel, names: Mapping[str, str]) -> list[str]:
        """The kernel's instructions, inputs under the given names; the names of its results."""
        values = [names[name] for name in kernel.inputs]
        for instruction in kernel.instructions:
            operation = instruction.operation
            if operation is Operation.CONSTANT:
                values.append(literal(instruction))
                continue
            operands = [values[k] for k in instruction.operands]
            if operation is Operation.SIN:
                values.append(self._sine(operands[0]))
            elif operation is Operation.COS:
                values.append(self._cosine(operands[0]))
            elif operation is Operation.TANH:
                values.append(self._hyperbolic_tangent(operands[0]))
            elif operation is Operation.FLOOR:
                values.append(self.floor(operands[0]))
            else:
                values.append(self.new(TEMPLATES[operation].format(*operands)))
        return [values[result] for result in kernel.results]

    def floor(self, value: str) -> str:
        """The largest whole number not above it; numbers from 2^51 on are whole for this purpose."""
        near = self.new(f"({value} + {ROUNDING}) - {ROUNDING}")
        whole = self.new(f"near - 1.0 if near > {value} else near".replace("near", near))
        return self.new(f"{whole} if abs({value}) < 2251799813685248.0 else {value}")

    def _sine(self, angle: str) -> str:
        n = self.new(f"fused({angle}, 0.3183098861837907, {ROUNDING}) - {ROUNDING}")
        value = self._sine_near_zero(angle, n)
        return self.new(f"{value} if 2.0 * (({n} * 0.5 + {ROUNDING}) - {ROUNDING}) == {n} else -{value}")

    def _cosine(self, angle: str) -> str:
        """cos x = ∓ sin(x − (j + 1/2) π) for even and odd j."""
        j = self.new(f"({angle} * 0.3183098861837907 - 0.5 + {ROUNDING}) - {ROUNDING}")
        value = self._sine_near_zero(angle, self.new(f"{j} + 0.5"))
        return self.new(f"-{value} if 2.0 * (({j} * 0.5 + {ROUNDING}) - {ROUNDING}) == {j} else {value}")

    def _hyperbolic_tangent(self, value: str) -> str:
        """tanh x within 2e-15: Lambert's continued fraction, cut after nine terms, at x/16, then doubled four times.

        tanh 2y = 2 n d/(d² + n²) for tanh y = n/d, so that one division is left; beyond 20 the answer is ±1.
        """
        above = self.new(f"20.0 if {value} > 20.0 else {value}")
        y = self.new(f"(-20.0 if {above} < -20.0 else {above}) * 0.0625")
        w = self.new(f"{y} * {y}")
        n = self.new(f"{y} * {self._polynomial(w, LAMBERT_ABOVE)}")
        d = self.new(self._polynomial(w, LAMBERT_BELOW))
        for _ in range(4):
            n, d = self.new(f"2.0 * {n} * {d}"), self.new(f"fused({n}, {n}, {d} * {d})")
        return self.new(f"{n} / {d}")

    def _polynomial(self, x: str, coefficients: tuple[float, ...]) -> str:
        """Horner's rule; the constant term first."""
        text = repr(coefficients[-1])
        for value in reversed(coefficients[:-1]):
            text = f"fused({x}, {text}, {value!r})"
        return text

    def _sine_near_zero(self, angle: str, turns: str) -> str:
        """sin(x − n π) for |x − n π| ≤ π/2: within 3e-16 up to 1e6 rad, then within the spacing of doubles there.

        π is the sum of 33 bits, whose products with n are exact, and 53 more. The polynomial interpolates
        (sin r − r)/r³ in r² at Chebyshev's points; its two halves are computed side by side.
        Reference: W. J. Cody, W. Waite, "Software Manual for the Elementary Functions", 1980, chapter 8.
        """
        r = self.new(f"fused({turns}, -1.2154201013012384e-10, fused({turns}, -3.1415926534682512, {angle}))")
        w = self.new(f"{r} * {r}")
        q = self.new(f"{w} * {w}")
        even = self.new(
            f"fused({q}, fused({q}, fused({q}, -7.643963964341869e-13, -2.5052107613933993e-08), "
            "-0.00019841269841254885), -0.16666666666666666)"
        )
        odd = self.new(
            f"fused({q}, fused({q}, fused({q}, 2.7313658477694193e-15, 1.6058977114025027e-10), "
            "2.7557319219139174e-06), 0.008333333333333316)"
        )
        return self.new(f"fused({r} * {w}, fused({w}, {odd}, {even}), {r})")
