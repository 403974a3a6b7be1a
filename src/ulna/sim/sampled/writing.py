"""Source text of a kernel inside a loop: one line an operation, sine and cosine written out as arithmetic.

Calls of the mathematical library would keep the compiler from working on many runs at once, and its vector forms round
otherwise than its scalar ones. Written out, a run gives the same bits alone, in any place of a block, on any thread.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ulna.program import TEMPLATES, Kernel, Operation, literal

ROUNDING = "6755399441055744.0"
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number, whose last bit ends the sum."""
INVERSE_PI, PI_HIGH, PI_LOW = "0.3183098861837907", "3.141592653589793", "1.2246467991473532e-16"
_SUMS = (Operation.ADD, Operation.SUB)

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
        """The kernel's instructions, inputs under the given names; the names of its results.

        A product that is added or subtracted is fused with the sum, as written here and not as the compiler likes, so
        that all lowerings of the text round alike.
        """
        values = [names[name] for name in kernel.inputs]
        # Products wait until somebody needs their value; most are only added to something.
        waiting: dict[int, tuple[str, str]] = {}

        def value_of(k: int) -> str:
            if k in waiting:
                left, right = waiting.pop(k)
                values[k] = self.new(f"{left} * {right}")
            return values[k]

        for instruction in kernel.instructions:
            operation, operands = instruction.operation, instruction.operands
            if operation is Operation.CONSTANT:
                values.append(literal(instruction))
            elif operation is Operation.MUL:
                waiting[len(values)] = (value_of(operands[0]), value_of(operands[1]))
                values.append("")
            elif operation in _SUMS and (operands[0] in waiting or operands[1] in waiting):
                values.append(self._fused(operation, operands, waiting, value_of))
            else:
                values.append(self._applied(operation, [value_of(k) for k in operands]))
        return [value_of(result) for result in kernel.results]

    def _fused(
        self,
        operation: Operation,
        operands: tuple[int, ...],
        waiting: Mapping[int, tuple[str, str]],
        value_of: Callable[[int], str],
    ) -> str:
        """a + b·c, a − b·c or a·b − c; of two products the second one is fused."""
        first, second = operands
        minus = operation is Operation.SUB
        if second in waiting:
            left, right = waiting[second]
            return self.new(f"fused({f'-{left}' if minus else left}, {right}, {value_of(first)})")
        left, right = waiting[first]
        other = value_of(second)
        return self.new(f"fused({left}, {right}, {f'-{other}' if minus else other})")

    def _applied(self, operation: Operation, operands: list[str]) -> str:
        if operation is Operation.SIN:
            return self._sine(operands[0])
        if operation is Operation.COS:
            return self._cosine(operands[0])
        if operation is Operation.TANH:
            return self._hyperbolic_tangent(operands[0])
        if operation is Operation.FLOOR:
            return self.floor(operands[0])
        return self.new(TEMPLATES[operation].format(*operands))

    def floor(self, value: str) -> str:
        """The largest whole number not above it; numbers from 2^51 on are whole for this purpose."""
        near = self.new(f"({value} + {ROUNDING}) - {ROUNDING}")
        whole = self.new(f"near - 1.0 if near > {value} else near".replace("near", near))
        return self.new(f"{whole} if abs({value}) < 2251799813685248.0 else {value}")

    def _sine(self, angle: str) -> str:
        """sin x = ± sin(x − n π) for even and odd n."""
        turns = self.new(f"fused({angle}, {INVERSE_PI}, {ROUNDING})")
        n = self.new(f"{turns} - {ROUNDING}")
        r = self.new(f"fused({n}, -{PI_LOW}, fused({n}, -{PI_HIGH}, {angle}))")
        return self.new(f"flipped({self._sine_near_zero(r)}, {turns})")

    def _cosine(self, angle: str) -> str:
        """cos x = ± sin((j + 1/2) π − x) for even and odd j."""
        turns = self.new(f"fused({angle}, {INVERSE_PI}, -0.5) + {ROUNDING}")
        n = self.new(f"({turns} - {ROUNDING}) + 0.5")
        r = self.new(f"fused({n}, {PI_LOW}, fused({n}, {PI_HIGH}, -{angle}))")
        return self.new(f"flipped({self._sine_near_zero(r)}, {turns})")

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

    def _sine_near_zero(self, r: str) -> str:
        """sin r for |r| ≤ π/2, for |x| < 1e3 rad within 2 units in the last place down to 1e-13, within 1e-29 below.

        Farther out the distance to the next zero is known to |x| 1e-33. π is the sum of two doubles; the fused
        difference of the angle and n times the first one is exact. The polynomial interpolates (sin r − r)/r³ in r² at
        Chebyshev's points; its two halves are computed side by side.
        Reference: W. J. Cody, W. Waite, "Software Manual for the Elementary Functions", 1980, chapter 8.
        """
        w = self.new(f"{r} * {r}")
        q = self.new(f"{w} * {w}")
        odd = self.new(
            f"fused({q}, fused({q}, fused({q}, 2.7216780035058983e-15, 1.605894190347732e-10), "
            "2.7557319211744394e-06), 0.008333333333333208)"
        )
        even = self.new(
            f"fused({q}, fused({q}, -7.64304346538988e-13, -2.5052106921615934e-08), -0.00019841269841213368)"
        )
        # The largest coefficient comes last, so that its rounding is the only one that counts.
        value = self.new(f"fused({w}, fused({w}, {even}, {odd}), -0.16666666666666666)")
        return self.new(f"fused({r} * {w}, {value}, {r})")
