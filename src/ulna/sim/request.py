"""What `simulate` is asked for, checked and put in order: names to places, one value to all runs."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ulna.base import SimulationError
from ulna.loop import Loop
from ulna.sim.given_ranges import check_ranges
from ulna.sim.inputs import Constant, Input, as_input
from ulna.sim.parameters import default_row, default_values
from ulna.sim.starts import Request, Starts
from ulna.system import Signal, System


def count_of(
    initial: Any,
    parameters: Mapping[str, Any] | None,
    inputs: Mapping[str, Any] | None,
    targets: Mapping[str, Any] | None,
    seed: Any,
) -> int | None:
    """The number of runs; None for one run.

    Raises:
        SimulationError: numbers that differ, or none at all.
    """
    lengths: dict[str, int] = {}
    if isinstance(initial, Mapping):
        lengths |= {f"initial '{name}'": len(value) for name, value in initial.items() if np.ndim(value)}
    elif np.ndim(initial) == 2:
        lengths["initial"] = len(initial)
    elif not (parameters or inputs or targets) and isinstance(seed, int):
        return None
    for what, table in (("parameter", parameters), ("input", inputs), ("target", targets)):
        for name, value in (table or {}).items():
            if isinstance(value, np.ndarray | list | tuple):
                lengths[f"{what} '{name}'"] = len(value)
            elif np.ndim(getattr(value, "values", 0.0)) == 2:
                lengths[f"{what} '{name}'"] = len(value.values)
    if np.ndim(seed):
        lengths["seed"] = len(seed)
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{name}: {length}" for name, length in lengths.items())
        raise SimulationError("runs of a simulation", f"their numbers differ ({shown}).")
    count = next(iter(lengths.values()), None)
    if count == 0:
        raise SimulationError("runs of a simulation", "there are none.")
    return count


def instants(given: Any) -> np.ndarray:
    """(T,) the times.

    Raises:
        SimulationError: fewer than two, not increasing, negative or not finite ones.
    """
    times = np.array((0.0, given) if isinstance(given, float | int) else given, dtype=float)
    if times.ndim != 1 or len(times) < 2:
        raise SimulationError(
            "times of the simulation", f"they have shape {times.shape}.", "Give a final time or at least two times."
        )
    if len(times) == 2:
        start, end = times.tolist()
        good = 0.0 <= start < end < math.inf
    else:
        good = times[0] >= 0.0 and bool((times[1:] > times[:-1]).all()) and math.isfinite(times[-1])
    if good:
        return times
    if not np.isfinite(times).all():
        found = "one of them is not a finite number."
    elif times.min() < 0:
        found = f"{times.min():g} s is negative."
    else:
        place = int(np.argmin(np.diff(times)))
        found = f"{times[place + 1]:g} s follows {times[place]:g} s."
    raise SimulationError("times of the simulation", found, "Times start at 0 or later and increase.")


def continuous_run(
    system: System,
    loop: Loop | None,
    initial: Any,
    times: np.ndarray,
    inputs: Mapping[str, Any] | None,
    parameters: Mapping[str, float] | None,
) -> tuple[np.ndarray, np.ndarray, dict[str, Input], Mapping[str, float] | None]:
    """State, times, inputs and parameters of one continuous run.

    Raises:
        SimulationError: see `simulate`.
    """
    state = _one_state(system, _known_states(system, loop, initial))
    driven = _driven(system.name, system.inputs, inputs, times)
    check_ranges(system, loop, state, driven, parameters or {})
    return state, times, driven, parameters


def request(
    system: System,
    loop: Loop | None,
    runs: int | None,
    initial: Any,
    times: np.ndarray,
    inputs: Mapping[str, Any] | None,
    parameters: Mapping[str, Any] | None,
    targets: Mapping[str, Any] | None,
    seed: Any,
    threads: int | None,
) -> Request:
    """Many runs, or one run of a loop with a processor.

    Raises:
        SimulationError: see `simulate`.
    """
    count = runs or 1
    sampled = loop is not None and loop.sampled
    states, memory = _states(system, loop if sampled else None, _known_states(system, loop, initial), count)
    shared, each = _split(system, loop if sampled else None, inputs or {}, runs, times)
    plant, controller = _parameters(system, loop if sampled else None, parameters or {}, count)
    names = [p.name for p in system.parameters]
    check_ranges(
        system, loop, states, {**shared, **each}, {n: plant[:, names.index(n)] for n in parameters or {} if n in names}
    )
    return Request(
        system=system,
        times=times,
        starts=Starts(
            initial=states,
            memory=memory,
            parameters=plant,
            controller=controller,
            inputs=shared,
            own=each,
            targets=_targets(system, targets or {}, count),
            seeds=_seeds(seed, count),
        ),
        threads=1 if runs is None else threads or os.cpu_count() or 1,
    )


def _known_states(system: System, loop: Loop | None, given: Any) -> Any:
    """What is given; of a continuous loop, the plant's states are enough."""
    if loop is None or loop.sampled:
        return given if loop is None or not loop.initial else _sampled_start(loop, given)
    plant = len(loop.plant.states)
    names = [s.name for s in system.states]
    rest = dict.fromkeys(names[plant:], 0.0) | dict(loop.initial)
    if isinstance(given, Mapping):
        return rest | dict(given)
    rows = np.asarray(given, dtype=float)
    if rows.shape[-1:] == (plant,) and plant < len(names):
        return np.concatenate([rows, np.broadcast_to(list(rest.values()), (*rows.shape[:-1], len(rest)))], axis=-1)
    return given


