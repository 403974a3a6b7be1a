"""`to_fixed`: a kernel over stated ranges in fixed point."""

from __future__ import annotations

from collections.abc import Mapping

from ulna.program.fixed.builder import Integers, UnboundedError, Value, point_of
from ulna.program.fixed.functions import function_of, power_of
from ulna.program.fixed.integers import Doubt, Format, IntegerProgram, Step
from ulna.program.fixed.interval import Interval
from ulna.program.instructions import Instruction, Operation, pruned
from ulna.program.kernel import Kernel

_FUNCTIONS = frozenset(
    Operation(name)
    for name in [
        "exp",
        "log",
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "asinh",
        "acosh",
        "atanh",
    ]
)
_COMPARISONS = {
    Operation.LESS: Step.LESS,
    Operation.LESS_EQUAL: Step.LESS_EQUAL,
    Operation.EQUAL: Step.EQUAL,
}
_LOGIC = {Operation.AND: Step.AND, Operation.OR: Step.OR, Operation.NOT: Step.NOT}


def to_fixed(
    kernel: Kernel, inputs: Mapping[str, Format], outputs: Mapping[str, Format], *, factor: int
) -> IntegerProgram:
    """The kernel in fixed point: every value has the binary point that its interval allows.

    The intervals hold all roundings, so no value overflows: inputs are limited to their bounds on entry, and outputs
    that have a format are limited to theirs.

    Args:
        kernel: functions not written out. inputs: format of every input. outputs: of some outputs; the others get
            what their interval allows.
        factor: bits of each factor of a product, sign included: 32 or 16.

    Raises:
        UnboundedError: a value without bounds over the inputs' bounds, or an operation that fixed point lacks.
    """
    w = Integers([inputs[name] for name in kernel.inputs], factor)
    walk = _Walk(w, kernel, 2.0**-27 if factor > 16 else 2.0**-16)
    results, formats = [], {}
    for name, result in zip(kernel.outputs, kernel.results, strict=True):
        value = walk.value(result)
        form = outputs.get(name)
        if form is None:
            form = Format(value.point, value.interval.lower, value.interval.upper)
        else:
            value = _stored(w, value, form)
        formats[name] = form
        results.append(value)
    doubts = frozenset[int]().union(*(value.doubts for value in results))
    instructions, kept = pruned(len(kernel.inputs), w.instructions, [value.index for value in results])
    return IntegerProgram(
        inputs={name: inputs[name] for name in kernel.inputs},
        outputs=formats,
        instructions=instructions,
        results=kept,
        functions=dict(w.functions),
        errors={name: value.error for name, value in zip(kernel.outputs, results, strict=True)},
        doubts=tuple(Doubt(walk.doubted[k], w.margins[k]) for k in sorted(doubts)),
    )


def _stored(w: Integers, value: Value, form: Format) -> Value:
    """Limited to the bounds of a format, with its binary point."""
    if value.interval.upper > form.upper:
        value = w.extreme(Step.MIN, value, w.constant(form.upper, form.point))
    if value.interval.lower < form.lower:
        value = w.extreme(Step.MAX, value, w.constant(form.lower, form.point))
    return w.moved(value, form.point)


