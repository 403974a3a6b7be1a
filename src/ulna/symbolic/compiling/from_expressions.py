"""`kernel`: expressions compiled into a `Kernel`, the one bridge from symbols to numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import sympy as sp

from ulna.base import FormulaError
from ulna.program import Kernel, check_names, pruned
from ulna.symbolic.compiling.sympy_reader import SympyReader


def kernel(
    name: str,
    inputs: Sequence[sp.Symbol],
    outputs: Mapping[str, sp.Expr],
    *,
    held: Collection[sp.Symbol] = (),
    definitions: Mapping[sp.Symbol, sp.Expr] | None = None,
) -> Kernel:
    """The kernel of `outputs` as functions of `inputs`.

    Args:
        name: for messages and generated source.
        inputs: the symbols that become inputs, in order.
        outputs: exact expressions by output name, in order. Rationals and other exact constants are rounded to the
            nearest double here and nowhere earlier.
        held: inputs that keep their value during a run (parameters); terms and factors made of them alone are
            computed first, so that `hoist` finds them.
        definitions: abbreviations that outputs and later definitions may use, in order; read once and never put in,
            so that a plant of thousands of operations stays one.

    Raises:
        FormulaError: a symbol that is not an input, a function or constant with no real double-precision value,
            or a name used twice; it names them.
    """
    names = tuple(symbol.name for symbol in inputs)
    check_names(name, names, outputs)
    expressions = {label: sp.sympify(expression) for label, expression in outputs.items()}
    _check_bound(name, (*inputs, *(definitions or ())), expressions)
    reader = SympyReader(name, tuple(inputs), held)
    for symbol, expression in (definitions or {}).items():
        reader.define(symbol, expression)
    results = tuple(reader.index_of(expression) for expression in expressions.values())
    instructions, results = pruned(len(names), reader.listing.instructions, results)
    return Kernel(name=name, inputs=names, outputs=tuple(expressions), instructions=instructions, results=results)


def _check_bound(name: str, inputs: Sequence[sp.Symbol], expressions: Mapping[str, sp.Expr]) -> None:
    bound = set(inputs)
    unbound: dict[sp.Basic, str] = {}
    for label, expression in expressions.items():
        for symbol in expression.free_symbols - bound:
            unbound.setdefault(symbol, label)
    if not unbound:
        return
    places = ", ".join(f"{symbol} (in {label})" for symbol, label in sorted(unbound.items(), key=str))
    known = {symbol.name for symbol in inputs}
    twins = sorted(str(symbol) for symbol in unbound if str(symbol) in known)
    hint = f"Give them values or list them as inputs; the inputs are: {', '.join(sorted(known)) or 'none'}."
    if twins:
        hint = f"{', '.join(twins)}: an input has this name but other assumptions; symbols here are real=True."
    raise FormulaError(f"kernel '{name}'", f"symbols without a value: {places}.", hint)