def _sampled_start(loop: Loop, given: Any) -> Any:
    """The same, with where states of the controller start that do not start at 0."""
    if isinstance(given, Mapping):
        return {**loop.initial, **given}
    rows, names = np.asarray(given, dtype=float), [s.name for s in loop.plant.states]
    if rows.shape[-1:] != (len(names),):
        return given
    return {**loop.initial, **{name: rows[..., k] for k, name in enumerate(names)}}


def _one_state(system: System, given: Any) -> np.ndarray:
    names = [signal.name for signal in system.states]
    if isinstance(given, Mapping):
        _check_state_names(system, given, names, ())
        given = [given[name] for name in names]
    try:
        state = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise SimulationError(f"initial state of '{system.name}'", f"{given!r} is not a row of numbers.") from None
    if state.shape != (len(names),):
        raise SimulationError(
            f"initial state of '{system.name}'",
            f"it has shape {state.shape} instead of ({len(names)},).",
            f"Give one number for each state: {', '.join(names)}.",
        )
    if not math.isfinite(sum(state.tolist())):
        bad = [f"{name} = {value}" for name, value in zip(names, state, strict=True) if not math.isfinite(value)]
        if bad:
            raise SimulationError(f"initial state of '{system.name}'", f"not a finite number: {', '.join(bad)}.")
    return state


def _check_state_names(system: System, given: Mapping[str, Any], names: list[str], further: Sequence[str]) -> None:
    missing = [name for name in names if name not in given]
    unknown = [name for name in given if name not in names and name not in further]
    if missing or unknown:
        parts = {"missing": missing, "unknown": unknown}
        found = "; ".join(f"{what}: {', '.join(some)}" for what, some in parts.items() if some)
        hint = f"Its states: {', '.join(dict.fromkeys((*names, *further)))}."
        hint += " `equilibrium(plant).numbers` has those of the plant at rest." if missing else ""
        raise SimulationError(f"initial state of '{system.name}'", f"{found}.", hint)


