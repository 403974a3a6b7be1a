"""`studio`: a page on which loops are driven by hand."""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
import webbrowser
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ulna.base import SimulationError, UlnaWarning, whole_file
from ulna.certify import Certificate, SampledCertificate
from ulna.loop import Loop
from ulna.page.document import page_text
from ulna.page.facts import parameter_values
from ulna.page.payload import (
    begin,
    picture_data,
    plane_axes,
    poles_of,
    pushed_states,
    rests_of,
    shown_states,
    velocities,
)
from ulna.page.region import region_of
from ulna.page.replay import plant_of, replay_payload
from ulna.page.script import loop_script
from ulna.page.source import SetPointSource
from ulna.plants import PlantLike, as_plant
from ulna.sim import Trajectory
from ulna.system import System

MOST_LOOPS = 12
"""Side by side."""


def studio(
    *loops: Loop | PlantLike | Trajectory,
    out: str | os.PathLike[str] | None = None,
    names: Sequence[str] = (),
    initial: Any = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    certificate: Certificate | SampledCertificate | None = None,
    paused: bool = False,
    check: float = 2.0,
    source: SetPointSource | None = None,
) -> Path:
    """The path of a page on which loops move and can be driven by hand: one HTML file that needs nothing else.

    Plant, controller and hardware run in the browser, from the same kernels as `simulate` and firmware. Several loops
    of the same plant stand side by side. `docs/studio.md` shows what a hand can do.

    Args:
        loops: a `Loop`, or a plant alone, its name or its file: it moves without a controller. One `Trajectory` alone
            is replayed: it can be paused, slowed down and searched, not changed.
        out: the file to write; left out, a file among the temporary ones, which is opened in the browser.
        names: a title for each loop; left out, the names of their controllers.
        initial: states in SI where the page begins, by name or in order; a list of these gives each loop its own. Left
            out, beside the operating point.
        parameters: SI values of the plant's parameters, where other than its own; needed of those without a value.
        inputs: SI numbers of references and disturbances at the beginning.
        certificate: its region is drawn in the phase plane.
        paused: whether the page stands still until it is started.
        check: s of a run that is recorded here and compared, bit for bit, when the page opens; 0 for none.
        source: what a hand holds to move the set points, in discrete time, of loops with a processor.

    Raises:
        SimulationError: no loop or more than 12, loops of different plants, names that are not as many, a recorded run
            beside others or with inputs of its own, a file that cannot be written.
        PlantError: parameters without a value.

    Warns:
        UlnaWarning: if there is no browser to open the page in, with the place of the file.

    Examples:
        >>> law = ulna.state_feedback("duffing", [-1, -2])
        >>> ulna.studio(ulna.close_loop("duffing", law), out="duffing.html").name
        'duffing.html'
    """
    made = studio_text(
        *loops, names=names, initial=initial, parameters=parameters, inputs=inputs, certificate=certificate,
        paused=paused, check=check, source=source,
    )  # fmt: skip
    if out is not None:
        return written(Path(out), made)
    handle, name = tempfile.mkstemp(prefix="ulna-", suffix=".html")
    os.close(handle)
    path = written(Path(name), made)
    if not _opened(path):
        warnings.warn(f"there is no browser to open here: the page is the file {path}.", UlnaWarning, stacklevel=2)
    return path


