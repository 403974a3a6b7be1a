"""The load-robust loop as on hardware, for random loads, resistances and set points: does every run come to rest?"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import sympy as sp

from ulna.campaign import CampaignResult, Measures, Random, Uniform, Window, sweep
from ulna.design import Track
from ulna.loop import Loop, Parts, joined
from ulna.plants import Preset
from ulna.sim import FixedSteps, Formula, Held
from ulna.sim.references import Reference, minimum_jerk
from ulna.studies.prosthesis.hardware import hardware_of
from ulna.studies.prosthesis.load_robust_designs import SPREAD, TUNINGS, load_robust_design
from ulna.studies.prosthesis.plant import Bench, bench_of
from ulna.studies.prosthesis.tasks import PERIOD
from ulna.studies.prosthesis.trial import STIFFNESS, plant_steps
from ulna.system import Parameter, Signal, System, connect

VOLTAGE, CURRENT = 60.0, 60.0
"""V and A, limits of the paper's arm, which names none: a choice."""
SECONDS = 6.5
"""s of every run."""
FIRST, SECOND = 0.8, 3.0
"""s when the motion to one side and the one to the other side begin."""
WINDOW = 0.5
"""s before the second motion and before the end over which the arm must rest."""
WIDEST = math.radians(60.0)
"""Largest angle at the end, either side."""
SHAPES = ("shape", "shape_d1", "shape_d2", "shape_d3")
WINDOWS = (
    Window(signal="theta", begin=SECOND - WINDOW, end=SECOND - PERIOD, name="first"),
    Window(signal="theta", begin=SECONDS - WINDOW + PERIOD, end=SECONDS, name="second"),
    Window(signal="theta", begin=SECOND, end=SECONDS, name="back"),
    Window(signal="i", begin=0.0, end=SECONDS),
    Window(signal="u_cut", begin=PERIOD, end=SECONDS),
)

Columns = CampaignResult | Mapping[str, np.ndarray]
"""(N,) of every figure by name."""


def run_load_campaign(
    preset: Preset,
    runs: int,
    *,
    seed: int = 0,
    load: float | None = None,
    current: float | None = None,
    voltage: float | None = None,
    store: str | os.PathLike[str] | None = None,
) -> CampaignResult:
    """The preset's load-robust compensator at 1 kHz behind encoder, noise, one sample of delay, and the drive's limits.

    Every run begins at rest in the horizontal without current, so that the arm falls first. A minimum-jerk motion takes
    it to −`end`, up to 60° either side, another one to `end`; half-way there the load is picked up or dropped, wholly
    or in part. Loads `m2` and `m2_after` (0 … heaviest), armature resistance `Ra` (±20 %) and `end` are drawn evenly.
    Limits are voltage, battery and peak current of the preset; there are no stops.

    Args:
        preset: an arm with a load-robust design.
        runs: how many.
        seed: of the draws and of the encoder's noise.
        load: kg, one that stays, in place of the draws.
        current, voltage: limits in A and V in place of the preset's.
        store: a folder for the results, where a campaign that was interrupted goes on.

    Returns:
        The campaign; `rest_errors`, `missed`, `overshoot` and `peak_current` read it, `mean_u_cut` is the share of
        samples at which the drive could not give what was asked.

    Raises:
        PlantError: for a preset without a tuning.
        OptionalDependencyError: without Numba, the extra [campaign].
    """
    bench = bench_of(preset)
    volts = voltage or (VOLTAGE if math.isinf(bench.voltage) else bench.voltage)
    amperes = current or (CURRENT if math.isinf(bench.current) else bench.current)
    bench = replace(bench, voltage=volts, current=amperes, walls=(-math.inf, math.inf))
    vary = {
        "Ra": Uniform(low=bench.value("Ra") * SPREAD[0], high=bench.value("Ra") * SPREAD[1]),
        "end": Uniform(low=-WIDEST, high=WIDEST),
    }
    if load is None:
        vary |= dict.fromkeys(
            ("m2", "m2_after"), Uniform(low=0.0, high=TUNINGS[preset.name].heaviest * bench.value("m2"))
        )
    loop = Loop(plant=_plant(bench), controller=_controller(preset), hardware=hardware_of(bench))
    return sweep(
        loop,
        Random(vary=vary, runs=runs, seed=seed),
        Measures(targets={"y": "end"}, windows=WINDOWS),
        horizon=SECONDS,
        engine=FixedSteps(number=plant_steps(bench), within=STIFFNESS),
        parameters={} if load is None else {"m2": load, "m2_after": load},
        inputs=_inputs(bench, loop),
        store=store,
    )


