"""The plant that is meant, by file or name, and the values that `--set` gives its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ulna.base import SimulationError
from ulna.cli.options import PlantOptions
from ulna.cli.typed_values import known_name, named_values, quantity, typed_list, unit_in

if TYPE_CHECKING:
    import sympy as sp

    from ulna.system import Parameter, Signal, System


def plant_of(options: PlantOptions) -> System:
    """The plant of a file or, where there is no such file, of the catalogue, with the values that the options set.

    Raises:
        UlnaError: if it is neither, or a value does not fit.
    """
    system = plant_in_file(options)
    return system.with_parameters(parameter_values(system, options.values))


def plant_in_file(options: PlantOptions) -> System:
    """The same with the values of its file.

    Raises:
        UlnaError: if it is neither a file nor in the catalogue, or has no output that `--output` or `--measured` names.
    """
    from ulna.plants import as_plant
    from ulna.system import with_uses

    system = as_plant(options.name)
    known = [s.name for s in system.outputs]
    chosen = {
        use: [known_name(name, known, f"{flag} {name}", "output") for text in given for name in typed_list(text)]
        for use, flag, given in (
            ("controlled", "--output", options.controlled),
            ("measured", "--measured", options.measured),
        )
        if given
    }
    return with_uses(system, **chosen) if chosen else system


def parameter_values(system: System, entries: Sequence[str], *, also: Sequence[Parameter] = ()) -> dict[str, sp.Expr]:
    """The exact SI values that `--set` gives parameters of the plant, or those in `also`.

    Raises:
        UlnaError: unknown names, values out of the range that the file gives.
    """
    known = {p.name: p for p in (*also, *system.parameters)}
    values = {}
    for name, text, asked in named_values(entries, "--set"):
        parameter = known[known_name(name, list(known), asked, "parameter")]
        values[name] = quantity(text, asked, unit=unit_in(system, parameter))
        require_in_range(parameter, values[name], asked)
    return values


def signal_values(
    system: System, signals: Sequence[Signal], entries: Sequence[str], option: str, what: str
) -> dict[str, float]:
    """SI numbers of states, inputs or outputs by name, of entries like `theta=90deg`.

    Raises:
        UlnaError: unknown names, texts that are not values.
    """
    known = {signal.name: signal for signal in signals}
    found = {}
    for name, text, asked in named_values(entries, option):
        signal = known[known_name(name, list(known), asked, what)]
        found[name] = float(quantity(text, asked, unit=unit_in(system, signal)))
    return found


def ranges_of(system: System, entries: Sequence[str], option: str) -> dict[str, tuple[float, float]]:
    """(lower, upper), SI, by the name of each state in entries like `x=-5:5` or `theta=-90deg:90deg`.

    Raises:
        UlnaError: unknown names, texts that are not pairs of values.
    """
    states = {s.name: s for s in system.states}
    found = {}
    for name, text, asked in named_values(entries, option):
        state = states[known_name(name, list(states), asked, "state")]
        ends = [float(quantity(end, asked, unit=unit_in(system, state))) for end in text.split(":")]
        if len(ends) != 2 or not ends[0] < ends[1]:
            hint = f'Write {option} "{name}=-1:1".'
            raise SimulationError(asked, "expected two values, the lower one first.", hint)
        found[name] = (ends[0], ends[1])
    return found


def require_in_range(item: Signal | Parameter, value: sp.Expr | float, asked: str) -> None:
    """Refuse a value outside the range that the plant declares for it.

    Raises:
        SimulationError: with the value and the range.
    """
    from ulna.system import STAY_INSIDE, out_of_range

    if found := out_of_range(item, value):
        raise SimulationError(asked, found, STAY_INSIDE)
