"""Loops with a processor out of one mapping of settings, for tests that try many of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ulna.loop import Hardware, Loop, Parts, joined
from ulna.sim import FixedSteps, simulate
from ulna.system import LinearInjection, System

OF_RUNS = ("references", "initial", "number", "order", "bound", "device", "seed", "parameters")
"""Settings of a run; `controller` and `estimator` are the loop's, all others the hardware's."""


def loop_of(plant: System, settings: Mapping[str, Any]) -> Loop:
    """The loop of a plant."""
    given = {name: value for name, value in settings.items() if name not in OF_RUNS}
    controller, estimator = given.pop("controller"), given.pop("estimator", None)
    if estimator is not None:
        seen = estimator.system if isinstance(estimator, LinearInjection) else estimator
        whole = joined(controller, seen, name="controller")
        controller = Parts(system=whole, law=controller, observer=estimator)
    return Loop(plant=plant, controller=controller, hardware=Hardware(**given))


def run_loop(
    plant: System,
    initial: Any,
    times: Any,
    settings: Mapping[str, Any],
    *,
    loop: Loop | None = None,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, Any] | None = None,
    start: Mapping[str, Any] | None = None,
    **further: Any,
) -> Any:
    """`simulate` of the loop; `start` is what the controller begins with, by name."""
    begin = {**settings.get("initial", {}), **(start or {})}
    if begin:
        names = [s.name for s in plant.states]
        columns = zip(*initial, strict=True) if hasattr(initial[0], "__len__") else initial
        initial = dict(zip(names, (list(c) if hasattr(c, "__len__") else c for c in columns), strict=True)) | begin
    engine = FixedSteps(**{name: settings[name] for name in ("number", "order", "bound", "device") if name in settings})
    further.setdefault("seed", settings.get("seed", 0))
    return simulate(
        loop or loop_of(plant, settings),
        initial,
        times,
        inputs={**settings.get("references", {}), **(inputs or {})},
        parameters={**settings.get("parameters", {}), **(parameters or {})},
        engine=engine,
        **further,
    )