def rest_errors(found: Columns) -> np.ndarray:
    """(N, 2) largest |angle − wanted| in the windows after either motion, degrees; infinite of a run that was lost."""
    columns = []
    for name, wanted in (("first", -found["end"]), ("second", found["end"])):
        least, most = (np.abs(found[f"{end}_theta_{name}"] - wanted) for end in ("least", "most"))
        columns.append(np.degrees(np.maximum(least, most)))
    return np.nan_to_num(np.stack(columns, axis=1), nan=math.inf)


def missed(found: Columns, tolerance: float = 0.2) -> np.ndarray:
    """(N,) whether a run does not come to rest within so many degrees, both times."""
    return rest_errors(found).max(axis=1) > tolerance


def peak_current(found: Columns) -> np.ndarray:
    """(N,) largest |current|, A."""
    return np.maximum(-found["least_i"], found["most_i"])


def overshoot(found: Columns) -> np.ndarray:
    """(N,) of the second motion, as a part of its way."""
    end = found["end"]
    return np.maximum(0.0, np.where(end > 0, found["most_theta_back"], found["least_theta_back"]) / end - 1) / 2


def _plant(bench: Bench) -> System:
    """The arm whose load changes from m2 to m2_after when the input `changed` goes from 0 to 1."""
    after = Parameter(name="m2_after", unit="kg", value=bench.preset.value("m2"), text="load after the change")
    changed = Signal(name="changed", text="1: the load has changed")
    taken = {sp.Symbol("load", real=True): (after.symbol - sp.Symbol("m2", real=True)) * changed.symbol}
    return replace(
        bench.plant,
        rates=tuple(rate.xreplace(taken) for rate in bench.plant.inline(bench.plant.rates)),
        inputs=tuple(changed if s.name == "load" else s for s in bench.plant.inputs),
        parameters=(*bench.plant.parameters, after),
    )


def _controller(preset: Preset) -> Parts:
    """The load-robust compensator behind a part that makes its references: −`end` times a motion to 1 and on to −1."""
    design = load_robust_design(preset, reference=Track()).compensator
    law, observer = design.law.system, design.observer.system
    names = [s.name for s in law.inputs if s.name.startswith("y_ref")]
    end, shapes = sp.Symbol("end", real=True), [name.replace("y_ref", "shape") for name in names]
    motion = System(
        name="motion",
        states=(),
        rates=(),
        inputs=tuple(Signal(name=name) for name in ("end", *shapes)),
        outputs=tuple(Signal(name=name) for name in names),
        readouts=tuple(-end * sp.Symbol(shape, real=True) for shape in shapes),
    )
    moved = connect(
        {"motion": motion, "law": law},
        {f"law.{name}": f"motion.{name}" for name in names},
        outputs=["law.u"],
        name="load-robust law with its motions",
    )
    return Parts(system=joined(moved, observer, name="load-robust compensator"), law=moved, observer=observer)


def _motions(bench: Bench) -> tuple[Reference, Reference]:
    """From 0 to 1 rad and on to −1 rad, slow enough for the widest multiple."""
    limits = replace(
        bench.motion,
        speed=bench.motion.speed / WIDEST,
        acceleration=bench.motion.acceleration / WIDEST,
        lower=-1.0,
        upper=1.0,
    )
    out = minimum_jerk(0.0, 1.0, limits=limits, begin=FIRST)
    return out, minimum_jerk(1.0, -1.0, limits=limits, begin=SECOND)


def _inputs(bench: Bench, loop: Loop) -> dict[str, Formula | Held]:
    """The shape of the motions with its derivatives, and when the load changes."""
    out, back = _motions(bench)
    wanted = {s.name for s in loop.references}
    shapes = [out.expression(derivative=k) + back.expression(derivative=k) for k in range(len(SHAPES))]
    shapes[0] = shapes[0] - 1
    return {
        **{name: Formula(expression=each) for name, each in zip(SHAPES, shapes, strict=True) if name in wanted},
        "changed": Held(times=np.array([0.0, SECOND + back.duration / 2]), values=np.array([0.0, 1.0])),
    }
