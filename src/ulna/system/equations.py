"""The equations of a system as people read them: every name in them is a state, an input, a parameter or defined."""

from __future__ import annotations

import sympy as sp

from ulna.symbolic.formulas import equations_latex, name_latex
from ulna.system.system import System

_SIGNS = str.maketrans({"*": "·", "^": ""} | dict(zip("-123456789", "⁻¹²³⁴⁵⁶⁷⁸⁹", strict=True)))


def system_latex(system: System, *, values: bool = True) -> str:
    """`equations`, then, with `values`, those of the parameters, in a display environment."""
    told = [_value_latex(p.name, p.value, p.unit) for p in system.parameters if p.value is not None]
    return equations_latex(equations(system), rf"\text{{with }} {', '.join(told)}" if told and values else "")


def equations(system: System) -> list[tuple[str, sp.Expr]]:
    """(left side as LaTeX, right side) of definitions, rates and outputs.

    A definition that only repeats another name is put in: of a closed loop most wires do.
    """
    replaced = _repeated(system)
    definitions = [(d.symbol, d.expression) for d in system.definitions if not d.implicit and d.symbol not in replaced]
    taken = {s.symbol for s in (*system.states, *system.inputs, *system.parameters, *system.definitions)}
    for output, readout in zip(system.outputs, system.readouts, strict=True):
        # A definition that is shown as an output has the output's name.
        shown = replaced.get(readout, readout)
        if output.symbol not in taken and shown in {symbol for symbol, _ in definitions}:
            replaced = {name: output.symbol if to == shown else to for name, to in replaced.items()}
            replaced |= {shown: output.symbol}
            taken.add(output.symbol)

    def told(expression: sp.Expr) -> sp.Expr:
        return expression.xreplace(replaced)

    rows = [(name_latex(told(symbol).name), told(expression)) for symbol, expression in definitions]
    rows += [("0", told(d.expression)) for d in system.unknowns]
    left = "{}^{{+}}" if system.discrete else r"\dot{{{}}}"
    rows += [(left.format(name_latex(s.name)), told(e)) for s, e in zip(system.states, system.rates, strict=True)]
    known = {told(symbol).name for symbol, _ in definitions}
    for output, readout in zip(system.outputs, system.readouts, strict=True):
        if output.name not in known and told(readout) != output.symbol:
            rows.append((name_latex(output.name), told(readout)))
    return rows


def _repeated(system: System) -> dict[sp.Symbol, sp.Symbol]:
    """Definitions that only give another name to what has one, with that; outputs keep their names."""
    shown = {o.symbol for o in system.outputs}
    found: dict[sp.Symbol, sp.Symbol] = {}
    first: dict[sp.Expr, sp.Symbol] = {}
    for definition in system.definitions:
        if definition.implicit or definition.symbol in shown:
            continue
        meant = definition.expression.xreplace(found)
        if isinstance(meant, sp.Symbol):
            found[definition.symbol] = meant
        elif meant in first:
            found[definition.symbol] = first[meant]
        else:
            first[meant] = definition.symbol
    return found


def _value_latex(name: str, value: sp.Expr, unit: str) -> str:
    number = sp.latex(value if value.is_Integer else sp.Float(value, 6), full_prec=False)
    return f"{name_latex(name)} = {number}" + (rf"\ \text{{{unit.translate(_SIGNS)}}}" if unit else "")
