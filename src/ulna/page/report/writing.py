"""`report_page`: everything that is known of a plant and its loop, on one page."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ulna.base import SimulationError, Verdict
from ulna.design import Analysis, analyse
from ulna.loop import Loop
from ulna.page.facts import parameter_values
from ulna.page.inside import live_blocks
from ulna.page.payload import begin
from ulna.page.report.controller import controller_section
from ulna.page.report.formulas import cut
from ulna.page.report.plant import badge, plant_section, short_section, verdicts_section
from ulna.page.report.runs import ran, run_section
from ulna.page.start import point_of, reference_at_start
from ulna.page.writing import named_states, start_of, written
from ulna.plants import PlantLike, as_plant
from ulna.report import Document, Section, Table, Text, Tone, render_page, value_text, verbatim
from ulna.report.run_figures import figure_lines


def report_page(loop: Loop | PlantLike, *, out: str | os.PathLike[str], **options: Any) -> Path:
    """The path of a report on a plant and its loop: one HTML file that needs nothing else.

    Equations, parameters, the answers of `analyse` with their evidence in words, forms, law, observer, poles, a run
    with its figures, the same run without the hardware, a proof where one is given, and the page of `studio` inside.

    Args:
        loop: a `Loop`, or a plant alone, its name or its file.
        out: the file to write.
        options: what `report_text` takes: initial, inputs, parameters, horizon, engine, seed, analysis, proof.

    Raises:
        SimulationError: a folder that does not exist, a file that cannot be written; nothing is left of it then.
        UlnaError: an analysis or a run that is refused.

    Examples:
        >>> ulna.report_page("mass_spring_damper", out="spring.html").name  # doctest: +SKIP
        'spring.html'
    """
    path = Path(out)
    require_folder(path)
    return written(path, report_text(loop, **options))


def require_folder(path: Path) -> None:
    """Refuse a place whose folder does not exist, before anything is computed.

    Raises:
        SimulationError: naming it.
    """
    if not path.absolute().parent.is_dir():
        raise SimulationError(f"the page '{path}'", "its folder does not exist.", "Create it first.")


def report_text(
    loop: Loop | PlantLike,
    *,
    initial: Any = None,
    inputs: Mapping[str, Any] | None = None,
    parameters: Mapping[str, float] | None = None,
    horizon: float = 5.0,
    engine: Any = None,
    seed: int = 0,
    analysis: Analysis | None = None,
    proof: Verdict | None = None,
) -> str:
    """The page of `report_page` as text.

    Args:
        loop: as for `report_page`.
        initial: states in SI where the run begins, by name or in order; left out, beside the operating point.
        inputs: what drives references and disturbances, numbers or formulas of `ulna.TIME`, SI; left out, references
            stay where the plant rests and disturbances at zero.
        parameters: SI values of the plant's parameters, where other than its own.
        horizon: s of the run. engine: of a continuous loop, as `simulate` takes it. seed: of everything random.
        analysis: what `analyse` said of the plant; left out, it is asked.
        proof: what `prove` said of the loop; its certificate's region is drawn in the live page.

    Raises:
        UlnaError: an analysis or a run that is refused.
    """
    body = loop if isinstance(loop, Loop) else Loop(plant=as_plant(loop))
    plant, given = body.plant, dict(parameters or {})
    answers = analyse(plant) if analysis is None else analysis
    missing = [p.name for p in plant.parameters if p.value is None and p.name not in given]
    sentences, moving = [], []
    values = {} if missing else parameter_values(plant, given)
    if missing:
        names = ", ".join(missing)
        moving = [Section(anchor="run", title="A run", blocks=(Text(text=_no_run(names)),))]
        sentences.append(f"It cannot run here: parameters without a value: {names}.")
    else:
        start = _start(body, values, initial)
        drive = _drive(body, values, inputs or {})
        found = ran(body, initial=start, inputs=drive, parameters=given, horizon=horizon, engine=engine, seed=seed)
        units = {s.name: s.unit for s in (*plant.states, *plant.inputs, *plant.outputs)}
        for label, figures in found.figures.items():
            lines = () if figures is None else figure_lines(figures, units)
            sentences += [f"{label.capitalize()}: {line}." for line in lines]
        moving = [run_section(body, found), _live(body, initial, drive, given, proof)]
    proved = [] if proof is None else [_proof_section(proof)]
    controlled = [] if body.controller is None else [controller_section(body, values)]
    document = Document(
        title=plant.name,
        lead=verbatim(plant.text) or "A report on the plant, its controller and their motion.",
        facts=(
            (str(len(plant.states)), "states", Tone.PLAIN),
            (str(len(plant.inputs)), "inputs", Tone.PLAIN),
            (str(sum(a.verdict.holds for a in answers.answers.values())), "questions answered yes", Tone.PLAIN),
        ),
        sections=(
            short_section(answers, sentences), plant_section(plant), verdicts_section(answers), *controlled,
            *moving[:1], *proved, *moving[1:],
        ),
    )  # fmt: skip
    return render_page(document)


def _no_run(names: str) -> str:
    return f"There is no run: parameters without a value: {names}. Give them to see a run."


def _start(body: Loop, values: Mapping[str, float], initial: Any) -> dict[str, float]:
    numbered = body.plant.with_parameters(values).with_values()
    named = named_states(body.plant, initial)
    begun = begin(numbered, closed=body.controller is not None) if initial is None else point_of(numbered)
    states = {s.name: begun.get(s.name, 0.0) for s in body.plant.states}
    return start_of(body, states | named, settled=False)


def _drive(body: Loop, values: Mapping[str, float], given: Mapping[str, Any]) -> dict[str, Any]:
    """What is given, and of the rest: references where the plant rests, disturbances at zero."""
    point = point_of(body.plant.with_parameters(values).with_values())
    references = {name: reference_at_start(name, {}, point) for name in body.required}
    held = {s.name: 0.0 for s in body.disturbances}
    return held | references | {name: float(v) if isinstance(v, int) else v for name, v in given.items()}


def _live(
    body: Loop, initial: Any, drive: Mapping[str, Any], parameters: Mapping[str, float], proof: Verdict | None
) -> Section:
    numbers = {name: float(v) for name, v in drive.items() if isinstance(v, int | float) and math.isfinite(v)}
    certificate = None if proof is None else proof.evidence.get("certificate")
    own = {s.name for s in body.plant.states}
    start = {name: v for name, v in named_states(body.plant, initial).items() if name in own}
    blocks = live_blocks(
        body, title="The loop, to be driven by hand", initial=start or None, parameters=parameters, inputs=numbers,
        certificate=certificate,
    )  # fmt: skip
    return Section(anchor="live", title="Drive it by hand", blocks=blocks)


def _proof_section(proof: Verdict) -> Section:
    rows = tuple(
        (name.replace("_", " "), cut(value_text(str(v) if isinstance(v, complex) else v)))
        for name, v in proof.evidence.items()
        if name != "certificate"
    )
    verdict = Table(head=("claim", "verdict"), rows=((verbatim(proof.claim), badge(proof)),))
    return Section(
        anchor="proof",
        title="Proof",
        blocks=(
            Text(text="About the continuous loop within its limits, by exact and ball arithmetic."),
            verdict,
            Table(head=("evidence", ""), rows=rows),
        ),
    )