def _states(system: System, loop: Loop | None, given: Any, count: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(N, n) states of the system, and what the controller of a sampled loop begins with by name."""
    size = len(system.states)
    if isinstance(given, Mapping):
        names = [s.name for s in system.states]
        further: list[str] = [] if loop is None else _memory_names(loop)
        _check_state_names(system, given, names, further)
        rows = np.stack([per_run(f"initial '{n}'", given[n], count) for n in names], axis=1) if names else None
        memory = {n: per_run(f"initial '{n}'", v, count) for n, v in given.items() if n not in names}
        return np.zeros((count, 0)) if rows is None else rows, memory
    try:
        rows = np.array(given, dtype=float, order="C", ndmin=2)
        if rows.shape != (count, size):
            rows = np.array(np.broadcast_to(rows, (count, size)), order="C")
    except (TypeError, ValueError):
        wanted = f"({size},)" if count == 1 else f"({count}, {size}) or ({size},)"
        raise SimulationError(
            f"initial state of '{system.name}'",
            f"it has shape {np.shape(given)} instead of {wanted}.",
            f"Give one number for each state: {', '.join(s.name for s in system.states)}.",
        ) from None
    # The sum first: it is cheap, and finite but for a state that is not, or a sum too large.
    if not math.isfinite(rows.sum()) and not np.isfinite(rows).all():
        raise SimulationError(f"initial state of '{system.name}'", "a value is not a finite number.")
    return rows, {}


def _memory_names(loop: Loop) -> list[str]:
    """What of a controller may begin elsewhere than at 0."""
    wiring = loop.wiring
    shown = () if wiring.injected is None else wiring.injected.system.outputs
    return [s.name for s in (*wiring.memory, *shown, *wiring.driven)]


def per_run(what: str, value: Any, count: int) -> np.ndarray:
    """(N,) the numbers of N runs.

    Raises:
        SimulationError: neither a number nor N of them, or not finite.
    """
    try:
        row = np.array(value, dtype=float, ndmin=1)
        if row.shape != (count,):
            row = np.broadcast_to(row, (count,))
    except (TypeError, ValueError):
        raise SimulationError(what, f"{value!r} is neither a number nor {count} of them.") from None
    if not np.isfinite(row).all():
        raise SimulationError(what, "a value is not a finite number.")
    return row


def _driven(
    system: str, signals: Sequence[Signal], given: Mapping[str, Any] | None, times: np.ndarray
) -> dict[str, Input]:
    if not given:
        return {}
    names = [signal.name for signal in signals]
    _check_inputs(system, given, names)
    return {name: as_input(name, given[name], times) for name in names if name in given}


def _check_inputs(system: str, given: Mapping[str, Any], names: Sequence[str]) -> None:
    unknown = [name for name in given if name not in names]
    if unknown:
        raise SimulationError(
            f"inputs of '{system}'",
            f"it has no input {', '.join(unknown)}.",
            f"Its inputs: {', '.join(dict.fromkeys(names)) or 'none'}.",
        )


def _split(
    system: System, loop: Loop | None, given: Mapping[str, Any], runs: int | None, times: np.ndarray
) -> tuple[dict[str, Input], dict[str, np.ndarray]]:
    """(inputs that all runs share or that have samples for each run, constants of each run)."""
    if not given:
        return {}, {}
    names = [s.name for s in (*system.inputs, *(() if loop is None else loop.references))]
    noises = set() if loop is None else {f"{s.name}_noise" for s in loop.wiring.measured}
    unknown = [name for name in given if name not in noises]
    _check_inputs(system.name, dict.fromkeys(unknown), names)
    shared: dict[str, Input] = {}
    own: dict[str, np.ndarray] = {}
    for name, value in given.items():
        constant = isinstance(value, np.ndarray | list | tuple | float | int | Constant)
        if constant and runs is not None and name not in noises:
            own[name] = per_run(f"input '{name}'", value.value if isinstance(value, Constant) else value, runs)
        else:
            shared[name] = as_input(name, value, times)
    return shared, own


def _parameters(
    system: System, loop: Loop | None, given: Mapping[str, Any], count: int
) -> tuple[np.ndarray, dict[str, float]]:
    """(N, p) of the system in its order, and numbers for the controller of a sampled loop."""
    row = default_row(system)
    if row is not None and not given:
        return row.repeat(count, axis=0), {}
    values = default_values(system)
    controller = {} if loop is None else {name for name, _ in loop.wiring.parameters if name not in values}
    unknown = [name for name in given if name not in values and name not in controller]
    if unknown:
        raise SimulationError(
            f"parameter '{unknown[0]}' of '{system.name}'",
            "there is no such parameter.",
            f"Known: {', '.join((*values, *sorted(controller))) or 'none'}.",
        )
    missing = [name for name, value in values.items() if value is None and name not in given]
    if missing:
        raise SimulationError(
            f"simulation of '{system.name}'",
            f"parameters without a value: {', '.join(missing)}.",
            f"Give them: parameters={{'{missing[0]}': ...}}.",
        )
    table = np.empty((count, len(values)))
    for column, (name, value) in enumerate(values.items()):
        table[:, column] = per_run(f"parameter '{name}' of '{system.name}'", given.get(name, value), count)
    found = {}
    for name in controller:
        if name in given:
            if np.ndim(given[name]):
                raise SimulationError(
                    f"parameter '{name}'", "it belongs to the controller, which is the same in all runs.", "Give one."
                )
            found[name] = float(given[name])
    return table, found


def _targets(system: System, given: Mapping[str, Any], count: int) -> np.ndarray:
    if not given:
        return np.zeros((count, len(system.outputs)))
    names = [signal.name for signal in system.outputs]
    unknown = [name for name in given if name not in names]
    if unknown:
        raise SimulationError(
            f"targets of '{system.name}'",
            f"{unknown[0]} is not an output.",
            f"Its outputs: {', '.join(names) or 'none'}.",
        )
    table = np.zeros((count, len(names)))
    for name, value in given.items():
        table[:, names.index(name)] = per_run(f"target of '{name}'", value, count)
    return table


def _seeds(given: Any, count: int) -> np.ndarray:
    if np.ndim(given) == 0:
        if not isinstance(given, int | np.integer) or not (0 <= given < 2**64):
            raise SimulationError(f"seed={given}", "expected a whole number from 0 to 2^64 - 1.")
        return np.arange(given, given + count, dtype=np.uint64)
    seeds = np.asarray(given)
    if seeds.shape != (count,) or seeds.dtype.kind not in "iu" or (seeds.dtype.kind == "i" and (seeds < 0).any()):
        raise SimulationError("seed of many runs", f"expected {count} whole numbers that are not negative.")
    return seeds.astype(np.uint64)