def studio_text(
    *loops: Loop | PlantLike | Trajectory,
    names: Sequence[str] = (),
    initial: Any = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    certificate: Certificate | SampledCertificate | None = None,
    paused: bool = False,
    check: float = 2.0,
    poles: bool = True,
    source: SetPointSource | None = None,
) -> str:
    """The page of `studio` as text.

    `poles`: whether those at rest are sought, which may take a second a loop.
    """
    if any(isinstance(each, Trajectory) for each in loops):
        fixed = {"initial": initial, "parameters": parameters, "inputs": inputs}
        return _replay_text(loops, names, fixed, certificate=certificate, paused=paused)
    bodies = [
        each if isinstance(each, Loop) else Loop(plant=as_plant(each))
        for each in loops
        if not isinstance(each, Trajectory)
    ]
    plant = _one_plant(bodies)
    titles = list(names) or _titles(bodies)
    if len(titles) != len(bodies):
        raise SimulationError(
            "studio(names=...)", f"{len(titles)} names for {len(bodies)} loops.", "Give one for each."
        )
    values = parameter_values(plant, parameters)
    numbered = plant.with_parameters(values).with_values()
    pushes = pushed_states(plant)
    closed = any(body.controller is not None for body in bodies)
    begun = begin(numbered, closed=closed)
    starts = [begun | named_states(plant, each) for each in _starts(initial, len(bodies))]
    scripts = [
        loop_script(
            body if body.controller is not None or body.hardware is not None else body.plant,
            initial=start_of(body, start, settled=initial is None), parameters=parameters,
            inputs=_own(body, inputs, pushes), pushes=pushes, check=check,
            source=source,
        )
        for body, start in zip(bodies, starts, strict=True)
    ]  # fmt: skip
    known = {id(body.controller): body for body in bodies}
    of_each = {key: poles_of(body, values) if poles else [] for key, body in known.items()}
    first = of_each[id(bodies[0].controller)]
    rests, missing = rests_of(numbered, first, closed=closed) if poles or not closed else ([], "")
    region = None if certificate is None else region_of(certificate, plant)
    rows = zip(titles, bodies, (of_each[id(body.controller)] for body in bodies), scripts, strict=True)
    payload = {
        "title": plant.name,
        "text": plant.text,
        "hash": scripts[0].facts["hash"] if len(bodies) == 1 else "",
        "loops": [
            {"title": t, "closed": b.controller is not None, "poles": p, "facts": s.facts} for t, b, p, s in rows
        ],
        "picture": picture_data(plant),
        "velocities": velocities(plant),
        "shows": shown_states(plant),
        "plane": plane_axes(plant),
        "equilibria": rests,
        "region": region,
        "paused": paused,
    }
    notes = [] if closed else ["There is no controller: the plant moves by itself, and you can push it."]
    notes += [missing] if missing and closed else []
    hint, legend = _hint(payload, closed=closed), _legend(titles, scripts[0].facts)
    return page_text(payload, [each.script for each in scripts], notes=notes, hint=hint, legend=legend)


def _replay_text(
    runs: Sequence[Any],
    names: Sequence[str],
    fixed: Mapping[str, Any],
    *,
    certificate: Certificate | SampledCertificate | None,
    paused: bool,
) -> str:
    """The page of one recorded run."""
    if len(runs) != 1 or len(names) > 1:
        found = f"a recorded run among {len(runs)}, {len(names)} names."
        raise SimulationError("studio(...)", found, "A recorded run has a page of its own: give one, and one name.")
    given = [name for name, value in fixed.items() if value]
    if given:
        found = "a recorded run has its own."
        raise SimulationError(f"studio({given[0]}=...)", found, "Leave it out, or give the loop to run it again.")
    run = runs[0]
    region = None if certificate is None else region_of(certificate, plant_of(run))
    payload = replay_payload(run, title=names[0] if names else "run", region=region, paused=paused)
    facts = payload["loops"][0]["facts"]
    lasted = run.times[-1] - run.times[0]
    note = f"A recorded run of {lasted:.4g} s: it can be paused, slowed down and searched, not changed."
    return page_text(payload, [], notes=[note], hint="", legend=_legend([""], facts))


def _one_plant(bodies: Sequence[Loop]) -> System:
    if not 1 <= len(bodies) <= MOST_LOOPS:
        found = f"{len(bodies)} loops."
        raise SimulationError("studio(...)", found, f"Give one to {MOST_LOOPS} loops.")
    plant = bodies[0].plant
    for body in bodies[1:]:
        if [s.name for s in body.plant.states] != [s.name for s in plant.states]:
            found = f"'{plant.name}' and '{body.plant.name}' have different states."
            raise SimulationError("studio(...)", found, "Loops shown side by side must have the same plant.")
    return plant


def _titles(bodies: Sequence[Loop]) -> list[str]:
    """What each controller is called, numbered where two are called alike."""
    found = [_title(body) for body in bodies]
    return [f"{title} {k + 1}" if found.count(title) > 1 else title for k, title in enumerate(found)]


def _title(body: Loop) -> str:
    if body.controller is None or body.parts is None:
        return "no controller"
    return body.parts.system.name.removesuffix(f" of {body.plant.name}") or "controller"


