"""Records beside a plant: which columns drive it, which it is compared with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from ulna.base import UnitError, dimension_text, unit
from ulna.identification.errors import IdentificationError
from ulna.identification.records.record import Record, missing_column
from ulna.sim import Constant, Held, Input, Interpolated, as_input
from ulna.system import Signal, System


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """A record with what it is to the plant.

    Attributes:
        inputs: what drives the plant, by name. measured: (N, p) beside the outputs of the plant; NaN where lost.
    """

    record: Record
    inputs: Mapping[str, Input]
    measured: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """(N,) s."""
        return self.record.times

    @property
    def still(self) -> tuple[str, ...]:
        """Names of inputs that never move."""
        moving = {n for n, i in self.inputs.items() if isinstance(i, Held | Interpolated) and np.ptp(i.values) > 0}
        return tuple(name for name in self.inputs if name not in moving)


def measured_system(system: System, records: Sequence[Record], outputs: Sequence[str] | None) -> System:
    """The plant with the measured outputs alone, states among them where they are measured themselves.

    Raises:
        IdentificationError: none is in the records, or a name that the plant does not have.
    """
    signals = {s.name: (s, s.symbol) for s in system.states}
    signals |= {s.name: (s, e) for s, e in zip(system.outputs, system.readouts, strict=True)}
    if outputs is None:
        shared = set.intersection(*(set(record.columns) for record in records))
        chosen = [s.name for s in system.outputs if s.name in shared and s.measured]
        if not chosen:
            _refuse_misspelt(system, records[0])
        chosen = chosen or [s.name for s in system.states if s.name in shared]
        if not chosen:
            wanted = [s.name for s in system.outputs] or [s.name for s in system.states]
            raise missing_column(records[0].name, wanted[0], list(records[0].columns))
    else:
        chosen = list(outputs)
        for name in chosen:
            if name not in signals:
                known = f"Known: {', '.join(signals)}."
                raise IdentificationError(f"output '{name}'", f"'{system.name}' has none of this name.", known)
    picked = [signals[name] for name in chosen]
    return replace(system, outputs=tuple(s for s, _ in picked), readouts=tuple(e for _, e in picked))


def _refuse_misspelt(system: System, record: Record) -> None:
    """A column that is nearly called like an output is no reason to look at the states in its place."""
    known = {s.name for s in (*system.states, *system.inputs, *system.outputs)}
    strange = [title.lower() for title in record.columns if title not in known]
    for signal in system.outputs:
        if signal.measured and get_close_matches(signal.name.lower(), strange, n=1, cutoff=0.7):
            raise missing_column(record.name, signal.name, list(record.columns))


def experiments(system: System, records: Sequence[Record], constant: Mapping[str, Any]) -> tuple[Experiment, ...]:
    """Each record with its inputs and outputs.

    Args:
        system: the plant with the measured outputs. constant: values of inputs that were not recorded.

    Raises:
        IdentificationError: a missing column, samples of an input that were lost, an output without samples.
        UnitError: a column in a unit that does not measure the signal.
    """
    for name in constant:
        if name not in [s.name for s in system.inputs]:
            found = f"'{system.name}' has no such input."
            raise IdentificationError(f"input '{name}'", found, f"Known: {', '.join(s.name for s in system.inputs)}.")
    return tuple(_experiment(system, record, constant) for record in records)


def _experiment(system: System, record: Record, constant: Mapping[str, Any]) -> Experiment:
    inputs: dict[str, Input] = {}
    for signal in system.inputs:
        if signal.name in constant:
            inputs[signal.name] = as_input(signal.name, constant[signal.name], record.times)
            continue
        values = _column(record, signal, f'Or say what it was: inputs={{"{signal.name}": 0}}.')
        if not np.isfinite(values).all():
            found = f"samples of the input '{signal.name}' were lost: what acted on the plant is unknown."
            raise IdentificationError(f"the record '{record.name}'", found, "Cut the record there.")
        inputs[signal.name] = _acting(record, values)
    measured = np.stack([_column(record, signal, "") for signal in system.outputs], axis=1)
    for signal, values in zip(system.outputs, measured.T, strict=True):
        if not np.isfinite(values).any():
            found = f"column '{signal.name}' holds no number at all."
            raise IdentificationError(f"the record '{record.name}'", found, "Leave it out of outputs=[…].")
    return Experiment(record=record, inputs=inputs, measured=measured)


def _acting(record: Record, values: np.ndarray) -> Input:
    """The input as it acts, from the first time to the last."""
    times = record.times + record.delay
    if record.delay > 0.0:
        times, values = np.append(record.times[0], times), np.append(values[0], values)
    elif record.delay < 0.0:
        times, values = np.append(times, record.times[-1]), np.append(values, values[-1])
    if np.ptp(values) == 0.0:
        return Constant(value=float(values[0]))
    return (Interpolated if record.joined else Held)(times=times, values=values)


def _column(record: Record, signal: Signal, hint: str) -> np.ndarray:
    if signal.name not in record.columns:
        raise missing_column(record.name, signal.name, list(record.columns), hint)
    written = record.units.get(signal.name, "")
    if written and signal.unit:
        due, found = unit(signal.unit).dimension, unit(written).dimension
        if due != found:
            raise UnitError(
                f"column '{signal.name}' of the record '{record.name}'",
                f"'{written}' measures {_measure(found)}, but the plant's '{signal.name}' is in {signal.unit}.",
                f'Say what it is in: units={{"{signal.name}": "{signal.unit}"}}, or name another column.',
            )
    return record.columns[signal.name]


def _measure(dimension: Any) -> str:
    text = dimension_text(dimension)
    return "a pure number or an angle" if text == "1" else text