class _Walk:
    """The instructions of a kernel, one after the other."""

    def __init__(self, w: Integers, kernel: Kernel, part: float) -> None:
        self.w, self.kernel, self.part = w, kernel, part
        self.first = len(kernel.inputs)
        self.values: list[Value | None] = list(w.inputs)
        self.numbers: dict[int, float] = {}
        self.doubted: dict[int, str] = {}
        for index, each in enumerate(kernel.instructions, start=self.first):
            if each.operation is Operation.CONSTANT:
                self.numbers[index] = each.value
                self.values.append(None)
                continue
            try:
                value = self._next(each)
            except UnboundedError as error:
                raise UnboundedError(f"{self._text(index, 3)} in fixed point", *_parts(error)) from None
            for doubt in value.doubts:
                self.doubted.setdefault(doubt, self._text(index, 3))
            self.values.append(value)

    def value(self, index: int) -> Value:
        """The value of an index; constants are made when they are used."""
        found = self.values[index]
        if found is None:
            found = self.values[index] = self.w.constant(self.numbers[index])
        return found

    def _next(self, each: Instruction) -> Value:  # noqa: PLR0911, PLR0912 - one for each operation
        w, operation = self.w, each.operation
        if operation in _COMPARISONS:
            return self._compared(operation, each.operands)
        if operation is Operation.SELECT:
            return self._chosen(each)
        if operation is Operation.POW:
            return self._power(each)
        operands = [self.value(k) for k in each.operands]
        if operation in _LOGIC:
            return _decided(w, operation, operands)
        if operation in _FUNCTIONS:
            return function_of(w, operation, operands[0], self.part)
        match operation:
            case Operation.ADD | Operation.SUB:
                return w.sum(Step(operation.value), operands[0], operands[1])
            case Operation.MUL:
                return w.product(operands[0], operands[1])
            case Operation.FMA:
                return w.sum(Step.ADD, w.product(operands[0], operands[1]), operands[2])
            case Operation.DIV:
                return w.quotient(operands[0], operands[1])
            case Operation.NEG:
                return w.sign_changed(operands[0])
            case Operation.ABS:
                return w.magnitude(operands[0])
            case Operation.FLOOR:
                return w.floor(operands[0])
            case Operation.SQRT:
                return w.root(operands[0])
            case Operation.MIN | Operation.MAX:
                return w.extreme(Step(operation.value), operands[0], operands[1])
            case Operation.SIGN:
                zero, one = w.constant(0.0), w.constant(1.0)
                below = w.choice(
                    w.compared(Step.LESS, operands[0], zero), w.constant(-1.0), zero, (Interval(-1, -1), Interval(0, 0))
                )
                return w.choice(w.compared(Step.LESS, zero, operands[0]), one, below, (Interval(1, 1), Interval(-1, 0)))
            case _:
                raise UnboundedError(f"'{operation}'", "it has no form in fixed point.")

    def _power(self, each: Instruction) -> Value:
        exponent = self.numbers.get(each.operands[1])
        if exponent is None:
            raise UnboundedError("a power with an exponent that varies", "it has no form in fixed point.")
        return power_of(self.w, self.value(each.operands[0]), exponent, self.part)

    def _compared(self, operation: Operation, operands: tuple[int, ...]) -> Value:
        """A comparison that the intervals decide is a constant."""
        a, b = (self._interval(k) for k in operands)
        never = a.lower > b.upper or (operation is Operation.LESS and a.lower >= b.upper)
        always = a.upper < b.lower or (operation is Operation.LESS_EQUAL and a.upper <= b.lower)
        if operation is Operation.EQUAL:
            never, always = a.lower > b.upper or a.upper < b.lower, a.lower == a.upper == b.lower == b.upper
        if never or always:
            return self.w.constant(float(always and not never), 0)
        return self.w.compared(_COMPARISONS[operation], self.value(operands[0]), self.value(operands[1]))

    def _interval(self, index: int) -> Interval:
        number, found = self.numbers.get(index), self.values[index]
        return Interval(number, number) if number is not None or found is None else found.interval  # type: ignore[arg-type]

    def _chosen(self, each: Instruction) -> Value:
        condition, yes, no = each.operands
        decided = self.value(condition)
        if decided.interval.lower == decided.interval.upper:
            return self.value(yes if decided.interval.lower != 0.0 else no)
        narrowed = self._narrowed(condition, yes, truth=True), self._narrowed(condition, no, truth=False)
        compares = [{yes, no}] == [set(pair) for pair in self._facts(condition, truth=True)]
        return self.w.choice(decided, self.value(yes), self.value(no), narrowed, compares=compares)

    def _narrowed(self, condition: int, index: int, *, truth: bool) -> Interval:
        """What a value can be where the condition holds, or does not."""
        found = self.value(index)
        interval = found.interval
        for low, high in self._facts(condition, truth=truth):
            # Operands are rounded to a common binary point before they are compared.
            slack = 2.0 * max(2.0 ** -self.value(k).point for k in (low, high))
            if index == low:
                interval = interval.within(-float("inf"), self.value(high).interval.upper + slack)
            if index == high:
                interval = interval.within(self.value(low).interval.lower - slack, float("inf"))
        return interval

    def _facts(self, condition: int, *, truth: bool) -> list[tuple[int, int]]:
        """Pairs (a, b) with a ≤ b."""
        if condition < self.first:
            return []
        each = self.kernel.instructions[condition - self.first]
        if each.operation in (Operation.LESS, Operation.LESS_EQUAL):
            a, b = each.operands
            return [(a, b) if truth else (b, a)]
        if each.operation is Operation.NOT:
            return self._facts(each.operands[0], truth=not truth)
        if each.operation is (Operation.AND if truth else Operation.OR):
            return [fact for k in each.operands for fact in self._facts(k, truth=truth)]
        return []

    def _text(self, index: int, depth: int) -> str:
        """The formula of a value, to some depth."""
        if index < self.first:
            return self.kernel.inputs[index]
        each = self.kernel.instructions[index - self.first]
        if each.operation is Operation.CONSTANT:
            return f"{each.value:.4g}"
        if depth == 0:
            return "…"
        signs = {"add": " + ", "sub": " - ", "mul": "*", "div": "/", "less": " < ", "less_equal": " ≤ ", "equal": " = "}
        parts = [self._text(k, depth - 1) for k in each.operands]
        if each.operation in signs:
            return f"({signs[each.operation].join(parts)})"
        return f"{each.operation}({', '.join(parts)})"


def _decided(w: Integers, operation: Operation, operands: list[Value]) -> Value:
    """Logic; what is known already is a constant."""
    known = [None if a.interval.lower != a.interval.upper else a.interval.lower != 0.0 for a in operands]
    if operation is Operation.NOT:
        return w.logic(Step.NOT, *operands) if known[0] is None else w.constant(float(not known[0]), 0)
    ends = operation is Operation.OR
    if ends in known:
        return w.constant(float(ends), 0)
    left = [a for a, each in zip(operands, known, strict=True) if each is None]
    if not left:
        return w.constant(float(not ends), 0)
    return left[0] if len(left) == 1 else w.logic(_LOGIC[operation], *left)


def _parts(error: UnboundedError) -> tuple[str, str]:
    return f"{error}", "Give narrower ranges, or single precision."


def format_of(lower: float, upper: float) -> Format:
    """The finest format that holds an interval."""
    return Format(point_of(max(abs(lower), abs(upper))), lower, upper)
