"""`fit_page`: parameters from records on one page: how surely, what is left over, and figures."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ulna.identification import Estimate, Experiment, Fit
from ulna.page.report.writing import require_folder
from ulna.page.writing import written
from ulna.plot import Curve, Panel, plot_panels, svg_text
from ulna.report import Badge, Block, Document, Picture, Section, Table, Text, Tone, render_page, verbatim

DRAWN = 1000
"""Samples at most of a curve."""


def fit_page(fit: Fit, *, out: str | os.PathLike[str]) -> Path:
    """The path of a page on a fit: one HTML file that needs nothing else.

    Estimates with intervals and why others are not known, correlations, tests of the residuals, records held out, and
    of each record the measured outputs beside the model's, with what is left over.

    Raises:
        SimulationError: a folder that does not exist, a file that cannot be written.

    Examples:
        >>> ulna.fit_page(ulna.identify("plant.toml", "log.csv", free=["m2"]), out="fit.html")  # doctest: +SKIP
    """
    path = Path(out)
    require_folder(path)
    return written(path, render_page(_document(fit)))


def _document(fit: Fit) -> Document:
    known = len(fit.estimates) - len(fit.unknown)
    whole = Tone.GOOD if not fit.unknown else Tone.BAD
    facts = (
        (f"{known} of {len(fit.estimates)}", "parameters known", whole),
        (str(sum(len(each.times) for each in fit.experiments)), "samples", Tone.PLAIN),
        ("yes" if fit.adequate else "no", "noise explains the rest", Tone.GOOD if fit.adequate else Tone.BAD),
        ("yes" if fit.converged else "no", "converged", Tone.GOOD if fit.converged else Tone.BAD),
    )
    sections = (
        Section(anchor="parameters", title="Parameters", blocks=tuple(_parameters(fit))),
        Section(anchor="residuals", title="What is left over", blocks=tuple(_residuals(fit))),
        Section(anchor="records", title="Records", blocks=tuple(_records(fit))),
    )
    return Document(title=f"Parameters of {fit.system.name}", lead=fit.source, facts=facts, sections=sections)


def _parameters(fit: Fit) -> Iterator[Block]:
    yield Table(
        head=("parameter", "estimate", "standard error", "95 % interval", "unit", "verdict"),
        rows=tuple(_row(each) for each in fit.estimates),
        numeric=frozenset({1, 2, 3}),
    )
    for each in fit.estimates:
        if each.reason:
            yield Text(text=verbatim(f"{each.name}: {each.reason}."))
    named = [each.name for each in fit.estimates if each.known]
    if len(named) > 1:
        rows = tuple(
            (verbatim(a), *(f"{fit.correlation[fit.names.index(a), fit.names.index(b)]:.3f}" for b in named))
            for a in named
        )
        numeric = frozenset(range(1, len(named) + 1))
        yield Table(head=("", *map(verbatim, named)), rows=rows, caption="Correlation", numeric=numeric)
    for note in fit.notes:
        yield Text(text=verbatim(note), quiet=True)


def _row(each: Estimate) -> tuple[str | Badge, ...]:
    name, unit = verbatim(each.name), verbatim(each.unit)
    if not each.known:
        return name, f"{each.value:.6g}", "", "", unit, Badge(text="not determined", tone=Tone.BAD)
    interval = f"{each.low:.6g} to {each.high:.6g}"
    badge = Badge(text="roughly known", tone=Tone.MILD) if each.reason else Badge(text="known", tone=Tone.GOOD)
    return name, f"{each.value:.6g}", f"{each.std:.2g}", interval, unit, badge


def _residuals(fit: Fit) -> Iterator[Block]:
    rows = tuple(
        (
            verbatim(each.output),
            f"{each.rms:.3g} {each.unit}".rstrip(),
            f"{each.noise:.3g}",
            f"{each.whiteness:.2g}",
            Badge(text="noise", tone=Tone.GOOD) if each.explained else Badge(text="more than noise", tone=Tone.BAD),
        )
        for each in fit.tests
    )
    head = ("output", "residual, rms", "noise of the channel", "whiteness, p", "verdict")
    yield Table(head=head, rows=rows, numeric=frozenset({1, 2, 3}))
    for each in fit.tests:
        yield Text(text=verbatim(f"{each.output}: {each.text}."))
    for held in fit.held_out:
        shares = ", ".join(f"{100 * share:.4g} % of the variance of {name}" for name, share in held.explained.items())
        yield Text(text=verbatim(f"{held.record}, held out: the fit predicts {shares}."))


def _records(fit: Fit) -> Iterator[Block]:
    for number, run in enumerate(fit.experiments):
        panels = tuple(_panels(fit, number, run))
        yield Picture(
            svg=svg_text(plot_panels(panels), prefix=f"record-{number}-"),
            caption=verbatim(f"{run.record.name}: measured and model, and their difference, SI."),
            description="For every output a panel of measured and modelled values, and one of what is left over.",
        )


def _panels(fit: Fit, number: int, run: Experiment) -> Iterator[Panel]:
    kept = slice(None, None, max(1, len(run.times) // DRAWN))
    times, model = run.times[kept], fit.predicted(number)
    for k, test in enumerate(fit.tests):
        measured = Curve(label="measured", times=times, values=run.measured[kept, k])
        fitted = Curve(label="model", times=times, values=model[kept, k], hue=1, dash=1)
        yield Panel(quantity=test.output, unit=test.unit, curves=(measured, fitted))
        left = Curve(label="", times=times, values=np.asarray(fit.residuals[number])[kept, k], hue=2)
        levels = (-2 * test.noise, 2 * test.noise)
        yield Panel(quantity=f"rest of {test.output}", unit=test.unit, curves=(left,), levels=levels)
