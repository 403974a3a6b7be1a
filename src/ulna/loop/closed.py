"""The continuous closed loop as one `System`."""

from __future__ import annotations

from dataclasses import replace

from ulna.system import System, connect


def closed(plant: System, controller: System) -> System:
    """Plant and controller wired by names.

    Inputs are references and disturbances; outputs those of the plant, its driven inputs, then what else the controller
    shows.
    """
    read = {s.name for s in controller.inputs}
    own = {s.name for s in plant.outputs}
    extra = [s for s in plant.states if s.name in read and s.name not in own]
    measured = replace(
        plant,
        outputs=(*plant.outputs, *extra),
        readouts=(*plant.readouts, *(s.symbol for s in extra)),
    )
    inputs = {s.name for s in plant.inputs}
    driven = [s.name for s in controller.outputs if s.name in inputs]
    wires = {f"plant.{name}": f"controller.{name}" for name in driven}
    wires |= {f"controller.{s.name}": f"plant.{s.name}" for s in measured.outputs if s.name in read}
    wires |= {f"controller.{name}": f"controller.{name}" for name in driven if name in read}
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
