"""Systems for python-control and back: `to_control`, `from_control`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from ulna.base import OptionalDependencyError, SimulationError
from ulna.program import Kernel, to_python
from ulna.symbolic.compiling import kernel
from ulna.symbolic.formulas import exact
from ulna.system import Linearisation, Signal, System

if TYPE_CHECKING:
    import control


def to_control(system: System, parameters: Mapping[str, float] | None = None) -> control.NonlinearIOSystem:
    """The system as a `control.NonlinearIOSystem`: same names of states, inputs, outputs, SI numbers; a period as dt.

    Its parameters keep their names too and can be changed in any call of python-control (`params={...}`).

    Args:
        system: a plant, an observer, a law or a closed loop. One without outputs shows its states.
        parameters: SI values that replace those of the system.

    Raises:
        OptionalDependencyError: without python-control.
        SimulationError: parameters that are unknown or have no value.

    Examples:
        >>> control.input_output_response(to_control(arm), times, 1.0, [1, 0, 0])  # doctest: +SKIP
    """
    library = _library()
    values = _values(system, parameters or {})
    names = list(values)
    symbols = [*system.state_symbols, *system.input_symbols, *system.parameter_symbols]
    rates = to_python(_formulas(f"rates of {system.name}", symbols, system.states, system.inline(system.rates)))
    outputs, readouts = (system.outputs, system.readouts) if system.outputs else (system.states, system.state_symbols)
    shown = to_python(_formulas(f"outputs of {system.name}", symbols, outputs, system.inline(readouts)))

    def arguments(x: Any, u: Any, params: Mapping[str, float]) -> list[float]:
        return [*np.ravel(x).tolist(), *np.ravel(u).tolist(), *(float(params[name]) for name in names)]

    def update(_time: float, x: Any, u: Any, params: Mapping[str, float]) -> np.ndarray:
        return np.array(rates(*arguments(x, u, params)))

    def output(_time: float, x: Any, u: Any, params: Mapping[str, float]) -> np.ndarray:
        return np.array(shown(*arguments(x, u, params)))

    return library.NonlinearIOSystem(
        update if system.states else None,
        output,
        states=[s.name for s in system.states] or None,
        inputs=[s.name for s in system.inputs] or 0,
        outputs=[s.name for s in outputs],
        params=values,
        dt=float(system.period) if system.period is not None else 0,
        name=system.name.replace(".", "_"),
    )


def linear_to_control(linear: Linearisation) -> control.StateSpace:
    """A linearisation as a `control.StateSpace` with the names of its system, in deviations from its point.

    Raises:
        OptionalDependencyError: without python-control.
        PlantError: entries without a value.
        SimulationError: no inputs or no outputs.
    """
    library, system = _library(), linear.system
    if not (system.inputs and system.outputs):
        missing = "inputs" if not system.inputs else "outputs"
        found, hint = f"it has no {missing}.", 'An input left free and an output are needed: u = "V", y = "theta".'
        raise SimulationError(f"the response of '{system.name}'", found, hint)
    return library.StateSpace(
        *(linear.numbers(name) for name in "ABCD"),
        states=[s.name for s in system.states],
        inputs=[s.name for s in system.inputs],
        outputs=[s.name for s in system.outputs],
        dt=float(system.period) if system.period is not None else 0,
        name=system.name.replace(".", "_"),
    )


def from_control(given: Any) -> System:
    """A linear system of python-control (`StateSpace`, or `TransferFunction` by a realisation) as a `System`.

    x' = A x + B u, y = C x + D u, of one with dt x⁺ = A x + B u; the entries' decimal texts are exact numbers, names
    those of python-control. A `NonlinearIOSystem` holds Python functions, which have no formulas: it can be simulated,
    not brought back.

    Raises:
        OptionalDependencyError: without python-control.
        SimulationError: a nonlinear system, one in discrete time without a period, without a realisation or with
            entries that are not finite.
        PlantError: names that are no names of formulas.

    Examples:
        >>> import control
        >>> ulna.from_control(control.ss([[0, 1], [-2, -3]], [[0], [1]], [[1, 0]], 0)).rates
        (x1, u0 - 2*x0 - 3*x1)
    """
    library = _library()
    if isinstance(given, library.TransferFunction):
        try:
            given = library.tf2ss(given)
        except (ArithmeticError, NotImplementedError, TypeError, ValueError) as error:
            hint = "Give it as a state-space system; a differentiator needs a filter."
            raise SimulationError(
                f"'{given.name}' of python-control", f"it has no realisation ({error}).", hint
            ) from None
    asked = f"'{getattr(given, 'name', given)}' of python-control"
    if not isinstance(given, library.StateSpace):
        raise SimulationError(
            asked,
            f"a {type(given).__name__} has no formulas that could be read.",
            "Write its equations as a plant; linear systems can be taken over.",
        )
    if given.dt is True:
        raise SimulationError(asked, "it runs in discrete time without a period.", "Give it one: dt=0.1, seconds.")
    x, u, y = (_labels(labels) for labels in (given.state_labels, given.input_labels, given.output_labels))
    symbols = sp.Matrix([s.symbol for s in (*x, *u)])
    rows = np.block([[given.A, given.B], [given.C, given.D]])
    if not np.isfinite(rows).all():
        raise SimulationError(asked, "an entry of its matrices is not finite.", "Give numbers.")
    formulas = [sum((exact(float(v)) * s for v, s in zip(row, symbols, strict=True) if v), sp.S.Zero) for row in rows]
    return System(
        name=str(given.name),
        period=exact(float(given.dt)) if given.dt else None,
        states=x,
        rates=tuple(formulas[: len(x)]),
        inputs=u,
        outputs=y,
        readouts=tuple(formulas[len(x) :]),
    )


def _labels(names: Any) -> tuple[Signal, ...]:
    # python-control writes the entries of a vector as x[0], which no formula can.
    return tuple(Signal(name=str(name).replace("[", "").replace("]", "")) for name in names)


def _formulas(name: str, symbols: list[sp.Symbol], signals: Any, expressions: Any) -> Kernel:
    return kernel(name, symbols, {s.name: e for s, e in zip(signals, expressions, strict=True)})


def _values(system: System, given: Mapping[str, float]) -> dict[str, float]:
    known = {p.name: p.si_value for p in system.parameters}
    unknown = [name for name in given if name not in known]
    if unknown:
        raise SimulationError(
            f"parameter '{unknown[0]}' of '{system.name}'",
            "there is no such parameter.",
            f"Known: {', '.join(known) or 'none'}.",
        )
    missing = [name for name, value in known.items() if value is None and name not in given]
    if missing:
        raise SimulationError(
            f"'{system.name}' for python-control",
            f"parameters without a value: {', '.join(missing)}.",
            f"Give them: to_control(system, {{'{missing[0]}': ...}}).",
        )
    return {name: float(given[name]) if name in given else float(sp.N(value, 20)) for name, value in known.items()}


def _library() -> Any:
    try:
        import control
    except ImportError:
        raise OptionalDependencyError("python-control", "control") from None
    return control
