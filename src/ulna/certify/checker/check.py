"""The second program: it reads a certificate and proves it again, by code that shares nothing with the prover.

Only the formula reader, the test whether a formula is zero, and python-flint are the same. What it accepts is true:

1. The loop in coordinates ζ is the loop in x: T(T⁻¹(ζ)) = ζ, and the rates agree, as formulas.
   Formulas cancel, so on every box T⁻¹, its slopes, every wire and every rate are shown to have a value as they stand.
2. ζ* exists in its box, is the only equilibrium there, and no limit is met (Krawczyk's test).
3. P is positive definite (the pivots of LDLᵀ in balls).
4. The boxes of the tree cover {d : dᵀPd ≤ level}: they are the halves of a box that contains it.
5. On every box dᵀPd > level throughout, or V falls: dᵀPζ' < 0 by the mean-value form, or PM + MᵀP < 0 for every
   matrix M that can stand in ζ' = M d. Where the last coordinates are errors e' = A e, the boxes are of the others, w;
   then half of V' is at most wᵀP₁w'(w, 0) + cᵀS⁻¹c/2 with c = (∂w'/∂e)ᵀP₁w for all errors the level allows beside w.
Then V falls along every run that starts with V ≤ level, and the run converges.

Derivatives are carried along in forward mode beside the values, in balls; that of a limit is 1 inside it, 0 outside,
anything between at its edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import sympy as sp
from flint import arb, ctx

from ulna.base import UlnaError, Verdict
from ulna.certify.certificate import CASCADE, OVER, THEOREM, Certificate, SampledCertificate
from ulna.certify.checker.arithmetic import (
    Box,
    Dual,
    NotRightError,
    around,
    definite,
    dual,
    exactly,
    fraction,
    halves,
    inverse,
    pivots,
    power_above,
    quadratic_of_inverse,
    times,
    vanishes,
)
from ulna.certify.checker.cascade import Everywhere
from ulna.certify.checker.loop import LimitedLoop, names_wrong
from ulna.certify.checker.over import OverParameters
from ulna.certify.checker.processor import Sampled
from ulna.symbolic.formulas import parse_formula

BITS = 80
MOST_BOXES = 2_000_000
DEEPER = 10
"""How often a box may be halved beyond the tree: the tree is a hint, not what is trusted."""
PARTS = 300
"""How many of these parts are looked at."""


def check(certificate: Certificate | SampledCertificate) -> Verdict:
    """Prove a certificate again.

    Returns:
        Proved, or refuted: the evidence tells the step that fails.
    """
    boxes, claim = 0, f"the certificate of '{certificate.name}' is right"
    before = ctx.prec
    try:
        ctx.prec = BITS
        if isinstance(certificate, SampledCertificate):
            boxes, reason = len(certificate.boxes), Sampled(certificate).reason()
        else:
            boxes = (certificate.tree or certificate.splits).count(".")
            reason = _Checker(certificate).reason()
    except NotRightError as error:
        reason = str(error)
    except (UlnaError, ValueError, ZeroDivisionError, OverflowError, IndexError) as error:
        reason = f"it cannot be read: {error}"
    finally:
        ctx.prec = before
    return Verdict.refuted(claim, reason=reason) if reason else Verdict.proved(claim, boxes=boxes)


class _Checker:
    """One certificate, its numbers read."""

    def __init__(self, given: Certificate) -> None:
        if given.theorem not in (THEOREM, CASCADE, OVER):
            raise NotRightError(f"the theorem '{given.theorem}' is not known")
        self.given, self.n, self.k = given, len(given.coordinates), given.outer
        if wrong := names_wrong(given):
            raise NotRightError(wrong)
        self.parameters = [sp.Symbol(row[0], real=True) for row in given.parameters]
        self.loop = self._read(given.coordinates, given.closed, given.gains, given.moved_commands)
        self.still = self.loop
        if self.k < self.n:
            outer = given.coordinates[: self.k]
            self.still = self._read(outer, given.still_closed, given.still_gains, given.still_commands)
        if given.theorem == OVER:
            return
        if not len(given.center) == len(given.P) == self.n:
            raise NotRightError("coordinates, center and P differ in size")
        self.center = [fraction(v) for v in given.center]
        exact = [[fraction(v) for v in row] for row in given.P]
        if any(len(row) != self.n for row in exact):
            raise NotRightError("P is not square")
        if any(exact[i][j] != exact[j][i] for i in range(self.n) for j in range(i)):
            raise NotRightError("P is not symmetric")
        self.P = [[exactly(v) for v in row] for row in exact]
        self.inverse = inverse(exact)
        if not all(pivot > 0 for pivot in pivots(self.P)):
            raise NotRightError("P is not positive definite")
        if given.theorem == CASCADE:
            return
        self.radii, self.level = [fraction(v) for v in given.radii], fraction(given.level)
        if len(self.radii) != self.n or not all(v > 0 for v in (*self.radii, self.level)):
            raise NotRightError("radii and level are not positive")
        self.half = [power_above(self.level * self.inverse[k][k]) for k in range(self.n)]
        self.tree = given.tree.split()

    def _read(
        self, names: Sequence[str], closed: Sequence[str], gains: Sequence[Sequence[str]], commands: Sequence[str]
    ) -> LimitedLoop:
        known = {name: sp.Symbol(name, real=True) for name in (*names, *(p.name for p in self.parameters))}
        if len(closed) != len(names) or len(gains) != len(names):
            raise NotRightError("a coordinate has no rate")
        if any(len(row) != len(self.given.limited) for row in gains) or len(commands) != len(self.given.limited):
            raise NotRightError("a limited signal has no gain or no formula")
        return LimitedLoop(
            symbols=list(known.values()),
            closed=[parse_formula(text, known, where="rate") for text in closed],
            gains=[[parse_formula(text, known, where="gain") for text in row] for row in gains],
            commands=[parse_formula(text, known, where="command") for text in commands],
            lower=[exactly(fraction(v)) for v in self.given.lower],
            upper=[exactly(fraction(v)) for v in self.given.upper],
        )

    def reason(self) -> str:
        """Empty where all is right, else what is wrong."""
        if wrong := self._other_loop():
            return wrong
        if self.given.theorem == CASCADE:
            return self._anywhere()
        if self.given.theorem == OVER:
            return self._over()
        point = [around(c, r) for c, r in zip(self.center, self.radii, strict=True)]
        if not self.loop.one_equilibrium(self.center, point):
            return "no equilibrium is proved to be in the box around the center, or a limit is met there"
        if self.k < self.n and (wrong := self._errors_wrong(point)):
            return wrong
        return self._box_outside(point) or self._uncovered(point)

    def _anywhere(self) -> str:
        """Where it is not shown that all runs converge."""
        given = self.given
        if given.limited or given.box:
            return "the theorem of cascades does not cover a loop with limits, or a box"
        if not self._comes_back():
            return "T⁻¹(T(x)) is not x, so nothing is known about all x"
        return Everywhere(
            symbols=self.loop.symbols,
            outer=self.k,
            closed=self.loop.closed,
            still=self.still.closed,
            maps=[*self.ahead, *self.back],
            wires=self.wires,
            rates=self.rates,
        ).reason(self.P, [fraction(v) for v in given.decay])

    def _over(self) -> str:
        """Where stability at rest is not shown for all values of the parameters."""
        given = self.given
        if given.box or self.k < self.n:
            return "the theorem over parameters does not cover a box, or errors"
        return OverParameters(
            loop=self.loop,
            size=self.n,
            finite=self._defined_at,
            bounds=[(fraction(low), fraction(high)) for _, low, high in given.parameters],
            splits=given.splits.split(),
            pieces=given.pieces,
        ).reason()

    # ------------------------------------------------------------------------------------------- the same loop

    def _other_loop(self) -> str:
        """Where the loop in coordinates is not the loop in x."""
        given, z, s = self.given, self.loop.symbols[: self.n], [sp.Symbol(n, real=True) for n in self.given.limited]
        own = {name: sp.Symbol(name, real=True) for name in given.states}
        kept = {symbol.name: symbol for symbol in self.parameters}
        coordinates = {symbol.name: symbol for symbol in z}
        self.ahead = forward = [parse_formula(text, own, where="coordinate") for text in given.forward]
        self.back = back = [parse_formula(text, coordinates, where="inverse") for text in given.inverse]
        names, meaning, found = own | kept, {}, {}
        self.wires: list[tuple[sp.Symbol, sp.Expr]] = []
        for name, text in given.wires:
            symbol, formula = sp.Symbol(name, real=True), parse_formula(text, names, where="wire")
            self.wires.append((symbol, formula))
            names[name], whole = symbol, formula.xreplace(meaning)
            meaning[symbol] = symbol if name in given.limited else whole
            found[name] = whole
        self.rates = [parse_formula(text, names, where="rate") for text in given.rates]
        self.own = list(own.values())
        rates, commands = [e.xreplace(meaning) for e in self.rates], [found[name] for name in given.limited]
        if not len(forward) == len(back) == len(rates) == self.n:
            return "coordinates or rates are missing"
        x = list(own.values())
        there = dict(zip(x, back, strict=True))
        if not all(vanishes(t.xreplace(there) - symbol) for t, symbol in zip(forward, z, strict=True)):
            return "T(T⁻¹(ζ)) is not ζ"
        if not all(vanishes(a.xreplace(there) - b) for a, b in zip(commands, self.loop.commands, strict=True)):
            return "a command differs in the coordinates"
        moved = sp.Matrix(forward).jacobian(x) * sp.Matrix(rates)
        for i, rate in enumerate(moved):
            same = self.loop.closed[i] + sp.Add(
                *(b * (v - k) for b, v, k in zip(self.loop.gains[i], s, self.loop.commands, strict=True))
            )
            if not vanishes(rate.xreplace(there) - same):
                return f"the rate of coordinate {z[i]} is another one than that of the states"
        if self.k < self.n:
            gone = dict.fromkeys(z[self.k :], sp.Integer(0))
            pairs = [*zip(self.loop.closed[: self.k], self.still.closed, strict=True)]
            pairs += [*zip(self.loop.commands, self.still.commands, strict=True)]
            for a, b in zip(self.loop.gains[: self.k], self.still.gains, strict=True):
                pairs += zip(a, b, strict=True)
            if not all(vanishes(a.xreplace(gone) - b) for a, b in pairs):
                return "the loop without errors differs"
        return ""

    def _comes_back(self) -> bool:
        there = dict(zip(self.loop.symbols, self.ahead, strict=True))
        return all(vanishes(b.xreplace(there) - x) for b, x in zip(self.back, self.own, strict=True))

    def _errors_wrong(self, point: list[arb]) -> str:
        """Where the last coordinates are not errors e' = A e whose part of V falls and stands apart in P."""
        k, n, z = self.k, self.n, self.loop.symbols
        inner = set(z[k:])
        if any(self.P[i][j] != 0 for i in range(k) for j in range(k, n)):
            return "P is not block diagonal"
        if any(c != 0 for c in self.center[k:]) or any(not vanishes(b) for row in self.loop.gains[k:] for b in row):
            return "the errors depend on more than themselves"
        for e in self.loop.closed[k:]:
            if not e.free_symbols <= inner or not all(sp.diff(e, s).is_Rational for s in inner):
                return "the errors are not linear"
        rates, _ = self.loop.duals(point)
        A = [[rates[k + i].slope[k + j] for j in range(n - k)] for i in range(n - k)]
        R = [[self.P[k + i][k + j] for j in range(n - k)] for i in range(n - k)]
        half = [[sum((R[i][m] * A[m][j] for m in range(n - k)), arb(0)) for j in range(n - k)] for i in range(n - k)]
        self.decay = [[-(half[i][j] + half[j][i]) for j in range(n - k)] for i in range(n - k)]
        return "" if all(pivot > 0 for pivot in pivots(self.decay)) else "the errors' part of V does not decrease"

    # ---------------------------------------------------------------------------------------------------- boxes

    def _box_outside(self, point: list[arb]) -> str:
        """Where the claimed box about x* is not in the level set; T⁻¹(T(x)) = x is asked for as well."""
        given = self.given
        if not given.box:
            return ""
        if not self._comes_back():
            return "T⁻¹(T(x)) is not x, so a box of x proves nothing"
        if unknown := [name for name in given.box if name not in given.states]:
            return f"the box has a side '{unknown[0]}', which is not a state"
        at = {s: Dual(v, []) for s, v in zip(self.loop.symbols, point, strict=True)}
        rest = [dual(b, at, {}).value for b in self.back]
        sides = {given.states.index(name): fraction(size) for name, size in given.box.items()}
        stack = [({k: (Fraction(0), size) for k, size in sides.items()}, 0)]
        while stack:
            part, depth = stack.pop()
            x = [rest[i] + (around(*part[i]) if i in part else arb(0)) for i in range(self.n)]
            duals = {s: Dual(v, []) for s, v in zip(self.own, x, strict=True)}
            d = [dual(t, duals, {}).value - p for t, p in zip(self.ahead, point, strict=True)]
            if sum((self.P[i][j] * d[i] * d[j] for i in range(self.n) for j in range(self.n)), arb(0)) <= exactly(
                self.level
            ):
                continue
            if depth > 14:
                return "the claimed box is not in the level set"
            axis = max(part, key=lambda k: part[k][1] / max(sides[k], Fraction(1, 10**9)))
            middle, half = part[axis]
            stack += [({**part, axis: (middle + sign * half / 2, half / 2)}, depth + 1) for sign in (1, -1)]
        return ""

    def _uncovered(self, point: list[arb]) -> str:
        """Walk the tree; empty where every leaf is settled."""
        stack, place = [[(Fraction(0), half) for half in self.half]], 0
        while stack:
            box = stack.pop()
            if place >= min(len(self.tree), MOST_BOXES):
                return "the tree of boxes ends too early"
            word = self.tree[place]
            place += 1
            if word.startswith("/"):
                axis = int(word[1:])
                if not 0 <= axis < self.k:
                    return "the tree halves a coordinate that is not there"
                stack += halves(box, axis)
            elif word != ".":
                return "the tree has an unknown word"
            elif not self._settled(point, box):
                names = self.given.coordinates
                shown = ", ".join(f"{n}: {float(c):.4g} ± {float(h):.2g}" for n, (c, h) in zip(names, box, strict=True))
                return f"V is not proved to decrease on the box {shown}"
        return "" if place == len(self.tree) else "the tree of boxes goes on after its end"

    def _settled(self, point: list[arb], box: Box) -> bool:
        """Whether the box is settled, by itself or in parts."""
        stack, looked = [(box, 0)], 0
        while stack:
            part, depth = stack.pop()
            looked += 1
            if self._beyond(part) or (self._defined(point, part) and self._falls(point, part)):
                continue
            if depth >= DEEPER or looked > PARTS:
                return False
            axis = max(range(self.k), key=lambda k: part[k][1] / self.half[k])
            stack += [(each, depth + 1) for each in halves(part, axis)]
        return True

    def _beyond(self, box: Box) -> bool:
        """Whether dᵀPd > level on the box, whatever the coordinates are whose sides were never halved."""
        cut = [k for k in range(self.k) if box[k][1] < self.half[k]]
        if not cut:
            return False
        shadow = inverse([[self.inverse[i][j] for j in cut] for i in cut])
        d = [around(*box[i]) for i in cut]
        total = arb(0)
        for a, left in enumerate(d):
            for b, right in enumerate(d):
                total += exactly(shadow[a][b]) * left * right
        return bool(total > exactly(self.level))

    def _defined(self, point: list[arb], box: Box) -> bool:
        """Whether T⁻¹, its slopes, every wire and every rate have a value on the box, as the formulas stand."""
        offset = [around(*side) for side in box]
        offset[self.k :] = self._errors(offset[: self.k]) or offset[self.k :]
        return self._defined_at([p + d for p, d in zip(point, offset, strict=True)])

    def _defined_at(self, at: list[arb]) -> bool:
        """The same at values of the coordinates and of the parameters."""
        units = [[arb(int(i == j)) for j in range(len(at))] for i in range(len(at))]
        known = {symbol: Dual(v, unit) for symbol, v, unit in zip(self.loop.symbols, at, units, strict=True)}
        x = [dual(e, known, {}) for e in self.back]
        if not all(v.is_finite() for each in x for v in (each.value, *each.slope)):
            return False
        values = {symbol: Dual(each.value, []) for symbol, each in zip(self.own, x, strict=True)}
        values |= {symbol: Dual(known[symbol].value, []) for symbol in self.parameters}
        limits = dict(zip(self.given.limited, zip(self.loop.lower, self.loop.upper, strict=True), strict=True))
        for symbol, formula in self.wires:
            # A value that is missing is handed on: a limit does not hide it.
            value = dual(formula, values, {}).value
            low, high = limits.get(symbol.name, (value, value))
            values[symbol] = Dual(value.max(low).min(high) if symbol.name in limits else value, [])
        return all(dual(e, values, {}).value.is_finite() for e in self.rates)

    def _errors(self, w: list[arb]) -> list[arb]:
        """A box of the errors that the level allows beside states w; empty where there are none, or no errors left."""
        k, n = self.k, self.n
        push = [sum((self.P[i][j] * w[j] for j in range(k)), arb(0)) for i in range(k)]
        left = exactly(self.level) - sum((w[i] * push[i] for i in range(k)), arb(0))
        if k == n or left < 0:
            return []
        size, unit = arb(left.upper()).max(arb(0)).sqrt(), around(Fraction(0), Fraction(1))
        return [unit * size * exactly(self.inverse[j][j]).sqrt() for j in range(k, n)]

    def _falls(self, point: list[arb], box: Box) -> bool:
        k, n, P = self.k, self.n, self.P
        w, outer = [around(*side) for side in box[:k]], point[:k]
        push, total = times(P, w), self.still.power(P, outer, box[:k])
        coupled: list[list[arb]] = []
        if k < n:
            errors = self._errors(w)
            if not errors:
                return True
            found, _ = self.loop.duals([p + d for p, d in zip(point, [*w, *errors], strict=True)])
            coupled = [[found[i].slope[j] for j in range(k, n)] for i in range(k)]
            c = [sum((coupled[i][j] * push[i] for i in range(k)), arb(0)) for j in range(n - k)]
            total += quadratic_of_inverse(self.decay, c) / 2
        if total < 0:
            return True
        inner = self.still.secant(outer, w)
        S = [[arb(0)] * n for _ in range(n)]
        product = [[sum((P[i][m_] * inner[m_][j] for m_ in range(k)), arb(0)) for j in range(k)] for i in range(k)]
        for i in range(k):
            for j in range(k):
                S[i][j] = -(product[i][j] + product[j][i])
            for j in range(k, n):
                S[i][j] = S[j][i] = -sum((P[i][m_] * coupled[m_][j - k] for m_ in range(k)), arb(0))
        for i in range(k, n):
            for j in range(k, n):
                S[i][j] = self.decay[i - k][j - k]
        return definite(S)
