"""What a report says of the controller: forms, law, observer, poles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ulna.design import Law, Observer, gains_in_form
from ulna.loop import Loop
from ulna.page.payload import poles_of
from ulna.page.report.formulas import cell, numbers, rows_of, set_formulas
from ulna.plot import plot_poles, svg_text
from ulna.report import Block, Picture, Section, Table, Text, verbatim
from ulna.symbolic.formulas import name_latex
from ulna.system import as_system, system_latex


def controller_section(loop: Loop, values: dict[str, float]) -> Section:
    """The forms of the plant that the design used, law and observer, and where the poles lie."""
    return Section(anchor="controller", title="The controller", blocks=tuple(_controller(loop, values)))


def _controller(loop: Loop, values: dict[str, float]) -> Iterator[Block]:
    made: Any = loop.controller
    passed = getattr(made, "passed", {})
    if passed:
        rows = tuple((verbatim(name), verbatim(reason)) for name, reason in passed.items())
        yield Table(head=("method", "why not"), rows=rows, caption="Better methods that do not work here")
    law, observer = getattr(made, "law", None), getattr(made, "observer", None)
    if isinstance(law, Law):
        yield from _law(law)
    if isinstance(observer, Observer):
        yield from _observer(observer)
    if law is None and observer is None:
        yield Text(text="The controller was given as equations.")
        yield from set_formulas(system_latex(as_system(made)))
    yield from _poles(loop, made, values)


def _law(law: Law) -> Iterator[Block]:
    yield Text(text=verbatim(f"The law is {law.method}."))
    if (form := law.form) is not None:
        yield from rows_of({f"z_{{{k}}}": e for k, e in enumerate(form.chain, start=1)}, "controller form z = T(x)")
        ends = {rf"\alpha_{{{k}}}": e for k, e in enumerate(form.alpha, start=1)}
        yield from rows_of(ends | {r"\beta": form.beta[0, 0] if form.beta.shape == (1, 1) else form.beta},
                           "ends of the chains, α + β u")  # fmt: skip
    if law.gains:
        yield from rows_of({"K": law.gains}, "gains")
    driven = zip((s.name for s in law.system.outputs), law.expressions, strict=True)
    yield from rows_of({name_latex(name): e for name, e in driven}, "law")


def _observer(observer: Observer) -> Iterator[Block]:
    yield Text(text=verbatim(f"The observer: {observer.verdict.claim} ({observer.verdict.status})."))
    if (form := observer.form) is not None:
        forward = {f"z_{{{k}}}": e for k, e in enumerate(form.map.forward, start=1)}
        yield from rows_of(forward, "observer form z = T(x)")
        injected = {rf"\gamma_{{{k}}}": e for k, e in enumerate(form.injection, start=1)}
        yield from rows_of(injected | {"L": gains_in_form(observer)}, "injection γ(y, u) and gains L on y − ŷ in z")
    system = observer.system
    rates = zip(system.states, system.inline(system.rates), strict=True)
    yield from rows_of({rf"\dot{{{name_latex(s.name)}}}": e for s, e in rates}, "observer")


def _poles(loop: Loop, made: Any, values: dict[str, float]) -> Iterator[Block]:
    # Poles of a design with open parameters have no numbers.
    designed = getattr(made, "poles", {}) if not made_of_symbols(made) else {}
    groups = dict(designed) if isinstance(designed, dict) else {"law": designed}
    groups["loop at rest"] = tuple(complex(*each) for each in poles_of(loop, values))
    groups = {name: row for name, row in groups.items() if row}
    if not groups:
        return
    rows = tuple((name, cell(numbers(row))) for name, row in groups.items())
    yield Table(head=("poles of", "1/s"), rows=rows, caption="Poles; those of the loop without its hardware.")
    yield Picture(
        svg=svg_text(plot_poles(groups), prefix="poles-"),
        caption="Poles in the plane; the unstable half is shaded.",
        description="A plane with a mark at every pole.",
    )


def made_of_symbols(made: Any) -> bool:
    """Whether the design holds parameters without a value."""
    return any(p.value is None for p in getattr(made, "plant", as_system(made)).parameters)
