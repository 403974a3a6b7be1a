"""The second program on loops with a processor: what it accepts is true.

F is one period: the readings are measured, off by at most half a step δ; the program runs; the plant moves.
1. On a box about c all slopes of F are enclosed: of the program in forward mode; of the plant over a stretch of length
   h, in a box that no run leaves meanwhile (Picard's operator), by Σ (hJ)ᵏ/k!, J the slopes of its rates over that box.
2. F(c + d) = c + A d + N δ + r, and |r| ≤ ρ(B) for |d| in a box B: the mean of the slopes along the line from c, less A
   and N, times B and δ, and |F(c) − c|.
3. S ≥ Σ|Aᵏ|, X ≥ |Aᵏ| for all k, and T ≥ Σ|Aᵏ N| δ, by whole numbers with all that cutting off leaves.
4. After the first period |d| ≤ p for every run from the start. X p + T + S ρ(B) ≤ B for the first box, so by
   induction no run leaves it. T + S ρ(B) < B' for each next one, so every run is in it in the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import sympy as sp
from flint import arb, arb_mat, fmpz_mat

from ulna.certify.certificate import SampledCertificate
from ulna.certify.checker.arithmetic import Dual, NotRightError, around, dual, exactly, fraction
from ulna.symbolic.formulas import parse_formula

SEGMENTS, TERMS, TRIES = 4, 8, 12
MOST_POWERS = 200_000
UNIT_BITS = 60

_Rows = list[list[arb]]


class Sampled:
    """One certificate, its formulas and numbers read."""

    def __init__(self, given: SampledCertificate) -> None:
        self.given, self.n, self.m = given, len(given.states) + len(given.memory), len(given.readings)
        if wrong := _sizes_wrong(given, self.n):
            raise NotRightError(wrong)
        states = {name: sp.Symbol(name, real=True) for name in given.states}
        inputs = {name: sp.Symbol(name, real=True) for name in given.inputs}
        if states.keys() & inputs.keys():
            raise NotRightError("an input has the name of a state")
        self.own = [*states.values(), *inputs.values()]
        self.rates = [parse_formula(text, states | inputs, where="rate") for text in given.rates]
        self.readings = [parse_formula(text, states, where="reading") for text in given.readings]
        self.program, self.first = self._lines(given.program), self._lines(given.first)
        self.delta = [fraction(v) for v in given.half_steps]
        self.center = [exactly(fraction(v)) for v in given.center]
        scale = [fraction(v) for v in given.scale]
        if not all(v > 0 for v in scale) or not all(v >= 0 for v in self.delta):
            raise NotRightError("scales, or steps of sensors, are not positive")
        self.scale = scale
        self.whole = [[int(v) for v in (*row, *more)] for row, more in zip(given.matrix, given.injection, strict=True)]

    def _lines(self, lines: Sequence[Sequence[str]]) -> list[tuple[sp.Symbol, sp.Expr]]:
        names = {name: sp.Symbol(name, real=True) for name in self.given.memory}
        names |= {f"y{k}": sp.Symbol(f"y{k}", real=True) for k in range(self.m)}
        found = []
        for name, text in lines:
            formula = parse_formula(text, names, where="program")
            if name in names:
                raise NotRightError(f"'{name}' is computed twice")
            names[name] = sp.Symbol(name, real=True)
            found.append((names[name], formula))
        return found

    def reason(self) -> str:
        """Empty where all is right, else what is wrong."""
        start = [fraction(v) / s for v, s in zip(self.given.start, self.scale, strict=True)]
        boxes = [[fraction(v) / s for v, s in zip(box, self.scale, strict=True)] for box in self.given.boxes]
        if not all(v >= 0 for v in start) or not all(v > 0 for box in boxes for v in box) or not boxes:
            return "a box has a side that is not positive"
        total, largest, pushed = self._sums()
        values, _ = self._moved(self.center, [arb(0)] * self.m, self.program)
        begun, _ = self._moved(self.center, [arb(0)] * self.m, self.first)
        begins = self._most(start, self.first, begun, exact=False)
        away = [a + b for a, b in zip(_times(largest, begins), pushed, strict=True)]
        needed = [a + b for a, b in zip(away, _times(total, self._most(boxes[0], self.program, values)), strict=True)]
        if not all(v <= exactly(b) for v, b in zip(needed, boxes[0], strict=True)):
            return "runs from the start are not proved to stay in the first box"
        for before, after in pairwise(boxes):
            rest = _times(total, self._most(before, self.program, values))
            if not all(a + b < exactly(c) for a, b, c in zip(rest, pushed, after, strict=True)):
                return "runs are not proved to end up in the next box"
        return ""

    def _most(
        self,
        box: Sequence[Fraction],
        program: list[tuple[sp.Symbol, sp.Expr]],
        at_center: list[arb],
        *,
        exact: bool = True,
    ) -> list[arb]:
        """The largest |F(c + d) − c| of each state for |d| in a box, scaled; with `exact` less A d + N δ."""
        n, every = self.n, self.n + self.m
        mean = [[arb(0)] * every for _ in range(n)]
        for k in range(SEGMENTS):
            share = around(Fraction(2 * k + 1, 2 * SEGMENTS), Fraction(1, 2 * SEGMENTS))
            point = [
                c + share * around(Fraction(0), b * s) for c, b, s in zip(self.center, box, self.scale, strict=True)
            ]
            noise = [share * around(Fraction(0), d) for d in self.delta]
            _, rows = self._moved(point, noise, program)
            mean = [
                [a + b / SEGMENTS for a, b in zip(old, row, strict=True)] for old, row in zip(mean, rows, strict=True)
            ]
        sides = [*box, *self.delta]
        factors = [*self.scale, *[Fraction(1)] * self.m]
        found = []
        for i in range(n):
            total = abs(at_center[i] - self.center[i]) / exactly(self.scale[i])
            for j in range(every):
                slope = mean[i][j] * exactly(factors[j] / self.scale[i])
                slope -= arb(self.whole[i][j]) / 2**UNIT_BITS if exact else arb(0)
                total += abs(slope) * exactly(sides[j])
            if not total.is_finite():
                raise NotRightError("the loop is not proved to have a value on a box")
            found.append(arb(total.upper()))
        return found

    # ------------------------------------------------------------------------------------------------- one period

    def _moved(
        self, point: Sequence[arb], noise: Sequence[arb], program: list[tuple[sp.Symbol, sp.Expr]]
    ) -> tuple[list[arb], _Rows]:
        """F and its slopes by the state and the errors of the sensors."""
        given, every = self.given, self.n + self.m
        units = [[arb(int(i == j)) for j in range(every)] for i in range(every)]
        here = [Dual(v, unit) for v, unit in zip(point, units, strict=False)]
        x, count = here[: len(given.states)], len(given.states)
        known = {sp.Symbol(name, real=True): each for name, each in zip(given.memory, here[count:], strict=True)}
        plant, shared = dict(zip(self.own, x, strict=False)), {}
        for k, formula in enumerate(self.readings):
            value = dual(formula, plant, shared)
            if not self._shown(k, value.value):
                raise NotRightError("a sensor may be beyond its range")
            error = units[self.n + k]
            slope = [a + b for a, b in zip(value.slope, error, strict=True)] if value.slope else error
            known[sp.Symbol(f"y{k}", real=True)] = Dual(value.value + noise[k], slope)
        for name, formula in program:
            known[name] = dual(formula, known, {})
        for length, *slots in given.stretches:
            held = [known[sp.Symbol(f"{slot}_new", real=True)] for slot in slots]
            x = self._flown(x, held, exactly(fraction(length)))
        whole = [*x, *(known[sp.Symbol(f"{name}_new", real=True)] for name in given.memory)]
        return [each.value for each in whole], [each.slope or [arb(0)] * every for each in whole]

    def _shown(self, k: int, value: arb) -> bool:
        low, high = self.given.lower[k], self.given.upper[k]
        return (not low or value >= exactly(fraction(low))) and (not high or value <= exactly(fraction(high)))

    def _flown(self, x: list[Dual], held: list[Dual], time: arb) -> list[Dual]:
        n, m, every = len(x), len(held), self.n + self.m
        tube = self._tube(x, held, time)
        rates = self._rates(tube, held)
        J = arb_mat(n, n, [time * rate.slope[j] for rate in rates for j in range(n)])
        G = arb_mat(n, m, [time * rate.slope[n + j] for rate in rates for j in range(m)])
        size = max((sum((abs(J[i, j]) for j in range(n)), arb(0)) for i in range(n)), key=lambda v: float(v.upper()))
        if not size < TERMS / 2:
            raise NotRightError("a period is too long for the plant's rates")
        one = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
        power, through, mean = one, one, one
        for k in range(1, TERMS + 1):
            power = power * J / k
            through, mean = through + power, mean + power / (k + 1)
        # The terms left out are less than a geometric series of ratio 1/2.
        left = arb(0, 1) * (2 * size ** (TERMS + 1) / math.factorial(TERMS + 1)).upper()
        more = arb_mat(n, n, [left] * (n * n))
        start = arb_mat(n, every, [v for each in x for v in each.slope])
        pushed = arb_mat(m, every, [v for each in held for v in each.slope or [arb(0)] * every])
        after = (through + more) * start + (mean + more) * G * pushed
        return [
            Dual(each.value + time * rate.value, [after[i, j] for j in range(every)])
            for i, (each, rate) in enumerate(zip(x, rates, strict=True))
        ]

    def _tube(self, x: list[Dual], held: list[Dual], time: arb) -> list[arb]:
        """A box that no run leaves within the time."""
        part, wider = around(Fraction(1, 2), Fraction(1, 2)) * time, around(Fraction(1, 2), Fraction(3, 4)) * time
        box = [each.value for each in x]
        for _ in range(TRIES):
            rates = self._rates(box, held)
            reached = [each.value + part * rate.value for each, rate in zip(x, rates, strict=True)]
            if all(b.contains(r) and r.is_finite() for b, r in zip(box, reached, strict=True)):
                return box
            box = [
                each.value + wider * rate.value + around(Fraction(0), Fraction(1, 10**14)) * (1 + abs(each.value))
                for each, rate in zip(x, rates, strict=True)
            ]
        raise NotRightError("no box was found that no run leaves within a period")

    def _rates(self, box: Sequence[arb], held: list[Dual]) -> list[Dual]:
        width = len(self.own)
        values = [*box, *(each.value for each in held)]
        known = {
            s: Dual(v, [arb(int(i == j)) for j in range(width)])
            for i, (s, v) in enumerate(zip(self.own, values, strict=True))
        }
        shared: dict[sp.Expr, Dual] = {}
        found = [dual(e, known, shared) for e in self.rates]
        return [Dual(each.value, each.slope or [arb(0)] * width) for each in found]

    # ---------------------------------------------------------------------------------------------- sums of powers

    def _sums(self) -> tuple[_Rows, _Rows, list[arb]]:
        """Bounds of Σ|Aᵏ|, of every |Aᵏ|, and of Σ|Aᵏ N| δ.

        Âₖ are whole numbers of 2⁻⁶⁰ and Âₖ₊₁ is A Âₖ cut off, so |Aᵏ − Âₖ| ≤ S E for the K powers looked at, E the unit
        in every entry, and S ≤ Ŝ + K S E. What follows is A^K times what was: Σ ≤ S + Σ|A^K|, X ≤ X̂ + X|A^K|.
        """
        n, count = self.n, int(self.given.powers)
        if not 0 < count <= MOST_POWERS:
            raise NotRightError("the number of powers is outside its range")
        A = fmpz_mat([row[:n] for row in self.whole])
        N = fmpz_mat([row[n:] for row in self.whole])
        power = fmpz_mat([[(int(i == j) << UNIT_BITS) for j in range(n)] for i in range(n)])
        total, largest, pushed = [0] * (n * n), [0] * (n * n), [0] * (n * self.m)
        for _ in range(count):
            size = [abs(v) for v in power.entries()]
            total = [a + b for a, b in zip(total, size, strict=True)]
            largest = [max(a, b) for a, b in zip(largest, size, strict=True)]
            if self.m:
                pushed = [a + abs(v) for a, v in zip(pushed, (power * N).entries(), strict=True)]
            power = fmpz_mat(n, n, [v >> UNIT_BITS for v in (A * power).entries()])
        unit = arb(1) / 2**UNIT_BITS
        E = arb_mat(n, n, [unit] * (n * n))
        first = _divided(arb_mat(n, n, total) * unit, E * count)
        off = first * E
        last = arb_mat(n, n, [abs(v) * unit for v in power.entries()]) + off
        whole, most = _divided(first, last), _divided(arb_mat(n, n, largest) * unit + off, last)
        end = [abs(v) for v in (power * N).entries()] if self.m else []
        # What the powers are off by, and the rest of the sum: Σ times Aᴷ N.
        size = arb_mat(n, self.m, [abs(v) * unit for v in N.entries()])
        driven = arb_mat(n, self.m, pushed) * unit**2 + off * size * count
        driven += whole * (arb_mat(n, self.m, end) * unit**2 + off * size)
        noise = [sum((driven[i, j] * exactly(d) for j, d in enumerate(self.delta)), arb(0)) for i in range(n)]
        return _entries(whole), _entries(most), noise


def _sizes_wrong(given: SampledCertificate, n: int) -> str:
    """What does not fit in number."""
    m = len(given.readings)
    rows = (given.center, given.scale, given.start, given.matrix, given.injection, *given.boxes)
    if any(len(row) != n for row in rows) or len(given.rates) != len(given.states):
        return "a state has no rate, no number, or no row"
    if any(len(row) != n for row in given.matrix) or any(len(row) != m for row in given.injection):
        return "A or N is not of its size"
    if not len(given.half_steps) == len(given.lower) == len(given.upper) == m:
        return "a reading has no sensor"
    if any(len(line) != 2 for line in (*given.program, *given.first)):
        return "a line of the program has no formula"
    if not given.stretches or any(len(row) != len(given.inputs) + 1 for row in given.stretches):
        return "a stretch does not hold every input"
    wanted = {f"{slot}_new" for slot in (*given.memory, *(slot for row in given.stretches for slot in row[1:]))}
    if not all(wanted <= {line[0] for line in lines} for lines in (given.program, given.first)):
        return "the program leaves a slot open"
    if not all(fraction(row[0]) > 0 for row in given.stretches):
        return "a stretch has no length"
    return "" if len({*given.states}) == len(given.states) else "two states have one name"


def _divided(left: arb_mat, small: arb_mat) -> arb_mat:
    """left (1 − small)⁻¹ = left Σ smallᵏ; all entries are positive."""
    n = small.nrows()
    if not all(sum((small[i, j] for j in range(n)), arb(0)) < 1 for i in range(n)):
        raise NotRightError("the powers of A are not proved to become small")
    return left * (arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)]) - small).inv()


def _entries(matrix: arb_mat) -> _Rows:
    return [[matrix[i, j] for j in range(matrix.ncols())] for i in range(matrix.nrows())]


def _times(matrix: _Rows, vector: Sequence[arb]) -> list[arb]:
    return [sum((a * b for a, b in zip(row, vector, strict=True)), arb(0)) for row in matrix]
