"""The right-hand side of a system as one kernel, definitions read once: what the numeric road works on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ulna.base import PlantError
from ulna.program import ImplicitKernel, Kernel, explicit
from ulna.symbolic.compiling import kernel
from ulna.system.affine import require_continuous
from ulna.system.system import System


@dataclass(frozen=True, slots=True, kw_only=True)
class SystemKernel:
    """Rates and functions of a plant over its states and inputs, parameters at numbers.

    Attributes:
        kernel: inputs the states then the plant's inputs; outputs the rates, then the functions.
        source: the same before unknowns of implicit definitions were found; the kernel itself where there are none.
        states, inputs: their names; rates, functions: names of the outputs.
        point: the given operating point by state and input, exact; zero where none is given.
    """

    kernel: Kernel
    source: Kernel | ImplicitKernel
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    rates: tuple[str, ...]
    functions: tuple[str, ...]
    point: tuple[tuple[str, sp.Expr], ...]


def system_kernel(
    system: System,
    functions: Sequence[sp.Expr] | None = None,
    parameters: Mapping[sp.Symbol, sp.Expr] | None = None,
) -> SystemKernel:
    """The kernel of rates and functions.

    Args:
        system: the plant.
        functions: functions of the state; the plant's outputs if left out.
        parameters: exact values that replace or complete the plant's own.

    Raises:
        PlantError: for parameters without a value, and in discrete time.
    """
    require_continuous(system)
    values = {**system.values, **(parameters or {})}
    missing = [p.name for p in system.parameters if p.symbol not in values]
    if missing:
        found = f"parameters without a value: {', '.join(missing)}."
        raise PlantError(f"numbers of '{system.name}'", found, "Give them values.")
    given = {name: value.xreplace(values) for name, value in system.operating_point}
    rates = tuple(f"rate {s.name}" for s in system.states)
    chosen = system.readouts if functions is None else tuple(functions)
    names = tuple(f"h{k + 1}" for k in range(len(chosen)))
    outputs = dict(zip((*rates, *names), (*system.rates, *chosen), strict=True))
    outputs |= {f"zero of {d.name}": d.expression for d in system.unknowns}
    source = whole = kernel(
        system.name,
        (*system.state_symbols, *system.input_symbols, *(d.symbol for d in system.unknowns)),
        outputs,
        definitions={**values, **{d.symbol: d.expression for d in system.definitions if not d.implicit}},
    )
    if system.unknowns:
        source = ImplicitKernel(
            kernel=whole,
            unknowns=tuple(d.name for d in system.unknowns),
            residuals=tuple(f"zero of {d.name}" for d in system.unknowns),
        )
        whole = explicit(source)
    return SystemKernel(
        kernel=whole,
        source=source,
        states=tuple(s.name for s in system.states),
        inputs=tuple(s.name for s in system.inputs),
        rates=rates,
        functions=names,
        point=tuple((s.name, given.get(s.name, sp.S.Zero)) for s in (*system.states, *system.inputs)),
    )
