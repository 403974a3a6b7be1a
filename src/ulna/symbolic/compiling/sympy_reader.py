"""SymPy expressions read into an `InstructionList`: one bottom-up walk, equal subexpressions met once."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from functools import reduce

import sympy as sp
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from ulna.base import FormulaError
from ulna.program import InstructionList, Operation, Scalar

DIGITS = 40
"""Decimal digits to which an irrational constant is evaluated before it is rounded to a double."""

_UNARY: dict[type[sp.Basic], Operation] = {
    sp.exp: Operation.EXP,
    sp.log: Operation.LOG,
    sp.sin: Operation.SIN,
    sp.cos: Operation.COS,
    sp.tan: Operation.TAN,
    sp.asin: Operation.ASIN,
    sp.acos: Operation.ACOS,
    sp.atan: Operation.ATAN,
    sp.sinh: Operation.SINH,
    sp.cosh: Operation.COSH,
    sp.tanh: Operation.TANH,
    sp.asinh: Operation.ASINH,
    sp.acosh: Operation.ACOSH,
    sp.atanh: Operation.ATANH,
    sp.Abs: Operation.ABS,
    sp.sign: Operation.SIGN,
    sp.floor: Operation.FLOOR,
    sp.Not: Operation.NOT,
}
_SEVERAL: dict[type[sp.Basic], Operation] = {sp.atan2: Operation.ATAN2, sp.ITE: Operation.SELECT}
_FOLDED: dict[type[sp.Basic], Operation] = {
    sp.Min: Operation.MIN,
    sp.Max: Operation.MAX,
    sp.And: Operation.AND,
    sp.Or: Operation.OR,
}
# Functions that are only other functions in disguise.
_DISGUISED: dict[type[sp.Basic], Callable[..., Scalar]] = {
    sp.sec: lambda a: 1.0 / a.apply(Operation.COS),
    sp.csc: lambda a: 1.0 / a.apply(Operation.SIN),
    sp.cot: lambda a: a.apply(Operation.COS) / a.apply(Operation.SIN),
    sp.asec: lambda a: (1.0 / a).apply(Operation.ACOS),
    sp.acsc: lambda a: (1.0 / a).apply(Operation.ASIN),
    sp.acot: lambda a: (1.0 / a).apply(Operation.ATAN),
    sp.sech: lambda a: 1.0 / a.apply(Operation.COSH),
    sp.csch: lambda a: 1.0 / a.apply(Operation.SINH),
    sp.coth: lambda a: 1.0 / a.apply(Operation.TANH),
    sp.ceiling: lambda a: -(-a).apply(Operation.FLOOR),
    sp.frac: lambda a: a - a.apply(Operation.FLOOR),
    sp.Mod: lambda a, b: a - b * (a / b).apply(Operation.FLOOR),
    sp.Heaviside: lambda a, at_zero=0.5: a.more(0.0).where(1.0, a.less(0.0).where(0.0, at_zero)),
    sp.sinc: lambda a: a.apply(Operation.EQUAL, 0.0).where(1.0, a.apply(Operation.SIN) / a),
}
_STRUCTURE = (sp.Add, sp.Mul, sp.Pow, Relational, sp.Piecewise, BooleanTrue, BooleanFalse)
_SHORT = 2**16
"""Below this `to_balls` takes a whole number as it is."""


def is_exact(node: sp.Basic) -> bool:
    """Whether an exact reader knows what to make of a node, apart from its arguments: not of long numbers, nor of π."""
    if isinstance(node, sp.Number):
        return isinstance(node, sp.Rational) and abs(int(node.p)) < _SHORT and int(node.q) < _SHORT
    known = (_UNARY, _SEVERAL, _FOLDED, _DISGUISED)
    return isinstance(node, _STRUCTURE) or any(node.func in table for table in known)


class SympyReader:
    """Reads expressions in the given symbols into one instruction list.

    Sums keep SymPy's (deterministic) order of terms with the positive ones first; a product is its variable factors
    in order, divided once by the product of its denominators, times its rational coefficient rounded once.
    Terms and factors made of numbers and held symbols alone come first, so that they can be computed once for a run.
    An `exact` reader rounds nothing; whatever `is_exact` leaves out has to be among the inputs.
    """

    def __init__(
        self, name: str, inputs: Sequence[sp.Basic], held: Collection[sp.Symbol] = (), *, exact: bool = False
    ) -> None:
        self.name = name
        self._exact = exact
        self._held = frozenset(held)
        self._still: dict[sp.Basic, bool] = {}
        self.listing = InstructionList(len(inputs))
        self._indices: dict[sp.Basic, int] = {symbol: index for index, symbol in enumerate(inputs)}
        self._constants: dict[sp.Basic, bool] = {}

    def index_of(self, expression: sp.Basic) -> int:
        """The index of the value of an expression."""
        index = self._indices.get(expression)
        if index is None:
            index = self._read(expression)
            self._indices[expression] = index
        return index

    def define(self, symbol: sp.Symbol, expression: sp.Basic) -> None:
        """Let a symbol stand for an expression from here on."""
        self._indices[symbol] = self.index_of(expression)

    def _read(self, expression: sp.Basic) -> int:
        if isinstance(expression, sp.Number) or self._is_constant(expression):
            return self._number(expression)
        if isinstance(expression, sp.Add):
            return self._sum(expression)
        if isinstance(expression, sp.Mul):
            return self._product(expression)
        if isinstance(expression, sp.Pow):
            return self._power(expression)
        if isinstance(expression, Relational):
            return self._comparison(expression)
        if isinstance(expression, sp.Piecewise):
            return self._piecewise(expression)
        return self._function(expression)

    def _number(self, constant: sp.Basic) -> int:
        if not self._exact or isinstance(constant, BooleanTrue | BooleanFalse):
            return self.listing.constant(rounded(constant, self.name))
        if is_exact(constant):
            exact = sp.Rational(constant)
            above, below = (self.listing.constant(float(part)) for part in (int(exact.p), int(exact.q)))
            return self.listing.emit(Operation.DIV, above, below)
        known = self._indices.get(constant)
        return self.listing.emit(Operation.NEG, self._indices[-constant]) if known is None else known

    def _function(self, expression: sp.Basic) -> int:
        kind = expression.func
        if kind in _UNARY and len(expression.args) == 1:
            return self.listing.emit(_UNARY[kind], self.index_of(expression.args[0]))
        if kind in _SEVERAL:
            return self.listing.emit(_SEVERAL[kind], *map(self.index_of, expression.args))
        if kind in _FOLDED:
            return self._fold(_FOLDED[kind], [self.index_of(argument) for argument in _ordered(expression.args)])
        if kind in _DISGUISED:
            return _DISGUISED[kind](*(Scalar(self.listing, self.index_of(each)) for each in expression.args)).index
        raise FormulaError(
            f"kernel '{self.name}'",
            f"'{getattr(kind, '__name__', kind)}' in {_shortened(expression)} has no numerical meaning here.",
            "Give the function a definition in elementary functions.",
        )

    def _fold(self, operation: Operation, indices: Sequence[int]) -> int:
        return reduce(lambda left, right: self.listing.emit(operation, left, right), indices)

    def _sum(self, expression: sp.Add) -> int:
        held = [term for term in expression.args if self._is_held(term)]
        moving = [term for term in expression.args if not self._is_held(term)]
        total = self._added(None, held)
        total = self._added(total, moving)
        return self.listing.constant(0.0) if total is None else total

    def _added(self, total: int | None, terms: Sequence[sp.Expr]) -> int | None:
        split = [term.as_coeff_Mul() for term in terms]
        for coefficient, rest in split:
            if not coefficient.is_negative:
                index = self._scaled(coefficient, rest)
                total = index if total is None else self.listing.emit(Operation.ADD, total, index)
        for coefficient, rest in split:
            if not coefficient.is_negative:
                continue
            if total is None:
                total = self._scaled(coefficient, rest)
            else:
                total = self.listing.emit(Operation.SUB, total, self._scaled(-coefficient, rest))
        return total

    def _product(self, expression: sp.Mul) -> int:
        return self._scaled(*expression.as_coeff_Mul())

    def _scaled(self, coefficient: sp.Expr, rest: sp.Expr) -> int:
        """coefficient · rest; what does not change is multiplied first."""
        factors = sp.Mul.make_args(rest)
        held = [factor for factor in factors if self._is_held(factor) and not self._is_constant(factor)]
        moving = [factor for factor in factors if factor not in held]
        scale = self._number(coefficient)
        if not held or not moving:
            return self.listing.emit(Operation.MUL, scale, self._factors(factors))
        scale = self.listing.emit(Operation.MUL, scale, self._factors(held))
        return self.listing.emit(Operation.MUL, scale, self._factors(moving))

    def _factors(self, factors: Sequence[sp.Expr]) -> int:
        if len(factors) == 1:
            return self.index_of(factors[0])
        above: list[int] = []
        below: list[int] = []
        constant = sp.Mul(*(factor for factor in factors if self._is_constant(factor)))
        if constant is not sp.S.One:
            above.append(self.index_of(constant))
        for factor in factors:
            if self._is_constant(factor):
                continue
            base, exponent = factor.as_base_exp() if isinstance(factor, sp.Pow) else (factor, sp.S.One)
            if _is_chain(exponent) and exponent.is_negative:
                below.append(self._chain(self.index_of(base), sp.Rational(-exponent)))
            else:
                above.append(self.index_of(factor))
        numerator = self._fold(Operation.MUL, above) if above else self.listing.constant(1.0)
        if not below:
            return numerator
        return self.listing.emit(Operation.DIV, numerator, self._fold(Operation.MUL, below))

    def _power(self, expression: sp.Pow) -> int:
        base, exponent = expression.args
        if base is sp.S.Exp1:
            return self.listing.emit(Operation.EXP, self.index_of(exponent))
        if not _is_chain(exponent):
            return self.listing.emit(Operation.POW, self.index_of(base), self.index_of(exponent))
        chain = self._chain(self.index_of(base), sp.Rational(abs(exponent)))
        if exponent.is_negative:
            return self.listing.emit(Operation.DIV, self.listing.constant(1.0), chain)
        return chain

    def _chain(self, base: int, exponent: sp.Rational) -> int:
        """base**exponent for a positive whole or half-whole exponent."""
        whole, half = divmod(exponent.p, exponent.q)
        if not half:
            return self.listing.power(base, whole)
        root = self.listing.emit(Operation.SQRT, base)
        return root if not whole else self.listing.emit(Operation.MUL, self.listing.power(base, whole), root)

    def _comparison(self, expression: Relational) -> int:
        left, right = self.index_of(expression.lhs), self.index_of(expression.rhs)
        if isinstance(expression, sp.StrictGreaterThan):
            return self.listing.emit(Operation.LESS, right, left)
        if isinstance(expression, sp.GreaterThan):
            return self.listing.emit(Operation.LESS_EQUAL, right, left)
        if isinstance(expression, sp.StrictLessThan):
            return self.listing.emit(Operation.LESS, left, right)
        if isinstance(expression, sp.LessThan):
            return self.listing.emit(Operation.LESS_EQUAL, left, right)
        equal = self.listing.emit(Operation.EQUAL, left, right)
        return equal if isinstance(expression, sp.Equality) else self.listing.emit(Operation.NOT, equal)

    def _piecewise(self, expression: sp.Basic) -> int:
        # Outside all conditions a Piecewise has no value: NaN.
        result: int | None = None
        for pair in reversed(expression.args):
            value, condition = pair.args
            if isinstance(condition, BooleanTrue):
                result = self.index_of(value)
                continue
            otherwise = self.listing.constant(math.nan) if result is None else result
            result = self.listing.emit(Operation.SELECT, self.index_of(condition), self.index_of(value), otherwise)
        return self.listing.constant(math.nan) if result is None else result

    def _is_held(self, expression: sp.Basic) -> bool:
        """Whether nothing in it changes during a run: numbers and held symbols only."""
        if not self._held:
            return self._is_constant(expression)
        known = self._still.get(expression)
        if known is None:
            known = expression in self._held or (
                all(map(self._is_held, expression.args)) if expression.args else self._is_constant(expression)
            )
            self._still[expression] = known
        return known

    def _is_constant(self, expression: sp.Basic) -> bool:
        known = self._constants.get(expression)
        if known is None:
            if isinstance(expression, BooleanTrue | BooleanFalse):
                known = True
            elif self._exact:
                known = False
            elif expression.args:
                known = isinstance(expression, sp.Expr) and all(map(self._is_constant, expression.args))
            else:
                known = not isinstance(expression, sp.Symbol)
            self._constants[expression] = known
        return known


def rounded(constant: sp.Basic, name: str) -> float:
    """The double nearest to an exact real constant.

    Raises:
        FormulaError: a constant that is not a finite real number, or too large for a double.
    """
    if isinstance(constant, BooleanTrue | BooleanFalse):
        return 1.0 if constant else 0.0
    try:
        if isinstance(constant, sp.Rational):
            return int(constant.p) / int(constant.q)
        value = sp.N(constant, DIGITS)
        number = float(value) if value.is_Float or value.is_Rational else math.nan
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise FormulaError(
            f"kernel '{name}'", f"the constant {_shortened(constant)} is not a finite real double-precision number."
        )
    return number


def _is_chain(exponent: sp.Basic) -> bool:
    return isinstance(exponent, sp.Rational) and exponent.q in (1, 2) and 0 < abs(int(exponent.p)) < _SHORT


def _ordered(arguments: Sequence[sp.Basic]) -> list[sp.Basic]:
    # Min, Max, And and Or keep their arguments in a set; an order of our own makes the list reproducible.
    return sorted(arguments, key=sp.default_sort_key)


def _shortened(expression: sp.Basic, limit: int = 80) -> str:
    text = str(expression)
    return text if len(text) <= limit else text[: limit - 3] + "..."
