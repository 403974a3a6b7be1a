"""The instruction list of a CasADi SX function read into a `Kernel`: the road of large plants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from ulna.base import FormulaError
from ulna.program.instructions import InstructionList, Operation, pruned
from ulna.program.kernel import Kernel, check_names

_SAME_NAME = (
    *("ADD", "SUB", "MUL", "DIV", "NEG", "SQRT", "EXP", "LOG", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2"),
    *("SINH", "COSH", "TANH", "ASINH", "ACOSH", "ATANH", "SIGN", "FLOOR", "AND", "OR", "NOT"),
)
_OTHER_NAME = {
    "OP_FABS": Operation.ABS,
    "OP_FMIN": Operation.MIN,
    "OP_FMAX": Operation.MAX,
    "OP_LT": Operation.LESS,
    "OP_LE": Operation.LESS_EQUAL,
    "OP_EQ": Operation.EQUAL,
}


def kernel_from_casadi(
    function: Any,
    *,
    name: str | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> Kernel:
    """The kernel of a CasADi function made of SX expressions.

    Args:
        function: a `casadi.Function` whose arguments and results are dense or sparse matrices.
        name: for messages; the function's own when left out.
        inputs: one name for each scalar of all arguments, column by column; when left out the argument's name,
            with `_0`, `_1`, … for an argument of more than one element.
        outputs: the same for the results. Structural zeros of a result come out as the constant 0.

    Raises:
        FormulaError: a function not made of SX, an operation a kernel does not have, a wrong number of names.
    """
    label = name or function.name()
    if not function.is_a("SXFunction"):
        raise FormulaError(
            f"kernel '{label}' from CasADi", f"the function is a {function.class_name()}.", "Expand it: f.expand()."
        )
    names = _checked(label, "input", inputs, _labels(function.n_in(), function.name_in, function.size_in))
    results = _checked(label, "output", outputs, _labels(function.n_out(), function.name_out, function.size_out))
    reader = _CasadiReader(function, label)
    listing, values = reader.read()
    check_names(label, names, results)
    kept, renumbered = pruned(len(names), listing.instructions, values)
    return Kernel(name=label, inputs=names, outputs=results, instructions=kept, results=renumbered)


class _CasadiReader:
    """Follows CasADi's work vector, whose places are used again and again, and hands out single assignments."""

    def __init__(self, function: Any, label: str) -> None:
        self.function = function
        self.label = label
        self.places: dict[int, int] = {}
        sizes = [function.numel_in(k) for k in range(function.n_in())]
        self.first_input = [sum(sizes[:k]) for k in range(len(sizes))]
        self.listing = InstructionList(sum(sizes))

    def read(self) -> tuple[InstructionList, list[int]]:
        """The instructions, and for each dense output element the index of its value."""
        function = self.function
        inputs = [_dense_positions(function.sparsity_in(k)) for k in range(function.n_in())]
        results: dict[tuple[int, int], int] = {}
        codes = _codes()
        for k in range(function.n_instructions()):
            code = codes.get(function.instruction_id(k), str(function.instruction_id(k)))
            source, target = function.instruction_input(k), function.instruction_output(k)
            if code == "OP_INPUT":
                self.places[target[0]] = self.first_input[source[0]] + inputs[source[0]][source[1]]
            elif code == "OP_OUTPUT":
                results[target[0], target[1]] = self.places[source[0]]
            elif code == "OP_CONST":
                self.places[target[0]] = self.listing.constant(function.instruction_constant(k))
            else:
                self.places[target[0]] = self._operation(code, [self.places[place] for place in source])
        return self.listing, self._dense(results)

    def _dense(self, results: Mapping[tuple[int, int], int]) -> list[int]:
        values = []
        for k in range(self.function.n_out()):
            element = {place: nonzero for nonzero, place in enumerate(_dense_positions(self.function.sparsity_out(k)))}
            for place in range(self.function.numel_out(k)):
                nonzero = element.get(place)
                # CasADi writes no instruction for an output entry that is structurally zero.
                known = None if nonzero is None else results.get((k, nonzero))
                values.append(self.listing.constant(0.0) if known is None else known)
        return values

    def _operation(self, code: str, operands: list[int]) -> int:
        emit, constant = self.listing.emit, self.listing.constant
        operation = _known().get(code)
        if operation is not None:
            return emit(operation, *operands)
        a = operands[0]
        match code:
            case "OP_ASSIGN":
                index = a
            case "OP_POW" | "OP_CONSTPOW":
                index = self._power(a, operands[1])
            case "OP_SQ":
                index = emit(Operation.MUL, a, a)
            case "OP_TWICE":
                index = emit(Operation.ADD, a, a)
            case "OP_INV":
                index = emit(Operation.DIV, constant(1.0), a)
            case "OP_NE":
                index = emit(Operation.NOT, emit(Operation.EQUAL, *operands))
            case "OP_CEIL":
                index = emit(Operation.NEG, emit(Operation.FLOOR, emit(Operation.NEG, a)))
            case "OP_IF_ELSE_ZERO":
                index = emit(Operation.SELECT, a, operands[1], constant(0.0))
            case _:
                raise FormulaError(f"kernel '{self.label}' from CasADi", f"the operation {code} has no counterpart.")
        return index

    def _power(self, base: int, exponent: int) -> int:
        value = self.listing.value_of(exponent)
        if value is not None and value.is_integer() and value >= 1:
            return self.listing.power(base, int(value))
        return self.listing.emit(Operation.POW, base, exponent)


@cache
def _codes() -> dict[int, str]:
    import casadi as ca  # only a CasADi plant should pay for this import

    return {getattr(ca, code): code for code in dir(ca) if code.startswith("OP_")}


@cache
def _known() -> dict[str, Operation]:
    return {f"OP_{code}": Operation[code] for code in _SAME_NAME} | _OTHER_NAME


def _dense_positions(sparsity: Any) -> list[int]:
    """For each structural nonzero its place in the dense matrix, counted column by column."""
    rows = sparsity.size1()
    return [column * rows + row for row, column in zip(sparsity.row(), sparsity.get_col(), strict=True)]


def _labels(count: int, name_of: Any, size_of: Any) -> list[str]:
    labels = []
    for k in range(count):
        rows, columns = size_of(k)
        base = name_of(k)
        labels += [base] if rows * columns == 1 else [f"{base}_{element}" for element in range(rows * columns)]
    return labels


def _checked(label: str, kind: str, given: Sequence[str] | None, default: list[str]) -> tuple[str, ...]:
    if given is None:
        return tuple(default)
    if len(given) != len(default):
        raise FormulaError(
            f"kernel '{label}' from CasADi", f"{len(given)} {kind} names for {len(default)} {kind} scalars."
        )
    return tuple(given)
