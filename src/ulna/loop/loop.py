"""`Loop`: a plant, its controller and the hardware between them, as one value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import sympy as sp

from ulna.base import SimulationError, html_table
from ulna.loop.closed import closed
from ulna.loop.fitted import Fitted, fitted
from ulna.loop.flow import Flow, Steps, flow
from ulna.loop.hardware import Hardware
from ulna.loop.limits import Saturation
from ulna.loop.parts import Parts, parts_of
from ulna.loop.step import Step, step
from ulna.loop.timed import timed
from ulna.loop.wiring import Wiring, wire
from ulna.symbolic.formulas import display_html
from ulna.system import Signal, System


# No slots: wiring, system and kernels are made when first asked for and kept.
@dataclass(frozen=True, kw_only=True, eq=False)
class Loop:
    """All that decides how the plant moves: itself, what controls it, and the hardware that lies between.

    The wiring is by names. Plant inputs that have the name of a controller output are driven by it, the others are
    disturbances. Each input of the controller reads the estimate of this name, else the plant's input, output or state
    of this name; inputs that nothing feeds are references, which whoever runs the loop gives.

    A controller in discrete time runs on a processor at its own period. A plant in discrete time is closed by a static
    law or a controller of its period: without hardware as one `System`, with hardware as the processor of that period.

    Args:
        plant: what is controlled.
        controller: None for the plant alone, with limits of its inputs and end stops; else a `System` whose outputs
            include inputs of the plant, or what has one as its `.system`: a law on measured states, a compensator, a
            controller read from a file. The estimator of a compensator sees the limited, delayed input. An observer by
            itself runs beside the plant, sees its inputs and drives none.
        hardware: processor, sensors, drive, limits; None for the unlimited loop. Its period may be left out where plant
            or controller has one.

    Raises:
        SimulationError: a controller that drives and estimates nothing, periods that differ, options of signals that
            the loop does not have.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> loop = ulna.Loop(plant=ulna.model("duffing"), controller=law, hardware=ulna.Hardware(period=1e-3))
        >>> loop.sampled
        True
    """

    plant: System
    controller: Any = None
    hardware: Hardware | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "hardware", timed(self.plant, self.controller, self.hardware))
        if self.controller is None:
            _ = self.saturation
            if self.sampled:
                raise SimulationError(
                    f"loop of '{self.plant.name}'", "a period is given and no controller.", "Give controller=..."
                )
            return
        _ = self.wiring, self.saturation
        if self.sampled and not [name for name, value in self.wiring.parameters if value is None]:
            _ = self.fit({})

    @property
    def sampled(self) -> bool:
        """Whether the controller runs once a period."""
        return self.hardware is not None and self.hardware.sampled

    @cached_property
    def wiring(self) -> Wiring:
        """Who reads whom.

        Raises:
            SimulationError: without a controller, or with one that drives and estimates nothing.
        """
        return wire(self.plant, self.controller)

    @property
    def parts(self) -> Parts | None:
        """The controller as systems, without what it was made from; None without a controller."""
        return None if self.controller is None else parts_of(self.controller)

    @property
    def references(self) -> tuple[Signal, ...]:
        """Inputs of the controller that nothing in the loop feeds."""
        return () if self.controller is None else self.wiring.references

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the references that have to be given: inputs of the plant that an observer sees are 0 by default."""
        own = {s.name for s in self.plant.inputs}
        return tuple(s.name for s in self.references if s.name not in own)

    @property
    def initial(self) -> Mapping[str, float]:
        """Where states of the controller start, in SI, that do not start at 0 unless told so: a filter's covariance."""
        return {} if self.parts is None else self.parts.initial

    @property
    def disturbances(self) -> tuple[Signal, ...]:
        """Inputs of the plant that the controller does not drive."""
        return self.plant.inputs if self.controller is None else self.wiring.disturbances

    @property
    def saturation(self) -> Mapping[str, Saturation]:
        """The limits of driven inputs, of a plant alone those of its inputs, by name."""
        given = None if self.hardware is None else self.hardware.saturation
        signals = self.plant.inputs if self.controller is None else self.wiring.driven
        names = [s.name for s in signals]
        if given is not None and not names:
            raise SimulationError(
                f"saturation of '{self.plant.name}'", "it has no inputs.", "Leave Hardware(saturation=...) out."
            )
        if given is None or isinstance(given, Saturation):
            return {} if given is None else dict.fromkeys(names, given)
        unknown = [name for name in given if name not in names]
        if unknown:
            raise SimulationError(
                "Hardware(saturation=...)",
                f"the loop has no signal {', '.join(unknown)} there.",
                f"Known: {', '.join(names) or 'none'}.",
            )
        return given

    @property
    def system(self) -> System:
        """The continuous loop without limits: states those of the plant, then of the controller.

        Its inputs are references and disturbances, its outputs those of the plant, the plant's driven inputs, then
        what else the controller shows (estimates).

        Raises:
            SimulationError: for a loop with a processor, which is no system of differential equations.
        """
        if self.sampled:
            raise SimulationError(
                f"the loop of '{self.plant.name}' as a system",
                "its controller runs once a period.",
                "Leave out the hardware, Loop(plant=..., controller=...).system, or read loop.step and loop.flow.",
            )
        return self.plant if self.controller is None else self._closed

    @cached_property
    def _closed(self) -> System:
        parts = parts_of(self.controller)
        return closed(self.plant, parts.system, states_first=parts.states_first)

    @cached_property
    def step(self) -> Step:
        """What the processor does once a period.

        Raises:
            SimulationError: for a continuous controller, or a parameter of the controller without a value.
        """
        return step(self.fit({}))

    @cached_property
    def flow(self) -> Flow:
        """How the plant moves between samples, in one Runge-Kutta step for each stretch of constant input.

        Raises:
            SimulationError: for a continuous controller.
        """
        return self.flow_by(Steps())

    def flow_by(self, steps: Steps, formulas: Mapping[str, sp.Expr] | None = None, *, ramps: bool = True) -> Flow:
        """The flow by other steps, with disturbances that are formulas of time; see `ulna.loop.flow.flow`."""
        return flow(self.fit({}), steps, formulas or {}, ramps=ramps)

    def fit(self, parameters: Mapping[str, float]) -> Fitted:
        """The hardware fitted to the wiring, with SI values for parameters of the controller by name."""
        if not parameters:
            return self._fitted
        return fitted(self.wiring, self._hardware, parameters)

    @cached_property
    def _fitted(self) -> Fitted:
        return fitted(self.wiring, self._hardware, {})

    @property
    def _hardware(self) -> Hardware:
        return self.hardware or Hardware()

    def __repr__(self) -> str:
        if not self.sampled and self.hardware is None:
            return repr(self.system)
        named = "nothing" if self.controller is None else f"'{self.wiring.name}'"
        parts = f"Loop of '{self.plant.name}' and {named}"
        return parts if self.hardware is None else f"{parts}, period {self.hardware.period} s"

    def _repr_latex_(self) -> str:
        """The equations of the whole loop; with a processor those of the plant, then those of its controller."""
        if not self.sampled:
            return self.system._repr_latex_()
        return self.plant._repr_latex_() + parts_of(self.controller).system._repr_latex_()

    def _repr_html_(self) -> str:
        """A table for notebooks: who is in the loop and what lies between, then the equations."""
        rows: list[tuple[str, object]] = [("plant", self.plant.name)]
        if self.controller is not None:
            rows.append(("controller", self.wiring.name))
            rows.append(("drives", ", ".join(s.label for s in self.wiring.driven)))
        for name, signals in (("references", self.references), ("disturbances", self.disturbances)):
            rows += [(name, ", ".join(s.label for s in signals))] if signals else []
        rows += [(name.replace("_", " "), value) for name, value in self.told_hardware()]
        equations = display_html(self._repr_latex_())
        return f"""{html_table(rows, title=f"Loop of '{self.plant.name}'")}{equations}"""

    def told_hardware(self) -> list[tuple[str, object]]:
        """What the hardware has beyond its defaults."""
        plain = Hardware()
        given = [(each.name, getattr(self._hardware, each.name)) for each in fields(Hardware)]
        told = [(name, value) for name, value in given if value != getattr(plain, name)]
        return [(name, f"{value:g} s" if isinstance(value, float) else value) for name, value in told]
