"""The continuous closed loop as one `System`."""

from __future__ import annotations

from dataclasses import replace

from ulna.loop.reading import reading
from ulna.system import System, connect


def closed(plant: System, controller: System, *, states_first: bool) -> System:
    """Plant and controller wired by names.

    Inputs are references and disturbances; outputs those of the plant, its inputs, then what else the controller shows.
    """
    inputs = {s.name for s in plant.inputs}
    driven = [s.name for s in controller.outputs if s.name in inputs]
    found = {s.name: reading(plant, s.name, states_first=states_first) for s in controller.inputs}
    # The plant's own input may be read too: it is what the controller says.
    wires = {f"controller.{name}": f"controller.{name}" for name in driven if name in found and found[name] is None}
    wires |= {f"controller.{name}": f"plant.{each.signal.name}" for name, each in found.items() if each is not None}
    wires |= {f"plant.{name}": f"controller.{name}" for name in driven}
    more = {each.signal.name: each for each in found.values() if each is not None and each.state}
    measured = replace(
        plant,
        outputs=(*plant.outputs, *(each.signal for each in more.values())),
        readouts=(*plant.readouts, *(each.expression for each in more.values())),
    )
    return connect(
        {"plant": measured, "controller": controller},
        wires,
        outputs=[
            *(f"plant.{s.name}" for s in plant.outputs),
            *(f"plant.{s.name}" for s in plant.inputs),
            *(f"controller.{s.name}" for s in controller.outputs if s.name not in inputs),
        ],
        name=f"closed loop of {plant.name}",
        text="plant with its controller",
    )
