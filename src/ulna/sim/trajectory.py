"""`Trajectory`: what a simulation answers with, under the system's names and units."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ulna.base import SimulationError, html_table, whole_file
from ulna.program import Kernel, to_numpy
from ulna.sim.cache import IdentityCache
from ulna.sim.event import Event
from ulna.sim.inputs import Input, input_values
from ulna.sim.mode import Mode, modes_of
from ulna.sim.outcome import Outcome
from ulna.symbolic.compiling import kernel
from ulna.system import Signal, System

_READOUTS = IdentityCache(64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """A signal along a run that is neither state, input nor output of the system: a command, an estimate.

    Attributes:
        signal: its name and unit. role: what it is in the loop. values: (N,) in SI.
    """

    signal: Signal
    role: str
    values: np.ndarray


# No slots: inputs, outputs and labelled forms are computed when first asked for and kept.
@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """States, inputs and outputs of a system along a run, in SI.

    Attributes:
        system: what was simulated.
        parameters: the SI values used, by name.
        drive: what drove each input; inputs left out were 0.
        times: (N,) in s; where the run ended early, the last one is where it ended.
        states: (N, n), one row for each time, one column for each state in the system's order.
        outcome: how it ended.
        further: other series by name; of a sampled loop commands, measured values, estimates, controller states.
        events: what happened during a sampled run, in order of time.
        note: one line about how it was integrated, empty where there is nothing to say.
        steps: of a sampled run, Runge-Kutta steps of the plant in each stretch of constant input; else 0.
        plant: of a continuous closed loop its plant, whose signals x, y and u are; None where the system is the plant.

    `t, y = run` unpacks it, and x, y, u have signals in rows, as in python-control; `states`, `outputs` and `inputs`
    have them in columns and are those of the whole system.

    Examples:
        >>> run = ulna.simulate(ulna.model("duffing"), [1, 0], np.linspace(0, 10, 101))
        >>> t, y = run
        >>> run.x.shape, y.shape
        ((2, 101), (101,))
    """

    system: System
    parameters: Mapping[str, float]
    drive: Mapping[str, Input]
    times: np.ndarray
    states: np.ndarray
    outcome: Outcome
    further: Mapping[str, Series] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    note: str = ""
    steps: int = 0
    plant: System | None = None

    @property
    def t(self) -> np.ndarray:
        """(N,) the times, in s."""
        return self.times

    @property
    def x(self) -> np.ndarray:
        """(n, N) the states of the plant."""
        return self.states[:, : len(self._plant.states)].T

    @property
    def y(self) -> np.ndarray:
        """(p, N) the outputs of the plant; (N,) of a single one."""
        return _squeezed(self.outputs[:, : len(self._plant.outputs)])

    @property
    def u(self) -> np.ndarray:
        """(m, N) the inputs of the plant, in a loop what the controller told it; (N,) of a single one."""
        if self.plant is None:
            return _squeezed(self.inputs)
        # A closed loop shows the outputs of its plant, then the plant's inputs.
        first = len(self._plant.outputs)
        return _squeezed(self.outputs[:, first : first + len(self._plant.inputs)])

    def __iter__(self) -> Iterator[np.ndarray]:
        return iter((self.t, self.y))

    @property
    def _plant(self) -> System:
        return self.system if self.plant is None else self.plant

    @cached_property
    def inputs(self) -> np.ndarray:
        """(N, m) inputs at the times, one column for each."""
        rows = np.zeros((len(self.times), len(self.system.inputs)))
        for column, signal in enumerate(self.system.inputs):
            if signal.name in self.drive:
                rows[:, column] = input_values(self.drive[signal.name], self.times, self.parameters)
        return rows

    @cached_property
    def outputs(self) -> np.ndarray:
        """(N, p) outputs at the times, one column for each."""
        system = self.system
        if not system.outputs:
            return np.zeros((len(self.times), 0))
        evaluate = _READOUTS.get(system, None, lambda: to_numpy(_readouts(system)))
        columns = evaluate(*self.states.T, *self.inputs.T, *(self.parameters[p.name] for p in system.parameters))
        return np.stack(np.broadcast_arrays(self.times, *columns)[1:], axis=1)

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The spans of the run, one after the other, and the surfaces of jumps on which it stays in each of them.

        One span that holds nothing where the motion sticks and slides nowhere.
        """
        return modes_of(self.events, float(self.times[0]), float(self.times[-1]))

    @property
    def final_state(self) -> np.ndarray:
        """(n,) state at the last time."""
        return self.states[-1]

    def __getitem__(self, name: str) -> np.ndarray:
        """(N,) values of the state, output, input or further series of this name."""
        for signal, role, column in self._columns():
            if signal.name == name:
                return getattr(self, f"{role}s")[:, column]
        if name in self.further:
            return self.further[name].values
        raise SimulationError(
            f"'{name}' of the trajectory of '{self.system.name}'",
            "there is no such signal.",
            f"Known: {', '.join(dict.fromkeys((*(s.name for s, _, _ in self._columns()), *self.further)))}.",
        )

    def to_xarray(self) -> Any:
        """An `xarray.Dataset`: one variable for each signal over the coordinate `time`.

        Units, role and description are attributes of each variable; system, outcome and parameters of the whole.
        """
        import xarray as xr

        variables = {
            label: ("time", values, _attributes(signal, role)) for label, signal, role, values in self._labelled()
        }
        coordinates = {"time": ("time", self.times, {"units": "s"})}
        return xr.Dataset(variables, coords=coordinates, attrs=self._attributes())

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame`: one column for each signal, indexed by time in s; `attrs["units"]` by column."""
        import pandas as pd

        labelled = list(self._labelled())
        frame = pd.DataFrame(
            {label: values for label, _, _, values in labelled}, index=pd.Index(self.times, name="time")
        )
        frame.attrs["units"] = {label: signal.unit for label, signal, _, _ in labelled}
        return frame

    def to_netcdf(self, path: str | Path) -> Path:
        """Write the labelled form as netCDF (version 3, readable everywhere); the file appears whole or not at all.

        Raises:
            SimulationError: a place that cannot be written.
        """
        target = Path(path)
        try:
            with whole_file(target) as file:
                file.write(_netcdf(self))
        except OSError as error:
            raise _unwritable(target, error) from error
        return target

    def to_csv(self, path: str | Path) -> Path:
        """Write the labelled form as text: a column for each signal, `theta [rad]` above it; the file appears whole.

        Every number is written so that it is read back as it was.

        Raises:
            SimulationError: a place that cannot be written.
        """
        labelled = self._labelled()
        headings = ["time [s]", *(f"{label} [{s.unit}]" if s.unit else label for label, s, _, _ in labelled)]
        columns = np.column_stack([self.times, *(values for _, _, _, values in labelled)])
        lines = [",".join(headings), *(",".join(map(repr, row)) for row in columns.tolist())]
        target = Path(path)
        try:
            with whole_file(target) as file:
                file.write(("\n".join(lines) + "\n").encode())
        except OSError as error:
            raise _unwritable(target, error) from error
        return target

    def plot(self, *signals: str, title: str = "") -> Any:
        """A figure of the run, a panel for each signal: states, outputs that are none, inputs, or those named.

        Raises:
            SimulationError: an unknown name.
        """
        # By name: drawing lies above simulation, and this is the one step upwards, for whoever types it in a notebook.
        return import_module("ulna.plot").plot_trajectory(self, signals, title=title)

    def _attributes(self) -> dict[str, str | float]:
        """What is true of the whole run."""
        whole: dict[str, str | float] = {
            "system": self.system.name,
            "outcome": self.outcome.name.lower(),
            "outcome_text": self.outcome.text,
        }
        return whole | {f"parameter_{name}": value for name, value in self.parameters.items()}

    def _columns(self) -> list[tuple[Signal, str, int]]:
        parts = (("state", self.system.states), ("output", self.system.outputs), ("input", self.system.inputs))
        return [(signal, role, column) for role, signals in parts for column, signal in enumerate(signals)]

    def _labelled(self) -> list[tuple[str, Signal, str, np.ndarray]]:
        """(label, signal, role, values); an output that is a state under the state's name appears once."""
        arrays = {"state": self.states, "output": self.outputs, "input": self.inputs}
        found: dict[str, tuple[str, Signal, str, np.ndarray]] = {}
        rows = [(signal, role, arrays[role][:, column]) for signal, role, column in self._columns()]
        rows += [(each.signal, each.role, each.values) for each in self.further.values()]
        for signal, role, values in rows:
            label = signal.name
            if label in found:
                if np.array_equal(found[label][3], values, equal_nan=True):
                    continue
                label = f"{role}_{label}"
            found[label] = (label, signal, role, values)
        return list(found.values())

    def _repr_html_(self) -> str:
        """A table for notebooks: where each signal begins and ends, and its range."""
        labelled = self._labelled()
        rows = [
            (f"{label} [{s.unit}]" if s.unit else label, values[0], values[-1], values.min(), values.max())
            for label, s, _, values in labelled
        ]
        headings = ("signal", "at the start", "at the end", "smallest", "largest")
        count = len(self.events)
        events = [f"{count} events, the first at {self.events[0].time:.6g} s: run.events"] if count else []
        return html_table(
            rows, title=repr(self), headings=headings, below=(*events, *([self.note] if self.note else []))
        )

    def __repr__(self) -> str:
        return (
            f"Trajectory of '{self.system.name}': {len(self.times)} times from {self.times[0]:g} s to "
            f"{self.times[-1]:g} s, {self.outcome.text}"
        )


def _squeezed(columns: np.ndarray) -> np.ndarray:
    """Signals in rows, a single one without the axis."""
    return columns[:, 0] if columns.shape[1] == 1 else columns.T


def _attributes(signal: Signal, role: str) -> dict[str, str]:
    return {"units": signal.unit, "long_name": signal.text or signal.name, "role": role}


def _netcdf(run: Trajectory) -> bytes:
    """What `to_xarray` holds, as the bytes of a file; made without xarray and pandas, whose import costs a second."""
    from scipy.io import netcdf_file

    buffer = io.BytesIO()
    with netcdf_file(buffer, "w", version=2) as file:
        file.createDimension("time", len(run.times))
        rows = [("time", run.times, {"units": "s"})]
        rows += [(label, values, _attributes(signal, role)) for label, signal, role, values in run._labelled()]
        for place, (label, values, attributes) in enumerate(rows):
            # SciPy writes and reads Latin letters only.
            plain = label.isascii()
            variable = file.createVariable(label if plain else f"column_{place}", "d", ("time",))
            variable[:] = values
            for name, text in (attributes if plain else attributes | {"name": label}).items():
                setattr(variable, name, text.encode())
        for name, value in run._attributes().items():
            setattr(
                file,
                name.encode("ascii", "backslashreplace").decode(),
                value.encode() if isinstance(value, str) else value,
            )
        file.flush()
        return buffer.getvalue()


def _readouts(system: System) -> Kernel:
    names = {
        signal.name: readout for signal, readout in zip(system.outputs, system.inline(system.readouts), strict=True)
    }
    symbols = [*system.state_symbols, *system.input_symbols, *system.parameter_symbols]
    return kernel(f"outputs of {system.name}", symbols, names)


def _unwritable(path: Path, error: OSError) -> SimulationError:
    return SimulationError(
        f"the file '{path}'", f"it cannot be written ({error.strerror or error}).", "Choose another folder."
    )