def _own(body: Loop, inputs: Mapping[str, float] | None, pushes: Sequence[str]) -> dict[str, float]:
    """The inputs that this loop has, of those that are given."""
    known = {s.name for s in (*body.references, *body.disturbances)} | {f"push_{name}" for name in pushes}
    given = dict(inputs or {})
    return {name: value for name, value in given.items() if name in known}


def _starts(given: Any, count: int) -> list[Any]:
    """The start of each loop: its own of a list of starts, else the one for all.

    Raises:
        SimulationError: a list of another length.
    """
    if (
        isinstance(given, Mapping)
        or given is None
        or not all(isinstance(e, Mapping | Sequence | np.ndarray) for e in given)
    ):
        return [given] * count
    if len(given) != count:
        raise SimulationError("studio(initial=...)", f"{len(given)} starts for {count} loops.", "Give one for each.")
    return list(given)


def named_states(plant: System, given: Any) -> dict[str, float]:
    """A start by name: a mapping as it is, a row in the order of the plant's states.

    Raises:
        SimulationError: a row of another length.
    """
    if given is None or isinstance(given, Mapping):
        return {name: float(value) for name, value in (given or {}).items()}
    row, names = [float(value) for value in given], [s.name for s in plant.states]
    if len(row) != len(names):
        hint = f"Give one number for each state: {', '.join(names)}."
        raise SimulationError(f"initial state of '{plant.name}'", f"it has {len(row)} numbers.", hint)
    return dict(zip(names, row, strict=True))


def start_of(body: Loop, start: Mapping[str, float], *, settled: bool) -> dict[str, float]:
    """The start with the estimates of this loop's controller; of what is given, what this loop has.

    `settled`: the estimates begin where the states do, as after a while of rest; else where `simulate` begins them.
    """
    parts = body.parts
    own = set() if parts is None else {s.name for s in (*parts.system.states, *parts.system.outputs)}
    given = {name: value for name, value in getattr(body.controller, "initial", {}).items() if name in own}
    if settled:
        given |= {f"{name}_hat": value for name, value in start.items() if f"{name}_hat" in given}
    names = {s.name for s in body.plant.states}
    foreign = {name for name in start if name not in names}
    return given | {name: value for name, value in start.items() if name not in foreign or name in own or parts is None}


def _hint(payload: Mapping[str, Any], *, closed: bool) -> str:
    references = [each for loop in payload["loops"] for each in loop["facts"]["references"]]
    held = "Drag the plant to push it" if payload["loops"][0]["facts"]["disturbances"] else "Watch the plant move"
    if closed and references:
        return f"{held}; drag the round or three-cornered mark, or use the arrow keys, to move the set point."
    return f"{held}."


def _legend(titles: Sequence[str], facts: Mapping[str, Any]) -> str:
    lines = [
        "Dotted: set point." if facts["references"] else "",
        "Dashed: estimate." if _estimates_drawn(facts) else "",
    ]
    lines.append("Red dashes: limits." if facts["limits"] else "")
    lines.append("One colour for each controller." if len(titles) > 1 else "")
    return " ".join(each for each in lines if each)


def _estimates_drawn(facts: Mapping[str, Any]) -> bool:
    """Whether an observer estimates something that has a curve; a law alone shows other quantities."""
    curves = {each["name"] for role in ("states", "outputs", "commands") for each in facts[role]}
    return any(
        each["name"].removesuffix("_hat") in curves for each in facts["estimates"] if each["name"].endswith("_hat")
    )


def written(path: Path, text: str) -> Path:
    """The file, written whole or not at all.

    Raises:
        SimulationError: it cannot be written.
    """
    try:
        with whole_file(path) as file:
            file.write(text.encode())
    except OSError as error:
        found = f"it cannot be written ({error.strerror or error})."
        raise SimulationError(f"the page '{path}'", found, "Give another place with out= (--out).") from None
    return path


def _opened(path: Path) -> bool:
    """Whether a browser with a window took the page."""
    windows = sys.platform in ("win32", "darwin") or any(os.environ.get(n) for n in ("DISPLAY", "WAYLAND_DISPLAY"))
    if not windows:
        return False
    try:
        return webbrowser.open(path.absolute().as_uri())
    except (webbrowser.Error, OSError):
        return False
